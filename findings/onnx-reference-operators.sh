#!/bin/sh
# onnx 1.23.2, onnxruntime 1.32.0: onnx's reference evaluator and onnxruntime give other numbers for operators that a policy may have, without an error. The reference
# divides by the sum of the values where LpNormalization with p = 1 is the sum of their magnitudes; it pads MaxPool at the end for SAME_LOWER, as for SAME_UPPER (its
# AveragePool and Conv do not); and it computes Softmax of operator sets below 13 by the rule of 13. LpNormalization with p = 2, SAME_UPPER and set 13 agree.
# Seen on 2026-11-29:  of [3, -1, 0, 2]: onnxruntime 0.5 -0.17 0 0.33, reference 0.75 -0.25 0 0.5   MaxPool of 1 to 6 by 3 and 2: 2 4 6, reference 3 5 6
#                      Softmax (set 11, axis 1) of zeros [1, 2, 2]: 0.25, reference 0.5
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnx==1.23.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import numpy as np, onnxruntime
from onnx import TensorProto, checker, helper
from onnx.reference import ReferenceEvaluator


def both(operator_set, op, x, shape, **attributes):
    x = np.array(x, dtype=np.float32)
    value = lambda name, shape: helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
    graph = helper.make_graph([helper.make_node(op, ["x"], ["y"], **attributes)], "g", [value("x", x.shape)], [value("y", shape)])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", operator_set)], ir_version=8)
    checker.check_model(model, full_check=True)
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    found = [[round(float(n), 2) for n in run(None, {"x": x})[0].ravel()] for run in (session.run, ReferenceEvaluator(model).run)]
    print(op, operator_set, attributes, "onnxruntime", *found[0], "  reference", *found[1])
    return found


row, steps = [[3, -1, 0, 2]], [[[1, 2, 3, 4, 5, 6]]]
assert both(17, "LpNormalization", row, [1, 4], p=1) == [[0.5, -0.17, 0, 0.33], [0.75, -0.25, 0, 0.5]]
same = both(17, "LpNormalization", row, [1, 4], p=2)
assert same[0] == same[1]
pool = {"kernel_shape": [3], "strides": [2]}
assert both(17, "MaxPool", steps, [1, 1, 3], auto_pad="SAME_LOWER", **pool) == [[2, 4, 6], [3, 5, 6]]
for op, pad in (("MaxPool", "SAME_UPPER"), ("AveragePool", "SAME_LOWER")):
    same = both(17, op, steps, [1, 1, 3], auto_pad=pad, **pool)
    assert same[0] == same[1]
zeros = [[[0, 0], [0, 0]]]
assert both(11, "Softmax", zeros, [1, 2, 2], axis=1) == [[0.25] * 4, [0.5] * 4]
assert both(13, "Softmax", zeros, [1, 2, 2], axis=1) == [[0.5] * 4, [0.5] * 4]
PY
