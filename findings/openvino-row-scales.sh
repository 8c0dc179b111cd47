#!/bin/sh
# openvino 2026.4.1, onnx 1.23.2: a layer whose quantized weights have a scale for each row, that is for each input (DequantizeLinear with axis = 0 before MatMul, or axis = 1 before
# a Gemm with transB), has only the first scale in OpenVINO's CPU device: all rows take it. There is no error and no warning, with INT8, UINT8 and INT4, for 4 and more inputs.
# A scale for each output, blocks of 2 inputs, and the same scales in a layer of 3 inputs are computed right.
# Seen on 2026-11-29:  weights 1, scales 1 10 1 10 .., 8 inputs of 1: 44, OpenVINO 8 (MatMul and Gemm; INT8, UINT8, INT4)   3 inputs: 12, OpenVINO 12
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnx==1.23.2 openvino==2026.4.1 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import numpy as np, openvino
from onnx import TensorProto, checker, helper, shape_inference
from onnx.reference import ReferenceEvaluator

FLOAT = TensorProto.FLOAT
core = openvino.Core()


def layer(kind, inputs, axis, product="MatMul", block=0):
    """The first output of a layer with weights of 1 and scales of 1 and 10 in turn."""
    outputs, transposed = 6, product == "Gemm"
    shape = [outputs, inputs] if transposed else [inputs, outputs]
    scales = np.where(np.arange(shape[axis] // max(block, 1)) % 2, 10, 1)
    scales = np.repeat(scales[:, None], outputs, axis=1) if block else scales
    constants = [
        helper.make_tensor("w", getattr(TensorProto, kind), shape, [1] * inputs * outputs),
        helper.make_tensor("s", FLOAT, scales.shape, scales.ravel().tolist()),
    ]
    nodes = [
        helper.make_node("DequantizeLinear", ["w", "s"], ["d"], axis=axis, **({"block_size": block} if block else {})),
        helper.make_node(product, ["x", "d"], ["y"], **({"transB": 1} if transposed else {})),
    ]
    values = [helper.make_tensor_value_info("x", FLOAT, [1, inputs]), helper.make_tensor_value_info("y", FLOAT, [1, outputs])]
    model = helper.make_model(helper.make_graph(nodes, "g", values[:1], values[1:], constants), opset_imports=[helper.make_opsetid("", 21)], ir_version=10)
    checker.check_model(model, full_check=True)
    x = np.ones((1, inputs), np.float32)
    expected = ReferenceEvaluator(model).run(None, {"x": x})[0][0]
    found = core.compile_model(core.read_model(model.SerializeToString()), "CPU")([x])[0][0]
    print(f"{kind} {product} axis {axis} block {block}, {inputs} inputs: reference {expected[:2]}, OpenVINO {found[:2]}")
    return [float(expected[0]), float(found[0])], bool(np.allclose(expected, found))


for kind in ("INT8", "UINT8", "INT4"):
    assert layer(kind, 8, 0) == ([44, 8], False)
    assert layer(kind, 8, 1, "Gemm") == ([44, 8], False)
    assert layer(kind, 4, 0) == ([22, 4], False)
    assert layer(kind, 3, 0) == ([12, 12], True)
    assert layer(kind, 8, 1) == ([8, 8], True)
    assert layer(kind, 8, 0, "Gemm") == ([8, 8], True)
assert layer("INT4", 8, 0, block=2) == ([44, 44], True)
PY
