#!/bin/sh
# onnx 1.23.2, onnxruntime 1.32.0: version_converter.convert_version changes what operators compute, without an error. Resize of set 10 (linear) becomes set 11's without the
# coordinates that were meant ("asymmetric"). Hardmax of set 11 keeps its axis in set 13, where it means something else, although Softmax and LogSoftmax are rewritten; and these two keep
# theirs on the way down, from 13 to 12. On the way up, and with the last axis, these two are right.
# Seen on 2026-11-29:  Resize of 0 8 by 2: 0 4 8 8 becomes 0 2 6 8   Hardmax (axis 1) of zeros [1, 2, 2]: one 1, then two   Softmax (axis 1), 13 to 12: 0.5 becomes 0.25
#                      Softmax, 11 to 13: 0.25 in both   Resize (nearest): the same
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnx==1.23.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import numpy as np, onnxruntime
from onnx import TensorProto, checker, helper, numpy_helper, version_converter

onnxruntime.set_default_logger_severity(4)


def run(model, x):
    checker.check_model(model)
    return onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"]).run(None, {"x": x})[0].ravel().round(4).tolist()


def convert(op, before, after, x, shape, constants={}, **attributes):
    x = np.array(x, np.float32)
    values = [helper.make_tensor_value_info("x", TensorProto.FLOAT, x.shape), helper.make_tensor_value_info("y", TensorProto.FLOAT, shape)]
    weights = [numpy_helper.from_array(np.array(value, np.float32), name) for name, value in constants.items()]
    graph = helper.make_graph([helper.make_node(op, ["x", *constants], ["y"], **attributes)], "g", values[:1], values[1:], weights)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", before)], ir_version=8)
    converted = version_converter.convert_version(model, after)
    assert converted.opset_import[0].version == after
    found = [run(model, x), run(converted, x)]
    print(f"{op} {attributes}, set {before} to {after}: {found[0]}, then {found[1]}")
    return found


size, zeros = {"scales": [1, 1, 1, 2]}, [[[0, 0], [0, 0]]]
assert convert("Resize", 10, 13, [[[[0, 8]]]], [1, 1, 1, 4], size, mode="linear") == [[0, 4, 8, 8], [0, 2, 6, 8]]
assert convert("Resize", 10, 13, [[[[0, 8]]]], [1, 1, 1, 4], size, mode="nearest") == [[0, 0, 8, 8]] * 2
assert convert("Hardmax", 11, 13, zeros, [1, 2, 2], axis=1) == [[1, 0, 0, 0], [1, 1, 0, 0]]
assert convert("Softmax", 11, 13, zeros, [1, 2, 2], axis=1) == [[0.25] * 4] * 2
assert convert("Softmax", 13, 12, zeros, [1, 2, 2], axis=1) == [[0.5] * 4, [0.25] * 4]
assert convert("LogSoftmax", 13, 12, zeros, [1, 2, 2], axis=1) == [[n] * 4 for n in np.log([0.5, 0.25], dtype=np.float32).round(4).tolist()]
PY
