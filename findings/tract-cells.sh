#!/bin/sh
# tract 0.23.9, onnxruntime 1.32.0, onnx 1.23.2: of the attributes of an ONNX file's LSTM, GRU and RNN, tract ignores clip, activations and input_forget, and
# gives other numbers for direction = reverse; there is no error. The plain cells, both directions at once, linear_before_reset and peepholes are onnxruntime's.
# Its Celu is exp(x / alpha) - 1 below 0, where alpha times that is meant: right for alpha = 1 only.
# Seen on 2026-11-29:  largest difference: plain, bidirectional, peepholes below 1e-5   LSTM: clip 0.43, activations 3.5, input_forget 0.73, reverse 0.48
#                      RNN: Relu 5.4, reverse 1.9   Celu with alpha 0.5 of -3, -1: -0.50 -0.43, tract -1.00 -0.86
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q tract==0.23.9 onnxruntime==1.32.0 onnx==1.23.2 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import numpy as np, onnx, onnxruntime, tract
from onnx import TensorProto, checker, helper, numpy_helper

hidden, width, steps = 5, 3, 2


def run(node, x, outputs, values={}):
    """The outputs of onnxruntime and of tract."""
    value = lambda name, shape: helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
    constants = [numpy_helper.from_array(values[name], name) for name in node.input if name in values]
    graph = helper.make_graph([node], "g", [value("X", x.shape)], [value(*output) for output in outputs.items()], constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    checker.check_model(model, full_check=True)
    onnx.save(model, "m.onnx")
    session = onnxruntime.InferenceSession("m.onnx", providers=["CPUExecutionProvider"])
    loaded = tract.onnx().load("m.onnx").into_model().into_runnable()
    return session.run(None, {"X": x}), [np.asarray(found.to_numpy()) for found in loaded.run([x])]


def difference(op, peepholes=False, **attributes):
    random, gates = np.random.default_rng(0), {"LSTM": 4, "GRU": 3, "RNN": 1}[op]
    dirs = 2 if attributes.get("direction") == "bidirectional" else 1
    shapes = {"W": (dirs, gates * hidden, width), "R": (dirs, gates * hidden, hidden), "B": (dirs, 2 * gates * hidden), "P": (dirs, 3 * hidden)}
    values = {name: random.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}
    sides = {"Y": [steps, dirs, 1, hidden], "Yh": [dirs, 1, hidden], "Yc": [dirs, 1, hidden]}
    outputs = {name: sides[name] for name in ("Y", "Yh", "Yc")[: 3 if op == "LSTM" else 2]}
    names = ["X", "W", "R", "B", *(["", "", "", "P"] if peepholes else [])]
    node = helper.make_node(op, names, list(outputs), hidden_size=hidden, **attributes)
    expected, found = run(node, (random.normal(size=(steps, 1, width)) * 2).astype(np.float32), outputs, values)
    return max(np.abs(a - b).max() for a, b in zip(expected, found))


both, relu = {"direction": "bidirectional"}, ["Sigmoid", "Relu", "Tanh"]
equal = [("LSTM", {}), ("GRU", {}), ("RNN", {}), ("LSTM", both), ("GRU", both), ("GRU", {"linear_before_reset": 1}), ("LSTM", {"peepholes": True})]
other = [
    ("LSTM", {"clip": 0.3}), ("LSTM", {"activations": relu}), ("LSTM", {"input_forget": 1}), ("LSTM", {"direction": "reverse"}), ("GRU", {"clip": 0.3}),
    ("GRU", {"activations": relu[:2]}), ("GRU", {"direction": "reverse"}), ("RNN", {"activations": ["Relu"]}), ("RNN", {"direction": "reverse"}),
]
for op, attributes in equal + other:
    largest = difference(op, **attributes)
    print(op, *attributes, *(str(value) for value in attributes.values()), f"{largest:.1e}")
    assert largest < 1e-5 if (op, attributes) in equal else largest > 0.05
x = np.array([[-3, -1, 1]], dtype=np.float32)
for alpha in (1.0, 0.5, 2.0):
    expected, found = ([round(float(n), 2) for n in y[0].ravel()] for y in run(helper.make_node("Celu", ["X"], ["Y"], alpha=alpha), x, {"Y": [1, 3]}))
    print("Celu", alpha, "onnxruntime", *expected, "  tract", *found)
    assert (expected == found) == (alpha == 1)
    assert np.allclose(found, np.where(x > 0, x, np.exp(x / alpha) - 1).ravel(), atol=0.006)
PY
