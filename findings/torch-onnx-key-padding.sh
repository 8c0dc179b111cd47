#!/bin/sh
# torch 2.15.0, onnx 1.23.2, onnxscript 0.7.2, onnxruntime 1.32.0: a TransformerEncoderLayer with src_key_padding_mask, exported with operator set 23 or 24, is a valid file that onnx's
# reference evaluator computes and onnxruntime refuses: the exporter hands the mask on with one row for all queries, which the operator Attention allows and onnxruntime's does not.
# Sets 18 and 25 run. Without the mask, or with a causal mask beside it (which has all rows), 23 and 24 run too.
# Seen on 2026-11-29:  set 18 runs   23, 24: onnxruntime "inconsistent q_sequence_length", reference agrees with torch   25 runs   with a causal mask: all run
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q torch==2.15.0 onnx==1.23.2 onnxscript==0.7.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import numpy as np, onnx, onnxruntime, torch
from onnx.reference import ReferenceEvaluator
from torch import nn


class Policy(nn.Module):
    def __init__(self, causal):
        super().__init__()
        self.layer = nn.TransformerEncoderLayer(8, 2, 16, batch_first=True)
        self.mask = torch.ones(3, 3, dtype=torch.bool).triu(1) if causal else None

    def forward(self, x, padding):
        return self.layer(x, src_mask=self.mask, src_key_padding_mask=padding)


torch.manual_seed(0)
given = torch.randn(2, 3, 8), torch.tensor([[False, False, False], [False, False, True]])
feeds = {"x": given[0].numpy(), "padding": given[1].numpy()}
for causal in (False, True):
    policy = Policy(causal).eval()
    with torch.no_grad():
        expected = policy(*given).numpy()
    for operator_set in (18, 23, 24, 25):
        model = torch.onnx.export(policy, given, input_names=list(feeds), opset_version=operator_set, dynamo=True, verbose=False).model_proto
        onnx.checker.check_model(model, full_check=True)
        outcome = "runs"
        try:
            found = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"]).run(None, feeds)[0]
        except onnxruntime.capi.onnxruntime_pybind11_state.Fail as error:
            assert "inconsistent q_sequence_length" in str(error), error
            outcome, found = "refused", ReferenceEvaluator(model).run(None, feeds)[0]
        print(f"SEEN causal {causal}, set {operator_set}: {outcome}; difference of onnxruntime or reference from torch {np.abs(found - expected).max():.1g}")
        assert np.abs(found - expected).max() < 1e-5
        assert outcome == ("refused" if operator_set in (23, 24) and not causal else "runs")
PY
grep SEEN out.txt
