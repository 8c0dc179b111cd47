#!/bin/sh
# keras 3.15.0 with torch 2.15.0, onnx 1.23.2: a model with a LayerNormalization cannot be saved by model.export(..., format="onnx"), which fails inside of
# torch's tracing exporter at a Gather of the layer's shape; layer, shape and dtype are the defaults. The model itself computes, and its other layers export.
# The same layer as torch.nn.LayerNorm is exported by both exporters of torch.
# Seen on 2026-11-29:  keras LayerNormalization "Failed to export a node ... onnx::Gather"   keras without it: exported   torch.nn.LayerNorm: exported
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q keras==3.15.0 torch==2.15.0 onnx==1.23.2 onnxscript==0.7.2 numpy==2.4.6
KERAS_BACKEND=torch v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import keras, numpy as np, torch
from keras import layers

for norm in (False, True):
    given = keras.Input((12,))
    x = layers.Dense(24)(given)
    model = keras.Model(given, layers.Dense(4)(layers.LayerNormalization()(x) if norm else x))
    assert np.isfinite(model.predict(np.ones((1, 12), np.float32), verbose=0)).all()
    try:
        model.export("m.onnx", format="onnx", verbose=False)
        outcome = "exported"
    except Exception as error:
        while error.__cause__ is not None:
            error = error.__cause__
        outcome = str(error).splitlines()[0]
    print(f"SEEN keras, LayerNormalization {norm}: {outcome}")
    assert ("Failed to export a node" in outcome and "onnx::Gather" in outcome) if norm else outcome == "exported", outcome
module = torch.nn.Sequential(torch.nn.Linear(12, 24), torch.nn.LayerNorm(24), torch.nn.Linear(24, 4)).eval()
for dynamo in (False, True):
    torch.onnx.export(module, (torch.zeros(1, 12),), "t.onnx", dynamo=dynamo, verbose=False)
print("SEEN torch.nn.LayerNorm: exported by both exporters")
PY
grep SEEN out.txt
