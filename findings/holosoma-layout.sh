#!/bin/sh
# holosoma 0.0.3, holosoma-inference 0.1.3 (read from their wheels): training writes into the policy's file how it is used: kp, kd, action_scale, observation_layout
# (each term's scale, clip and history) and observation_clip. The project's own deployment reads kp and kd of a walking policy, and nothing else: it scales
# observations and actions by its presets, and clips neither terms nor the observation. A policy that was trained with another scale, clip or action_scale walks
# with the preset's, though its file says otherwise. (A policy that tracks a motion has its action_scale read, too.)
# Seen on 2026-11-29:  written: action_scale, kd, kp, observation_clip, observation_layout   read by walking policies: kd, kp   by tracking policies: action_scale, kd, kp
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip download -q --no-deps --only-binary=:all: --python-version 3.12 holosoma==0.0.3 holosoma-inference==0.1.3
v/bin/python - <<'PY'
import ast, glob, zipfile

training, deployment = (zipfile.ZipFile(glob.glob(f"{name}-*.whl")[0]) for name in ("holosoma", "holosoma_inference"))
keys = {"action_scale", "kp", "kd", "observation_layout", "observation_clip"}


def words(wheel, path):
    tree = ast.parse(wheel.read(path).decode())
    return {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and node.value in keys}


written = words(training, "holosoma/agents/ppo/ppo.py")
base, walking, tracking = (words(deployment, f"holosoma_inference/policies/{name}.py") for name in ("base", "locomotion", "wbt"))
print("written:", *sorted(written))
print("read by walking policies:", *sorted(base | walking), "  by tracking policies:", *sorted(base | tracking))
assert written == keys and base | walking == {"kp", "kd"} and base | tracking == {"action_scale", "kp", "kd"}
everywhere = set().union(*(words(deployment, path) for path in deployment.namelist() if path.endswith(".py")))
assert not everywhere & {"observation_layout", "observation_clip"}
source = deployment.read("holosoma_inference/policies/base.py").decode()
assert "scale = self.obs_scales[term]" in source and "self.obs_scales = self.obs_config.obs_scales" in source
assert "policy_action * self.policy_action_scale" in source and "self.config.task.policy_action_scale" in source
PY
