#!/bin/sh
# torch 2.15.0, onnx 1.23.2, onnxscript 0.7.2, onnxruntime 1.32.0: a policy that keeps its last action in a buffer is exported without its state, by both of
# torch.onnx.export's ways and without an error: the file has neither an input nor an output for the buffer and takes it as a constant. The policy's actions
# for one observation differ from step to step, the file's do not.
# Seen on 2026-11-28:  torch: 3 different actions   dynamo=True: 1, input x, output action   dynamo=False: 1, input x, output action
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q torch==2.15.0 onnx==1.23.2 onnxscript==0.7.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - 2>/dev/null <<'PY'
import numpy as np, onnx, onnxruntime, torch
from torch import nn


class Policy(nn.Module):
    def __init__(self):
        super().__init__()
        self.register_buffer("last", torch.zeros(1, 2))
        self.layer = nn.Linear(5, 2)

    def forward(self, x):
        action = self.layer(torch.cat([x, self.last], -1))
        self.last.copy_(action)
        return action


torch.manual_seed(0)
x = torch.ones(1, 3)
start = Policy().state_dict()
for dynamo in (None, True, False):
    policy = Policy().eval()
    policy.load_state_dict(start)
    if dynamo is None:
        with torch.no_grad():
            actions = {tuple(policy(x)[0].tolist()) for _ in range(3)}
        print(f"torch: {len(actions)} different actions")
        assert len(actions) == 3
        continue
    torch.onnx.export(policy, (x,), "p.onnx", dynamo=dynamo, verbose=False, input_names=["x"], output_names=["action"])
    onnx.checker.check_model("p.onnx", full_check=True)
    session = onnxruntime.InferenceSession("p.onnx", providers=["CPUExecutionProvider"])
    actions = {tuple(session.run(None, {"x": x.numpy()})[0][0].tolist()) for _ in range(3)}
    inputs, outputs = ([value.name for value in values] for values in (session.get_inputs(), session.get_outputs()))
    print(f"dynamo={dynamo}: {len(actions)}, input {inputs[0]}, output {outputs[0]}")
    assert len(actions) == 1 and inputs == ["x"] and outputs == ["action"]
PY
