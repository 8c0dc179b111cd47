#!/bin/sh
# onnxruntime 1.32.0, onnx 1.23.2: a bias in float32 of a layer with quantized observations, weights and outputs (QuantizeLinear and DequantizeLinear around a Gemm) is rounded by onnxruntime, from
# optimization level BASIC on, to whole multiples of the observations' scale times the weights' scale. The file has nothing of it, and there is no error. With 8 bits this step is small; with
# few bits it is as large as a bias: with the scales 0.5 and 0.4 the biases 0.09, 0.11 and -0.29 become 0, 0.2 and -0.2. What a layer's output is quantized by does not matter, that it is
# quantized does: without QuantizeLinear after the layer, or with optimization off, the biases are the file's. onnx's reference evaluator has the file's, too.
# Seen on 2026-11-29:  biases 0.09 0.11 -0.29, observation 0: reference and optimization off 0.09 0.11 -0.29, BASIC and default 0 0.2 -0.2   with Relu between: 0.09 0.11 0, default 0 0.2 0
#                      output not quantized: 0.09 0.11 -0.29   scales of 8 bits (0.02 and 0.01): 0.09 0.11 -0.29
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnx==1.23.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import numpy as np, onnx, onnxruntime
from onnx import TensorProto, helper, numpy_helper
from onnx.reference import ReferenceEvaluator

BIAS = [0.09, 0.11, -0.29]
LEVELS = onnxruntime.GraphOptimizationLevel
node = helper.make_node


def outputs(observed, weight, quantized=True, relu=False):
    """The layer's outputs for an observation of 0, whose scale and whose weights' scale are given; the outputs' scale is 0.001."""
    constants = {
        "xs": np.float32(observed), "ws": np.float32(weight), "ys": np.float32(0.001), "xz": np.int8(0), "yz": np.int16(0),
        "w": np.array([[1, -1], [-2, 1], [0, 1]], np.int8), "b": np.array(BIAS, np.float32),
    }
    nodes = [
        node("QuantizeLinear", ["x", "xs", "xz"], ["xq"]), node("DequantizeLinear", ["xq", "xs", "xz"], ["xd"]),
        node("DequantizeLinear", ["w", "ws", "xz"], ["wd"]), node("Gemm", ["xd", "wd", "b"], ["g"], transB=1),
        node("Relu" if relu else "Identity", ["g"], ["r"]),
    ]
    if not relu:
        nodes.pop()
    last = nodes[-1].output[0]
    if quantized:
        nodes += [node("QuantizeLinear", [last, "ys", "yz"], ["yq"]), node("DequantizeLinear", ["yq", "ys", "yz"], ["y"])]
    else:
        nodes[-1].output[0] = "y"
    value = lambda name, length: helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, length])
    tensors = [numpy_helper.from_array(np.asarray(array), name) for name, array in constants.items()]
    model = helper.make_model(helper.make_graph(nodes, "layer", [value("x", 2)], [value("y", 3)], tensors), opset_imports=[helper.make_opsetid("", 21)], ir_version=10)
    onnx.checker.check_model(model, full_check=True)
    x, found = {"x": np.zeros((1, 2), np.float32)}, {"reference": ReferenceEvaluator(model)}
    for name, level in (("off", LEVELS.ORT_DISABLE_ALL), ("BASIC", LEVELS.ORT_ENABLE_BASIC), ("default", LEVELS.ORT_ENABLE_ALL)):
        options = onnxruntime.SessionOptions()
        options.graph_optimization_level, options.log_severity_level = level, 3
        found[name] = onnxruntime.InferenceSession(model.SerializeToString(), options, providers=["CPUExecutionProvider"])
    return {name: session.run(None, x)[0][0].round(3) for name, session in found.items()}


cases = [
    ((0.5, 0.4), {}, [0, 0.2, -0.2]),
    ((0.5, 0.4), {"relu": True}, [0, 0.2, 0]),
    ((0.5, 0.4), {"quantized": False}, BIAS),
    ((0.02, 0.01), {}, BIAS),
]
for scales, options, expected in cases:
    found = outputs(*scales, **options)
    print("scales", *scales, options, *(f"{name}: {values}  " for name, values in found.items()))
    right = np.maximum(BIAS, 0) if options.get("relu") else np.array(BIAS)
    assert np.allclose(found["reference"], right, atol=2e-3) and np.allclose(found["off"], right, atol=2e-3)
    assert np.allclose(found["BASIC"], expected, atol=2e-3) and np.allclose(found["default"], expected, atol=2e-3)
PY
