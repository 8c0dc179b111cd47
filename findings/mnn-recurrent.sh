#!/bin/sh
# MNN 3.6.1, onnxruntime 1.32.0, onnx 1.23.2: MNN converts an ONNX file's recurrent layer with attributes that it does not compute, without an error: a GRU resets after the product with the
# state, whatever linear_before_reset says (0 is the operator's default and Keras's reset_after=False, 1 is torch's). direction = reverse is computed forward, although both directions at once are
# right; and clip, the lengths of sequences and input_forget have no effect. The plain LSTM, RNN and torch's GRU are onnxruntime's.
# Seen on 2026-11-29:  largest difference: plain LSTM, RNN, GRU of torch, LSTM in both directions: below 1e-6   GRU with linear_before_reset 0: 0.22   reverse LSTM 0.73, RNN 1.2
#                      LSTM with clip 0.3: 0.28, lengths 0.29, input_forget 0.21
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q mnn==3.6.1 onnx==1.23.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import _tools, MNN.expr, MNN.nn  # _tools is what the command mnnconvert calls
import numpy as np, onnx, onnxruntime
from onnx import TensorProto, helper, numpy_helper

GATES, STEPS, BATCH, INPUTS, HIDDEN = {"LSTM": 4, "GRU": 3, "RNN": 1}, 5, 2, 3, 4


def difference(cell, lengths=None, **attributes):
    rng = np.random.default_rng(0)
    directions, rows = 1 + (attributes.get("direction") == "bidirectional"), GATES[cell] * HIDDEN
    shapes = {"w": (directions, rows, INPUTS), "r": (directions, rows, HIDDEN), "b": (directions, 2 * rows), "h": (directions, BATCH, HIDDEN)}
    if cell == "LSTM":
        shapes["c"] = shapes["h"]
    constants = [numpy_helper.from_array(0.5 * rng.standard_normal(shape).astype(np.float32), name) for name, shape in shapes.items()]
    if lengths:
        constants.append(numpy_helper.from_array(np.array(lengths, np.int32), "lengths"))
    inputs = ["x", "w", "r", "b", "lengths" if lengths else "", "h"] + ["c"] * (cell == "LSTM")
    outputs = ["y", "last", "memory"][: 3 if cell == "LSTM" else 2]
    node = helper.make_node(cell, inputs, outputs, hidden_size=HIDDEN, **attributes)
    x = rng.standard_normal((STEPS, BATCH, INPUTS)).astype(np.float32)
    given = helper.make_tensor_value_info("x", TensorProto.FLOAT, x.shape)
    state = (directions, BATCH, HIDDEN)
    wanted = [helper.make_tensor_value_info(name, TensorProto.FLOAT, (STEPS, *state) if name == "y" else state) for name in outputs]
    model = helper.make_model(helper.make_graph([node], "cell", [given], wanted, constants), opset_imports=[helper.make_opsetid("", 21)], ir_version=10)
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, "cell.onnx")
    expected = onnxruntime.InferenceSession("cell.onnx", providers=["CPUExecutionProvider"]).run(None, {"x": x})[0]
    _tools.mnnconvert(["mnnconvert", "-f", "ONNX", "--modelFile", "cell.onnx", "--MNNModel", "cell.mnn", "--bizCode", "x"])
    network = MNN.nn.load_module_from_file("cell.mnn", ["x"], outputs)
    found = network.forward([MNN.expr.const(x, list(x.shape), MNN.expr.NCHW, MNN.expr.float)])[0]
    found = np.array(MNN.expr.convert(found, MNN.expr.NCHW).read())
    assert found.shape == expected.shape
    return np.abs(found - expected).max()


right = [("LSTM", {}), ("RNN", {}), ("GRU", {"linear_before_reset": 1}), ("LSTM", {"direction": "bidirectional"})]
wrong = [("GRU", {}), ("LSTM", {"direction": "reverse"}), ("RNN", {"direction": "reverse"}), ("LSTM", {"clip": 0.3}), ("LSTM", {"lengths": [5, 2]}), ("LSTM", {"input_forget": 1})]
for cell, options in right + wrong:
    found = difference(cell, **options)
    print("SEEN", cell, options, f"{found:.2g}")
    assert found < 1e-5 if (cell, options) in right else found > 0.05
PY
grep SEEN out.txt
