#!/bin/sh
# efferent 0.5.0, mjlab 1.6.0 (read from its wheel), numpy 2.4.6: import_isaaclab makes another contract of a run's env.yaml than mjlab trained, without an error or a warning. An observation term with the key joint_pos is taken for
# absolute positions whatever its func is, if it has no parameter biased: that of mjlab's own lift-cube task is joint_pos_rel, so that the policy sees all joints off by their default positions. A term's clip and
# its history_length are dropped. An action's clip, which mjlab applies to the target after scale and offset, limits the network's output before them, by one pair of numbers for all joints.
# Seen on 2026-11-29:  positions 0.7 0.9, defaults 0.5 1.0: mjlab 0.2 -0.1, efferent 0.7 0.9   velocity 30, clip 10, scale 0.1: 1, efferent 3   history_length 3: 1
#                      output 2, scale 0.5, default 0.5 and 1, clip 0.6 and 1.2: targets 0.6 1.2, efferent 1.1 1.6
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q efferent==0.5.0 numpy==2.4.6
v/bin/pip download -q --no-deps mjlab==1.6.0 && unzip -q mjlab-1.6.0-py3-none-any.whl
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import ast, pathlib

import numpy as np, onnx
from efferent.importers.isaaclab import import_isaaclab
from efferent.runtime.obs import ObsBuilder
from efferent.runtime.policy import PolicySession
from efferent.spec.binding import Binding
from efferent.types import Command, RobotState
from onnx import TensorProto, helper

# mjlab's lift-cube task: the term joint_pos is joint_pos_rel, without parameters. And its order of scale, offset and clip of an action.
task = ast.parse(pathlib.Path("mjlab/tasks/manipulation/lift_cube_env_cfg.py").read_text())
terms = next(node.value for node in ast.walk(task) if isinstance(node, ast.Assign) and node.targets[0].id == "actor_terms")
term = next(value for key, value in zip(terms.keys, terms.values) if key.value == "joint_pos")
assert ast.unparse(term.keywords[0].value) == "mdp.joint_pos_rel" and "params" not in [keyword.arg for keyword in term.keywords]
actions = pathlib.Path("mjlab/envs/mdp/actions/actions.py").read_text()
process = actions[actions.index("def process_actions") :]
assert process.index("self._raw_actions * self._scale + self._offset") < process.index("torch.clamp(\n        self._processed_actions")

pathlib.Path("env.yaml").write_text("""
decimation: 4
sim: {mujoco: {timestep: 0.005}}
actions:
  joint_pos: {scale: 0.5, use_default_offset: true, clip: {hip: [-0.6, 0.6], knee: [-1.2, 1.2]}}
scene:
  entities:
    robot:
      init_state: {joint_pos: {hip: 0.5, knee: 1.0}}
      articulation:
        actuators: [{target_names_expr: ['.*'], stiffness: 20.0, damping: 1.0, effort_limit: 10.0}]
observations:
  actor:
    terms:
      joint_pos: {func: 'mjlab.envs.mdp.observations:joint_pos_rel', params: {}}
      joint_vel: {func: 'mjlab.envs.mdp.observations:joint_vel_rel', params: {}, clip: [-10.0, 10.0], scale: 0.1, history_length: 3}
""")
manifest, descriptor = import_isaaclab("env.yaml", ["hip", "knee"])
binding = Binding(manifest, descriptor)
state = RobotState(q=np.float32([0.7, 0.9]), dq=np.float32([30, 0]))
observation = ObsBuilder(binding).build(state, np.zeros(2, np.float32), Command(), 0.0)
print("SEEN observation", np.round(observation, 3))
assert np.allclose(observation, [0.7, 0.9, 3, 0])

graph = helper.make_graph(
    [helper.make_node("Constant", [], ["action"], value=helper.make_tensor("value", TensorProto.FLOAT, [1, 2], [2.0, 2.0])), helper.make_node("Identity", ["obs"], ["unused"])],
    "policy", [helper.make_tensor_value_info("obs", TensorProto.FLOAT, [1, 4])],
    [helper.make_tensor_value_info("action", TensorProto.FLOAT, [1, 2]), helper.make_tensor_value_info("unused", TensorProto.FLOAT, [1, 4])],
)
onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=10), "policy.onnx")
manifest.policy.input, manifest.policy.output = "obs", "action"
output = PolicySession(manifest, "policy.onnx").step(observation)
targets = binding.default_pose_p + binding.action_scale_p * output
meant = np.clip(binding.default_pose_p + binding.action_scale_p * np.float32([2, 2]), [-0.6, -1.2], [0.6, 1.2])
print("SEEN clip", manifest.control.clip_actions, "targets", np.round(targets, 3), "mjlab", np.round(meant, 3))
assert manifest.control.action_type == "joint_position_delta" and np.allclose(targets, [1.1, 1.6]) and np.allclose(meant, [0.6, 1.2])
PY
grep SEEN out.txt
