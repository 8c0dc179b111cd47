#!/bin/sh
# torch 2.15.0, onnx 1.23.2, onnxscript 0.7.2: torch.onnx.export(..., dynamo=False) exports in evaluation mode, and afterwards sets every part of the module to the
# mode of the whole. Layers that were frozen by eval(), as a normalizer of observations in a fine-tuning, learn again after the first checkpoint that is exported,
# without a warning of it; also if the export fails. With dynamo=True the parts keep their modes, but a module in training mode is exported so: with its Dropout.
# Seen on 2026-11-29:  frozen layer: eval before, train after; mean 0.00 before a step, 0.50 after   failed export: train, too   dynamo=True: eval, file has Dropout
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q torch==2.15.0 onnx==1.23.2 onnxscript==0.7.2 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import io

import torch
from torch import nn


class Fails(nn.Module):
    def forward(self, x):
        return torch.linalg.lstsq(x.T, x.T).solution


def policy(*last):
    made = nn.Sequential(nn.BatchNorm1d(4), nn.Linear(4, 4), nn.Dropout(0.5), *last).train()
    made[0].eval()
    return made


def mode(part):
    return "train" if part.training else "eval"


obs = torch.full((8, 4), 5.0)
for name, module in (("exported", policy()), ("export fails", policy(Fails()))):
    before, mean = mode(module[0]), module[0].running_mean[0].item()
    try:
        torch.onnx.export(module, (obs,), io.BytesIO(), dynamo=False)
        assert name == "exported"
    except Exception:
        assert name == "export fails"
    module[:3](obs)
    after = module[0].running_mean[0].item()
    print(f"SEEN {name}: frozen layer {before} before, {mode(module[0])} after; its mean {mean:.2f} before the next step, {after:.2f} after it")
    assert (before, mode(module[0])) == ("eval", "train") and mean == 0 and abs(after - 0.5) < 1e-6
module = policy()
program = torch.onnx.export(module, (obs,), dynamo=True, verbose=False)
operators = [node.op_type for node in program.model_proto.graph.node]
print("SEEN dynamo=True: frozen layer", mode(module[0]), "after, file has", *operators)
assert not module[0].training and "Dropout" in operators
PY
grep SEEN out.txt
