#!/bin/sh
# openvino 2026.4.1, onnxruntime 1.32.0, onnx 1.23.2: OpenVINO computes the Softmax of an ONNX file of an operator set below 13 by the rule of set 13: along the axis alone, where the
# sum of all numbers from the axis on is meant (the default axis is 1). There is no error. Its LogSoftmax and Hardmax of the same sets flatten, as onnxruntime's do. With the last axis
# there is no difference, and from set 13 on none either.
# Seen on 2026-11-29:  zeros [1, 2, 4], sets 11 and 12, axis 1 and default: onnxruntime 0.125, OpenVINO 0.5, exp of LogSoftmax 0.125 in both   set 13: 0.5 in both
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnx==1.23.2 onnxruntime==1.32.0 openvino==2026.4.1 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import numpy as np, onnxruntime, openvino
from onnx import TensorProto, checker, helper

core = openvino.Core()


def both(op, operator_set, **axis):
    x = np.zeros((1, 2, 4), np.float32)
    values = [helper.make_tensor_value_info(name, TensorProto.FLOAT, x.shape) for name in "xy"]
    graph = helper.make_graph([helper.make_node(op, ["x"], ["y"], **axis)], "g", values[:1], values[1:])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", operator_set)], ir_version=7)
    checker.check_model(model, full_check=True)
    data = model.SerializeToString()
    found = [onnxruntime.InferenceSession(data, providers=["CPUExecutionProvider"]).run(None, {"x": x})[0], core.compile_model(core.read_model(data), "CPU")([x])[0]]
    found = [round(float((np.exp(y) if op == "LogSoftmax" else y)[0, 0, 0]), 4) for y in found]
    print(f"{op} set {operator_set} {axis or 'default axis'}: onnxruntime {found[0]}, OpenVINO {found[1]}")
    return found


for operator_set in (11, 12):
    assert both("Softmax", operator_set, axis=1) == [0.125, 0.5]
    assert both("Softmax", operator_set) == [0.125, 0.5]
    assert both("Softmax", operator_set, axis=2) == [0.25, 0.25]
    assert both("LogSoftmax", operator_set, axis=1) == [0.125, 0.125]
assert both("Softmax", 13, axis=1) == [0.5, 0.5]
assert both("Softmax", 13) == [0.25, 0.25]
PY
