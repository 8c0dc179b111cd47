#!/bin/sh
# iree-base-compiler and iree-base-runtime 3.13.0, onnx 1.23.2, onnxruntime 1.32.0: IREE compiles an ONNX file's LSTM, GRU and RNN without their lengths of sequences, other activations and peepholes, and
# the RNN without clip; there is no error, and the numbers are the plain cell's. clip, input_forget and direction = reverse of an LSTM are refused. The plain cells, both directions of
# an LSTM, linear_before_reset and initial states are onnxruntime's. A policy on padded histories acts on the padding.
# Seen on 2026-11-29:  largest difference: plain, bidirectional, linear_before_reset below 1e-5   lengths: LSTM 0.29, GRU 0.81, RNN 0.72   activations: LSTM 0.62, GRU 35   peepholes 0.07   RNN clip 0.69
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q iree-base-compiler==3.13.0 iree-base-runtime==3.13.0 onnx==1.23.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import subprocess, sys

import iree.compiler.tools, iree.runtime
import numpy as np, onnx, onnxruntime
from onnx import TensorProto, helper, numpy_helper

GATES, STEPS, BATCH, INPUTS, HIDDEN = {"LSTM": 4, "GRU": 3, "RNN": 1}, 5, 2, 3, 4


def difference(cell, lengths=None, peepholes=False, **attributes):
    rng = np.random.default_rng(0)
    directions, rows = 1 + (attributes.get("direction") == "bidirectional"), GATES[cell] * HIDDEN
    state = (directions, BATCH, HIDDEN)
    shapes = {"w": (directions, rows, INPUTS), "r": (directions, rows, HIDDEN), "b": (directions, 2 * rows), "h": state}
    if cell == "LSTM":
        shapes |= {"c": state} | ({"p": (directions, 3 * HIDDEN)} if peepholes else {})
    constants = [numpy_helper.from_array(0.5 * rng.standard_normal(shape).astype(np.float32), name) for name, shape in shapes.items()]
    if lengths:
        constants.append(numpy_helper.from_array(np.array(lengths, np.int32), "lengths"))
    inputs = ["x", "w", "r", "b", "lengths" if lengths else "", "h"] + ["c"] * (cell == "LSTM") + ["p"] * peepholes
    outputs = ["y", "last", "memory"][: 3 if cell == "LSTM" else 2]
    x = rng.standard_normal((STEPS, BATCH, INPUTS)).astype(np.float32)
    value = lambda name, shape: helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
    wanted = [value(name, (STEPS, *state) if name == "y" else state) for name in outputs]
    node = helper.make_node(cell, inputs, outputs, hidden_size=HIDDEN, **attributes)
    graph = helper.make_graph([node], "cell", [value("x", x.shape)], wanted, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 21)], ir_version=10)
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, "cell.onnx")
    expected = onnxruntime.InferenceSession("cell.onnx", providers=["CPUExecutionProvider"]).run(None, {"x": x})[0]
    subprocess.run([sys.executable, "-m", "iree.compiler.tools.import_onnx", "cell.onnx", "-o", "cell.mlir"], check=True)
    try:
        code = iree.compiler.tools.compile_file("cell.mlir", target_backends=["llvm-cpu"], input_type="onnx", extra_args=["--iree-llvmcpu-target-cpu=generic"])
    except iree.compiler.tools.binaries.CompilerToolError:
        return None
    context = iree.runtime.SystemContext(config=iree.runtime.Config("local-task"))
    context.add_vm_module(iree.runtime.VmModule.copy_buffer(context.instance, code))
    return np.abs(np.asarray(context.modules.module["cell"](x)[0].to_host()) - expected).max()


right = [("LSTM", {}), ("GRU", {}), ("RNN", {}), ("GRU", {"linear_before_reset": 1}), ("LSTM", {"direction": "bidirectional"})]
refused = [("LSTM", {"clip": 0.3}), ("LSTM", {"input_forget": 1})]
wrong = [(cell, {"lengths": [5, 2]}) for cell in GATES] + [
    ("LSTM", {"activations": ["HardSigmoid", "Relu", "Tanh"]}), ("GRU", {"activations": ["HardSigmoid", "Relu"]}),
    ("LSTM", {"peepholes": True}), ("RNN", {"clip": 0.3}),
]
for case in right + refused + wrong:
    cell, options = case
    found = difference(cell, **options)
    print("SEEN", cell, options, "refused" if found is None else f"{found:.2g}")
    assert found is None if case in refused else found is not None and (found < 1e-5 if case in right else found > 0.05)
PY
grep SEEN out.txt
