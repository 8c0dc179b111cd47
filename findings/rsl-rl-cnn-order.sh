#!/bin/sh
# rsl-rl-lib 5.5.1: a CNNModel takes its observation groups in another order than obs_groups lists them. Groups of one dimension come first, joined to one input "obs", and
# images after them, whatever the configuration says, for the actor as trained and for as_onnx(). Nothing in the exported file has the configuration's order, and of the
# joined groups not the names: a deployment that feeds the groups in the order of the run's own agent.yaml feeds other inputs. Of two flat groups the order is kept.
# Seen on 2026-11-29:  obs_groups [height, policy, command] -> inputs obs (policy, command: 5 values), height
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q torch==2.15.0 rsl-rl-lib==5.5.1 numpy==2.4.6
v/bin/python - <<'PY'
import torch
from rsl_rl.models import CNNModel
from tensordict import TensorDict

groups = TensorDict({"height": torch.ones(1, 1, 5, 5), "policy": torch.full((1, 3), 2.0), "command": torch.full((1, 2), 3.0)}, [1])
image = {"output_channels": [2], "kernel_size": [3], "stride": [2], "activation": "elu"}
for order in (["height", "policy", "command"], ["policy", "height", "command"], ["command", "policy", "height"]):
    torch.manual_seed(0)
    model = CNNModel(groups, {"actor": order}, "actor", 4, hidden_dims=[8], activation="elu", cnn_cfg=image).eval()
    exported = model.as_onnx(verbose=False)
    flat = [group for group in order if group != "height"]
    print(order, "-> inputs", exported.input_names, "of which obs is", model.obs_groups)
    assert exported.input_names == ["obs", "height"] and list(model.obs_groups) == flat
    # The exported module, fed in its own order, is the actor.
    joined = torch.cat([groups[group] for group in flat], dim=1)
    with torch.no_grad():
        assert torch.allclose(exported(joined, groups["height"]), model(groups), atol=1e-6)
PY
