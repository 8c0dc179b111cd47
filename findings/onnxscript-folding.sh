#!/bin/sh
# onnxscript 0.7.2, onnx 1.23.2, onnx-ir 1.1.0, onnxruntime 1.32.0: the optimizer that torch.onnx.export applies, and the version converter beside it, change what a file computes, without an error. Nodes of constants
# are folded by onnx's reference evaluator with its own numbers: LpNormalization (p = 1) and MaxPool with SAME_LOWER are others than onnxruntime computes for the same nodes, when their input is not a constant. And
# convert_version takes a file of set 11 to 18, with Softmax, LogSoftmax and Hardmax as they are, whose axis means something else from 13 on. With the last axis, and for a file of set 13, nothing changes.
# Seen on 2026-11-29:  LpNormalization of 3 -1 0 2: 0.5 -0.17 0 0.33, folded 0.75 -0.25 0 0.5   MaxPool of 1 to 6: 2 4 6, folded 3 5 6   Softmax of zeros [1, 2, 2], set 11: 0.25, set 13: 0.5, 11 to 18: 0.5
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnxscript==0.7.2 onnx==1.23.2 onnx-ir==1.1.0 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import numpy as np, onnx, onnx_ir, onnxruntime
from onnx import TensorProto, helper, numpy_helper
from onnxscript import optimizer, version_converter


def file(operator, value, constant, opset=18, **attributes):
    """A file that adds an operator's output to its observation; the operator's input is a constant or a second input."""
    inputs = [helper.make_tensor_value_info("obs", TensorProto.FLOAT, [])]
    if not constant:
        inputs.append(helper.make_tensor_value_info("x", TensorProto.FLOAT, value.shape))
    nodes = [helper.make_node(operator, ["x"], ["y"], **attributes), helper.make_node("Add", ["obs", "y"], ["action"])]
    graph = helper.make_graph(nodes, "g", inputs, [helper.make_tensor_value_info("action", TensorProto.FLOAT, [None] * value.ndim)], [numpy_helper.from_array(value, "x")] if constant else [])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", opset)], ir_version=10)
    onnx.checker.check_model(model)
    return model


def run(model, value):
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    given = {"obs": np.float32(0), "x": value}
    return session.run(None, {node.name: np.asarray(given[node.name]) for node in session.get_inputs()})[0].ravel()


for operator, value, expected, folded, attributes in (
    ("LpNormalization", np.float32([[3, -1, 0, 2]]), [1 / 2, -1 / 6, 0, 1 / 3], [0.75, -0.25, 0, 0.5], {"p": 1, "axis": 1}),
    ("MaxPool", np.float32([[[1, 2, 3, 4, 5, 6]]]), [2, 4, 6], [3, 5, 6], {"kernel_shape": [3], "strides": [2], "auto_pad": "SAME_LOWER"}),
):
    optimized = optimizer.optimize(file(operator, value, True, **attributes))
    seen = run(file(operator, value, False, **attributes), value), run(optimized, value)
    kept = run(optimizer.optimize(file(operator, value, False, **attributes)), value)
    print("SEEN", operator, np.round(seen[0], 2), "folded", np.round(seen[1], 2), "optimized, not a constant", np.round(kept, 2))
    assert operator not in [node.op_type for node in optimized.graph.node]
    assert np.allclose(seen[0], expected) and np.allclose(seen[1], folded) and np.allclose(kept, expected)

value = np.zeros((1, 2, 2), np.float32)
for operator in ("Softmax", "LogSoftmax", "Hardmax"):
    for opset, axis, changes in ((11, 1, True), (11, 2, False), (13, 1, False)):
        model = file(operator, value, False, opset, axis=axis)
        converted = onnx_ir.from_proto(model)
        version_converter.convert_version(converted, 18)
        converted = onnx_ir.to_proto(converted)
        onnx.checker.check_model(converted)
        assert converted.opset_import[0].version == 18
        before, after = run(model, value), run(converted, value)
        print("SEEN", operator, "set", opset, "axis", axis, np.round(before, 2), "set 18", np.round(after, 2))
        assert np.allclose(before, after) != changes
PY
grep SEEN out.txt
