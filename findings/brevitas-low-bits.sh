#!/bin/sh
# brevitas 0.13.4, torch 2.15.0: with few bits, Brevitas' default quantizers lose a part of what they are given. The default one of activations (QuantIdentity) takes the range that it saw for the most negative code, so that the positive half is
# cut: of data from -3 to 3, 2 bits keep -3.0 to 1.5, 3 bits to 2.25, 4 bits to 2.62: a policy's actions to one side end at half. Before any calibration or training the range is 1.0: a model that is only quantized and put in evaluation
# mode clips each activation to 1 (8 bits: to 0.992). weight_bit_width=1 of the default weights (and the per-channel ones) makes all weights and outputs NaN, and of the power-of-two ones makes all weights 0. There is no error and no warning.
# Seen on 2026-11-30:  data from -3 to 3: 2 bits -3.00 to 1.50, 3 bits 2.25, 4 bits 2.62, 8 bits 2.98   without calibration, 2.5 at 8 bits: 0.992   1 bit: Int8WeightPerTensorFloat NaN, Int8WeightPerChannelFloat NaN, Int8WeightPerTensorFixedPoint 0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q brevitas==0.13.4 torch==2.15.0 numpy==2.4.6
cat > run.py <<'PY'
import warnings

import brevitas.nn as qnn
import brevitas.quant as quant
import torch
from brevitas.graph.calibrate import calibration_mode

torch.manual_seed(0)
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    data = torch.linspace(-3, 3, 6001)
    kept = {}
    for bits in (2, 3, 4, 8):
        activation = qnn.QuantIdentity(bit_width=bits).eval()
        with torch.no_grad(), calibration_mode(activation):
            activation(data)
        out = activation(data)
        kept[bits] = round(out.min().item(), 2), round(out.max().item(), 2)
    model = torch.nn.Sequential(qnn.QuantIdentity(bit_width=8), qnn.QuantReLU(bit_width=8)).eval()
    fresh = model(torch.tensor([2.5, 0.5])).tolist()
    weights = {}
    for kind in ("Int8WeightPerTensorFloat", "Int8WeightPerChannelFloat", "Int8WeightPerTensorFixedPoint"):
        layer = qnn.QuantLinear(8, 4, bias=False, weight_quant=getattr(quant, kind), weight_bit_width=1)
        values = layer.quant_weight().value
        weights[kind] = values.isnan().all().item(), (values == 0).all().item(), layer(torch.ones(1, 8)).isnan().all().item()
mine = [str(w.message) for w in caught if "brevitas" in str(w.filename) and issubclass(w.category, UserWarning) and "quant" in str(w.message).lower()]
print("SEEN", kept, "fresh", [round(value, 3) for value in fresh], weights, mine)
assert kept == {2: (-3.0, 1.5), 3: (-3.0, 2.25), 4: (-3.0, 2.62), 8: (-3.0, 2.98)}, kept
assert abs(fresh[0] - 0.992) < 0.001 and abs(fresh[1] - 0.5) < 0.01
assert list(weights.values()) == [(True, False, True), (True, False, True), (False, True, False)] and not mine
PY
v/bin/python run.py >out.txt 2>err.txt || { tail -n 20 out.txt err.txt; exit 1; }
grep SEEN out.txt
