#!/bin/sh
# torch 2.15.0, onnx 1.23.2: torch.onnx.export(..., dynamo=False) leaves torch's ONNX log switched on, with verbose=False too. What should keep the old state
# (setup_onnx_logging) reads the function that tells it without calling it, and a function is always true.
# Seen on 2026-11-28:  before: off   after: on
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q torch==2.15.0 onnx==1.23.2 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import io, torch

on = torch._C._jit_is_onnx_log_enabled
before = on()
torch.onnx.export(torch.nn.Linear(4, 2).eval(), (torch.zeros(1, 4),), io.BytesIO(), dynamo=False, verbose=False)
after = on()
print("before:", "on" if before else "off", "  after:", "on" if after else "off")
assert not before and after
PY
