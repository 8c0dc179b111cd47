#!/bin/sh
# leapp 0.7.2, torch 2.15.0, onnx 1.23.2, onnxscript 0.7.2, onnxruntime 1.32.0: InferenceManager.reset() writes zeros into tensors of the caller: the last
# observation that the caller passed, and the last action that it was given. A log of an episode ends with an action of 0 as soon as the next episode begins, and
# a buffer that observations are collected in loses its content.
# Seen on 2026-11-29:  before reset(): observation and last action not 0   after: both 0, earlier actions unchanged
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q leapp==0.7.2 torch==2.15.0 onnx==1.23.2 onnxscript==0.7.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - 2>err.txt >out.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import leapp, torch
from leapp import annotate
from leapp.inference_manager import InferenceManager

torch.manual_seed(0)
weights = torch.randn(8, 4)
leapp.start("policy")
obs = annotate.input_tensors("actor", {"obs": torch.randn(1, 8)})
annotate.output_tensors("actor", {"action": torch.tanh(obs @ weights)}, export_with="onnx-torchscript")
leapp.stop()
leapp.compile_graph(visualize=False)
manager = InferenceManager("policy/policy.yaml")
(key,) = manager.inputs
obs = torch.randn(1, 8)
log = [next(iter(manager({key: x}).values())) for x in (torch.randn(1, 8), obs)]
before = [bool(value.any()) for value in (obs, *log)]
manager.reset()
after = [bool(value.any()) for value in (obs, *log)]
print("SEEN any value that is not 0, of observation, first and last action: before reset()", before, "  after", after)
assert before == [True, True, True] and after == [False, True, False]
PY
grep SEEN out.txt
