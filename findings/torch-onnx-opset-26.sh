#!/bin/sh
# torch 2.15.0, onnx 1.23.2, onnxscript 0.7.2: asked for operator set 26 or 27, torch.onnx.export writes a file that declares operator set 18 beside a
# node of set 23 (RMSNormalization), without an error. The file is not valid: onnx's checker refuses it. Sets 23 to 25 are declared as asked.
# Seen on 2026-11-28:  25: declares 25, valid   26: declares 18, not valid   27: declares 18, not valid
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q torch==2.15.0 onnx==1.23.2 onnxscript==0.7.2
v/bin/python - 2>/dev/null <<'PY'
import onnx, torch
from torch import nn

net = nn.Sequential(nn.Linear(4, 8), nn.RMSNorm(8), nn.Linear(8, 2)).eval()
seen = {}
for asked in (25, 26, 27):
    model = torch.onnx.export(net, (torch.zeros(1, 4),), dynamo=True, opset_version=asked, verbose=False).model_proto
    try:
        onnx.checker.check_model(model)
        valid = True
    except onnx.checker.ValidationError:
        valid = False
    declared = model.opset_import[0].version
    assert any(node.op_type == "RMSNormalization" for node in model.graph.node)
    seen[asked] = (declared, valid)
    print(f"{asked}: declares {declared}, {'valid' if valid else 'not valid'}")
assert seen == {25: (25, True), 26: (18, False), 27: (18, False)}, seen
PY
