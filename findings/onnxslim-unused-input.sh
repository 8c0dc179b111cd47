#!/bin/sh
# onnxslim 0.1.98, onnx 1.23.2: slim() removes an input that no node reads from the model's inputs, without a warning: a caller that gives the observation as
# the file declared it is refused afterwards. onnxsim 0.8.1 and onnxoptimizer 0.4.2 keep it.
# Seen on 2026-11-28:  onnxslim: x   onnxsim: x, command   onnxoptimizer: x, command   onnxruntime given both: only onnxslim's file is refused (InvalidArgument)
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnxslim==0.1.98 onnxsim==0.8.1 onnxoptimizer==0.4.2 onnx==1.23.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python - 2>/dev/null <<'PY'
import copy, numpy as np, onnx, onnxoptimizer, onnxruntime, onnxsim, onnxslim
from onnx import TensorProto, helper

x, command, action = (helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, 3]) for name in ("x", "command", "action"))
graph = helper.make_graph([helper.make_node("Tanh", ["x"], ["action"])], "g", [x, command], [action])
model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)
onnx.checker.check_model(model, full_check=True)
feeds = {name: np.zeros((1, 3), dtype=np.float32) for name in ("x", "command")}
seen = {}
for name, tool in {"onnxslim": onnxslim.slim, "onnxsim": lambda m: onnxsim.simplify(m)[0], "onnxoptimizer": onnxoptimizer.optimize}.items():
    made = tool(copy.deepcopy(model))
    seen[name] = [value.name for value in made.graph.input]
    try:
        onnxruntime.InferenceSession(made.SerializeToString(), providers=["CPUExecutionProvider"]).run(None, feeds)
        ran = "runs"
    except Exception as error:
        ran = type(error).__name__
    print(f"{name}: {', '.join(seen[name])}; given both: {ran}")
    assert (ran == "runs") == (name != "onnxslim")
assert seen == {"onnxslim": ["x"], "onnxsim": ["x", "command"], "onnxoptimizer": ["x", "command"]}, seen
PY
