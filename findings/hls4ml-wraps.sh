#!/bin/sh
# hls4ml 1.3.0, torch 2.15.0: with the configuration that config_from_pytorch_model makes, the input of a converted network is ap_fixed<16,6>, which ends at 32 and
# then wraps: an observation of 40 is read as -24. There is no error and no warning, and granularity="name", whose weights have automatic types, keeps that input.
# In a network that gives back what it observes, 31 stays 31 and 40 becomes -24.
# Seen on 2026-11-29:  31 -> 31.0   40 -> -24.0 (both granularities)
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q hls4ml==1.3.0 torch==2.15.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import warnings

import hls4ml, numpy as np, torch

model = torch.nn.Sequential(torch.nn.Linear(2, 2))
with torch.no_grad():
    model[0].weight.copy_(torch.eye(2))
    model[0].bias.zero_()
model.eval()
for granularity in ("model", "name"):
    config = hls4ml.utils.config_from_pytorch_model(model, input_shape=(2,), granularity=granularity)
    made = hls4ml.converters.convert_from_pytorch_model(model, hls_config=config, output_dir=granularity, backend="Vivado")
    made.compile()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        near, far = (np.asarray(made.predict(np.full((1, 2), x, dtype=np.float32))).reshape(-1)[0] for x in (31, 40))
    print(f"SEEN {granularity}: 31 -> {near:.1f}   40 -> {far:.1f}   warnings: {len(caught)}")
    assert abs(near - 31) < 0.1 and abs(far + 24) < 0.1 and not caught
    assert model(torch.full((1, 2), 40.0)).tolist() == [[40.0, 40.0]]
PY
grep SEEN out.txt
