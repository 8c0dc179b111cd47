#!/bin/sh
# torch 2.15.0, onnxruntime 1.32.0, onnx 1.23.2: torch.fake_quantize and ONNX's QuantizeLinear round half to even, but what they round differs: torch multiplies
# by the scale's reciprocal, QuantizeLinear divides by the scale. Where a value lies between two codes they give different ones: a network trained with fake
# quantization has other codes in its file. Of the 200 values halfway between the codes of int8, 12 differ with scale 0.1, 34 with scale 0.013.
# Seen on 2026-11-28:  scale 0.1: 12   0.05: 12   0.013: 34   2 / 127: 0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q torch==2.15.0 onnxruntime==1.32.0 onnx==1.23.2 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import numpy as np, onnxruntime, torch
from onnx import TensorProto, helper
from onnx.reference import ReferenceEvaluator

seen = {}
for scale in (0.1, 0.05, 0.013, 2 / 127):
    x = ((np.arange(-100, 100) + 0.5) * scale).astype(np.float32)
    constants = [helper.make_tensor("s", TensorProto.FLOAT, [], [scale]), helper.make_tensor("z", TensorProto.INT8, [], [0])]
    nodes = [helper.make_node("QuantizeLinear", ["x", "s", "z"], ["q"]), helper.make_node("DequantizeLinear", ["q", "s", "z"], ["y"])]
    values = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [len(x)]) for name in "xy"]
    graph = helper.make_graph(nodes, "g", values[:1], values[1:], constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 21)], ir_version=10)
    file = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"]).run(None, {"x": x})[0]
    assert np.array_equal(file, ReferenceEvaluator(model).run(None, {"x": x})[0])
    trained = torch.fake_quantize_per_tensor_affine(torch.from_numpy(x), scale, 0, -128, 127).numpy()
    seen[round(scale, 4)] = int((np.abs(file - trained) > scale / 2).sum())
print(seen)
assert seen == {0.1: 12, 0.05: 12, 0.013: 34, 0.0157: 0}, seen
PY
