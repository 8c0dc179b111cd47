#!/bin/sh
# openvino 2026.4.1, onnxruntime 1.32.0, onnx 1.23.2: OpenVINO reads an ONNX file's LSTM with peepholes, or with input_forget = 1, and computes the cell without them;
# there is no error and no warning. With clip, other activations and lengths of sequences it computes what onnxruntime does. (onnx's reference evaluator agrees with
# onnxruntime about the peepholes.)
# Seen on 2026-11-29:  largest difference: plain, clip, activations below 1e-5   peepholes 0.11   input_forget 0.73
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q openvino==2026.4.1 onnxruntime==1.32.0 onnx==1.23.2 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import numpy as np, onnx, onnxruntime, openvino
from onnx import TensorProto, checker, helper, numpy_helper
from onnx.reference import ReferenceEvaluator

hidden, width, steps = 5, 3, 2
core = openvino.Core()


def differences(peepholes=False, **attributes):
    """Of OpenVINO and of the reference evaluator to onnxruntime."""
    random = np.random.default_rng(0)
    shapes = {"W": (1, 4 * hidden, width), "R": (1, 4 * hidden, hidden), "B": (1, 8 * hidden), "P": (1, 3 * hidden)}
    values = {name: random.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}
    names = ["X", "W", "R", "B", *(["", "", "", "P"] if peepholes else [])]
    outputs = {"Y": [steps, 1, 1, hidden], "Yh": [1, 1, hidden], "Yc": [1, 1, hidden]}
    value = lambda name, shape: helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
    graph = helper.make_graph(
        [helper.make_node("LSTM", names, list(outputs), hidden_size=hidden, **attributes)], "g", [value("X", [steps, 1, width])],
        [value(*output) for output in outputs.items()], [numpy_helper.from_array(values[name], name) for name in names if name in values],
    )  # fmt: skip
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    checker.check_model(model, full_check=True)
    onnx.save(model, "m.onnx")
    x = {"X": (random.normal(size=(steps, 1, width)) * 2).astype(np.float32)}
    expected = onnxruntime.InferenceSession("m.onnx", providers=["CPUExecutionProvider"]).run(None, x)
    # By default a processor with bfloat16 may compute in it.
    found = core.compile_model("m.onnx", "CPU", {"INFERENCE_PRECISION_HINT": "f32"})(x)
    reference = ReferenceEvaluator(model).run(None, x)
    return [max(np.abs(a - b).max() for a, b in zip(expected, other)) for other in ([found[i] for i in range(3)], reference)]


seen = {}
for name, options in (
    ("plain", {}), ("clip", {"clip": 0.3}), ("activations", {"activations": ["Sigmoid", "Relu", "Tanh"]}),
    ("peepholes", {"peepholes": True}), ("input_forget", {"input_forget": 1}),
):
    seen[name], reference = differences(**options)
    print(f"{name}: OpenVINO off by {seen[name]:.1e}")
    assert name != "peepholes" or reference < 1e-5
assert all(seen[name] < 1e-4 for name in ("plain", "clip", "activations")) and all(seen[name] > 0.05 for name in ("peepholes", "input_forget"))
PY
