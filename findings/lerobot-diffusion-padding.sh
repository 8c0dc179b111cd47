#!/bin/sh
# lerobot 0.6.1 (read from its wheel): the diffusion policy's configuration drops 7 frames at the end of each episode of its training data, by the formula written beside the number and is
# MultiTaskDiT's: horizon - n_action_steps - n_obs_steps + 1. The defaults of these three have changed, and the formula gives 31. So the last frames that it learns from have up to 24 of the
# 32 actions that a robot carries out filled with copies of the episode's last action, without a mask (do_mask_loss_for_padding is off). With the formula's 31, none of them.
# Seen on 2026-11-29:  horizon 64, n_action_steps 32, n_obs_steps 2: formula 31, default 7   last frame learned from: 24 of 32 actions are copies, with 31: 0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q numpy==2.4.6
v/bin/pip download -q --no-deps --only-binary=:all: --python-version 3.12 lerobot==0.6.1
v/bin/python - <<'PY'
import __future__, ast, glob, types, zipfile

import numpy as np

wheel = zipfile.ZipFile(glob.glob("lerobot-*.whl")[0])
parse = lambda path: ast.walk(ast.parse(wheel.read(f"lerobot/{path}.py").decode()))
config = {}
for node in parse("policies/diffusion/configuration_diffusion"):
    if isinstance(node, ast.AnnAssign) and isinstance(node.value, ast.Constant):
        config[node.target.id] = node.value.value
    elif getattr(node, "name", "") == "action_delta_indices":
        deltas = eval(compile(ast.Expression(node.body[0].value), "config", "eval"), {"self": types.SimpleNamespace(**config)})
formula = [
    ast.unparse(node.value)
    for node in parse("policies/multi_task_dit/configuration_multi_task_dit")
    if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "self.drop_n_last_frames"
]
assert formula == ["self.horizon - self.n_action_steps - self.n_obs_steps + 1"]
wanted = eval(formula[0], {"self": types.SimpleNamespace(**config)})
sampler = [node for node in parse("datasets/sampler") if getattr(node, "name", "") == "EpisodeAwareSampler"]
for node in sampler:
    node.bases = []
names = {"np": np}
exec(compile(ast.Module(sampler, []), "sampler", "exec", flags=__future__.annotations.compiler_flag), names)
length = 200


def copies(dropped):
    """Actions of the last sampled frame that a robot carries out and that lie after the episode."""
    last = max(names["EpisodeAwareSampler"]([0], [length], drop_n_last_frames=dropped))
    first = config["n_obs_steps"] - 1
    carried_out = [last + delta for delta in deltas[first : first + config["n_action_steps"]]]
    return sum(place >= length for place in carried_out), len(carried_out)


default = config["drop_n_last_frames"]
print("formula", wanted, "default", default, "mask", config["do_mask_loss_for_padding"], "copies of carried out actions: default %d of %d," % copies(default), "formula %d of %d" % copies(wanted))
assert (wanted, default) == (31, 7) and config["do_mask_loss_for_padding"] is False
assert copies(default) == (24, 32) and copies(wanted) == (0, 32)
PY
