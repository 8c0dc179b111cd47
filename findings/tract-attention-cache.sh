#!/bin/sh
# tract 0.23.9, onnxruntime 1.32.0, onnx 1.23.2: in an ONNX file's Attention with is_causal = 1 and a cache (past_key, past_value), tract's query looks back from the beginning of the
# cache and not from its end: one new token, which is the latest and sees everything, sees the first cached key only. There is no error. A policy that keeps keys and values from step to
# step acts on its first observation for ever. Without is_causal, and without a cache, tract's numbers are onnxruntime's. Its Swish ignores alpha.
# Seen on 2026-11-29:  cache 1, 2, new value 6: onnxruntime 3, tract 1; two new values 6, 7: 3 and 4, tract 1 and 1.5   not causal: 3 in both   Swish of 1, alpha 2: 0.88, tract 0.73
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnx==1.23.2 onnxruntime==1.32.0 tract==0.23.9 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import numpy as np, onnx, onnxruntime, tract
from onnx import TensorProto, checker, helper


def both(operator_set, op, names, given, outputs, **attributes):
    """The first output of onnxruntime and of tract."""
    value = lambda name, shape: helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
    inputs = [value(name, x.shape) for name, x in given.items()]
    graph = helper.make_graph([helper.make_node(op, names, list(outputs), **attributes)], "g", inputs, [value(*output) for output in outputs.items()])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", operator_set)], ir_version=10)
    checker.check_model(model, full_check=True)
    onnx.save(model, "m.onnx")
    expected = onnxruntime.InferenceSession("m.onnx", providers=["CPUExecutionProvider"]).run(None, given)[0]
    found = tract.onnx().load("m.onnx").into_model().into_runnable().run(list(given.values()))[0].to_numpy()
    return [[round(float(n), 2) for n in np.asarray(y).ravel()] for y in (expected, found)]


def attend(cache, new, causal):
    zeros = lambda values: np.zeros((1, 1, len(values), 1), np.float32)
    value = lambda values: np.array(values, np.float32).reshape(1, 1, -1, 1)
    given = {"q": zeros(new), "k": zeros(new), "v": value(new)}
    names, outputs = list(given), {"y": [1, 1, len(new), 1]}
    if cache:
        given |= {"past_k": zeros(cache), "past_v": value(cache)}
        names += ["", "past_k", "past_v"]
        outputs |= {name: [1, 1, len(cache + new), 1] for name in ("present_k", "present_v")}
    found = both(23, "Attention", names, given, outputs, is_causal=causal)
    print(f"cache {cache}, new {new}, is_causal {causal}: onnxruntime {found[0]}, tract {found[1]}")
    return found


assert attend([1, 2], [6], 1) == [[3], [1]]
assert attend([1, 2], [6, 7], 1) == [[3, 4], [1, 1.5]]
assert attend([1, 2], [6], 0) == [[3], [3]]
assert attend([], [1, 2, 6], 1) == [[1, 1.5, 3]] * 2
x = {"x": np.array([[1]], np.float32)}
for alpha, expected in ((1.0, [[0.73], [0.73]]), (2.0, [[0.88], [0.73]])):
    found = both(24, "Swish", ["x"], x, {"y": [1, 1]}, alpha=alpha)
    print("Swish alpha", alpha, "onnxruntime", *found[0], "  tract", *found[1])
    assert found == expected
PY
