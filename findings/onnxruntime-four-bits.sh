#!/bin/sh
# onnxruntime 1.32.0, torch 2.15.0, onnx 1.23.2, onnx-ir 1.1.0, onnxscript 0.7.2: MatMulNBitsQuantizer, the quantizer to 4 bits, leaves each linear layer that
# torch writes for an observation [1, n] as it is: it is a Gemm, and only MatMul is quantized. The result has all weights in float32, which looks like 4 bits
# without any loss. It raises no error and gives no warning (a line of level INFO). The same network exported with an observation [1, 1, n] is quantized. With
# quant_format=QDQ and bits=8, not even that one is.
# Seen on 2026-11-29:  [1, n]: 2 of 2 layers float32, 100 % of the bytes   [1, 1, n]: 0 of 2, 21 %   8 bits as QDQ: 2 of 2, 100 %
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnxruntime==1.32.0 torch==2.15.0 onnx==1.23.2 onnx-ir==1.1.0 onnxscript==0.7.2 numpy==2.4.6
v/bin/python -W ignore - 2>/dev/null <<'PY'
import io, onnx, torch
from onnxruntime.quantization import QuantFormat
from onnxruntime.quantization.matmul_nbits_quantizer import DefaultWeightOnlyQuantConfig, MatMulNBitsQuantizer
from torch import nn

net = nn.Sequential(nn.Linear(64, 64), nn.ELU(), nn.Linear(64, 8)).eval()


def quantized(shape, bits, form):
    content = io.BytesIO()
    torch.onnx.export(net, (torch.zeros(shape),), content, dynamo=False)
    model = onnx.load_from_string(content.getvalue())
    config = DefaultWeightOnlyQuantConfig(block_size=32, is_symmetric=True, bits=bits, quant_format=form)
    quantizer = MatMulNBitsQuantizer(model, algo_config=config)
    quantizer.process()
    after = quantizer.model.model
    weights = {t.name for t in after.graph.initializer if t.data_type == onnx.TensorProto.FLOAT and len(t.dims) == 2}
    layers = [node for node in after.graph.node if node.op_type in ("Gemm", "MatMul", "MatMulNBits")]
    left = sum(node.input[1] in weights for node in layers)
    size = after.ByteSize() / len(content.getvalue())
    print(f"{shape}, {bits} bits, {form.name}: {left} of {len(layers)} layers float32, {100 * size:.0f} % of the bytes")
    return left


assert quantized((1, 64), 4, QuantFormat.QOperator) == 2
assert quantized((1, 64), 4, QuantFormat.QDQ) == 2
assert quantized((1, 1, 64), 4, QuantFormat.QOperator) == 0
assert quantized((1, 1, 64), 8, QuantFormat.QDQ) == 2
PY
