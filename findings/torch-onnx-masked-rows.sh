#!/bin/sh
# torch 2.15.0, onnx 1.23.2, onnxscript 0.7.2, onnxruntime 1.32.0: a query that a mask lets see no key (a history or a chunk that is all padding) is 0 in torch's attention. The file that
# torch.onnx.export writes gives 0 or another result by operator set, exporter and type of the mask, without an error: with set 18 and dynamo=True, the mean of all values, the masked
# ones too, for a boolean mask; NaN for a mask of 0 and -inf from both exporters. dynamo=False keeps the 0 of a boolean mask, set 23 (operator Attention) that of both. The other rows agree.
# Seen on 2026-11-29:  values 1, 2, 6, masked row: torch 0, 0   set 18, dynamo=True: 3, NaN   set 18, dynamo=False: 0, NaN   set 23: 0, 0 (mask of bool, mask of float)
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q torch==2.15.0 onnx==1.23.2 onnxscript==0.7.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import io, math

import onnxruntime, torch
from torch import nn
from torch.nn.functional import scaled_dot_product_attention


class Attend(nn.Module):
    def forward(self, q, k, v, mask):
        return scaled_dot_product_attention(q, k, v, attn_mask=mask)


seen = torch.tensor([[True, True, False], [False, False, False]])
masks = {"bool": seen, "float": torch.zeros(2, 3).masked_fill(~seen, -math.inf)}
tokens = torch.zeros(1, 1, 2, 1), torch.zeros(1, 1, 3, 1), torch.tensor([1.0, 2, 6]).reshape(1, 1, 3, 1)
expected = {(18, True): ("3.0", "nan"), (18, False): ("0.0", "nan"), (23, True): ("0.0", "0.0")}
for (operator_set, dynamo), rows in expected.items():
    for (kind, mask), row in zip(masks.items(), rows):
        given = (*tokens, mask)
        out = Attend()(*given).flatten().tolist()
        assert out == [1.5, 0], out
        file, names = io.BytesIO(), ["q", "k", "v", "mask"]
        if dynamo:
            file.write(torch.onnx.export(Attend(), given, input_names=names, opset_version=operator_set, dynamo=True, verbose=False).model_proto.SerializeToString())
        else:
            torch.onnx.export(Attend(), given, file, input_names=names, opset_version=operator_set, dynamo=False)
        session = onnxruntime.InferenceSession(file.getvalue(), providers=["CPUExecutionProvider"])
        found = session.run(None, {name: value.numpy() for name, value in zip(names, given)})[0].ravel().tolist()
        print(f"SEEN mask of {kind}, set {operator_set}, dynamo={dynamo}: torch {out}, onnxruntime {[round(value, 4) for value in found]}")
        assert abs(found[0] - 1.5) < 1e-6 and str(round(found[1], 4)) == row
PY
grep SEEN out.txt
