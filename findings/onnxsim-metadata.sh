#!/bin/sh
# onnxsim 0.8.1, onnx 1.23.2: simplify() adds 19 entries of its own to the metadata of the file, also to a file that it leaves as it is. A reader that takes the
# metadata for what the exporter of a policy wrote finds those among them, and the file of a small network is many times as large.
# Seen on 2026-11-28:  before: 1 entry (joint_names), 116 bytes   after: 20 entries, 19 of them onnxsim.*, 776 bytes
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnxsim==0.8.1 onnx==1.23.2 numpy==2.4.6
v/bin/python - <<'PY'
import onnx, onnxsim
from onnx import TensorProto, helper

x, action = (helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, 3]) for name in ("x", "action"))
graph = helper.make_graph([helper.make_node("Tanh", ["x"], ["action"], name="tanh")], "g", [x], [action])
model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)
helper.set_model_props(model, {"joint_names": "hip,thigh,calf"})
onnx.checker.check_model(model, full_check=True)
after, ok = onnxsim.simplify(model)
keys = [entry.key for entry in after.metadata_props]
own = [key for key in keys if key.startswith("onnxsim.")]
print(f"before: {len(model.metadata_props)} entry, {model.ByteSize()} bytes", end="   ")
print(f"after: {len(keys)} entries, {len(own)} of them onnxsim.*, {after.ByteSize()} bytes")
assert ok and after.graph == model.graph and len(own) == 19 and set(keys) - set(own) == {"joint_names"}, keys
PY
