#!/bin/sh
# torchao 0.18.0, torch 2.15.0: IntxWeightOnlyConfig, which is documented for torch.int1 to torch.int8, quantizes a layer to one bit by making all its weights 0 with its default, symmetric
# mapping: the output is the bias, whatever the input. There is no error and no warning, and the layer reports int1. With 2 bits, and with MappingType.ASYMMETRIC, the codes are used.
# MappingType.SYMMETRIC_NO_CLIPPING_ERR makes NaN of one bit.
# Seen on 2026-11-29:  int1: code 0 for 1024 of 1024 weights, output equals the bias   asymmetric: codes -1 0   no clipping error: NaN   int2: -2 -1 0 1
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q torch==2.15.0 torchao==0.18.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import torch
from torch import nn
from torchao.quantization import IntxWeightOnlyConfig, quantize_
from torchao.quantization.granularity import PerAxis
from torchao.quantization.quant_primitives import MappingType


def quantized(kind, mapping=MappingType.SYMMETRIC):
    """Codes of a quantized layer, and whether its output is NaN or its bias alone."""
    torch.manual_seed(0)
    layer = nn.Sequential(nn.Linear(64, 16))
    quantize_(layer, IntxWeightOnlyConfig(weight_dtype=kind, granularity=PerAxis(0), mapping_type=mapping))
    with torch.no_grad():
        output = layer(torch.randn(100, 64))
    weight = layer[0].weight
    assert weight.target_dtype == kind
    state = "NaN" if output.isnan().any() else "bias" if torch.equal(output, layer[0].bias.expand_as(output)) else "varies"
    codes = weight.qdata.unique().tolist()
    print(f"SEEN {kind} {mapping.name}: codes {codes} of {weight.qdata.numel()} weights, output: {state}")
    return codes, state


assert quantized(torch.int1) == ([0], "bias")
assert quantized(torch.int1, MappingType.ASYMMETRIC) == ([-1, 0], "varies")
assert quantized(torch.int1, MappingType.SYMMETRIC_NO_CLIPPING_ERR)[1] == "NaN"
assert quantized(torch.int2) == ([-2, -1, 0, 1], "varies")
PY
grep SEEN out.txt
