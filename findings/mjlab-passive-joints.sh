#!/bin/sh
# mjlab 1.6.0 (read from its wheel): the metadata of an exported policy has lists of two lengths and names for one of them only. joint_names and default_joint_pos have
# all joints, joint_stiffness, joint_damping and action_scale those with an actuator, and nothing says which: a reader that pairs them gives the gains of a joint
# after a passive one to that passive one. Its own YAM arm is such a robot (right_finger has no actuator; it is the last joint, so that pairs are right there).
# Seen on 2026-11-29:  joint_names hip,slide,knee   default_joint_pos 0.100,0.000,-0.300   joint_stiffness 20.000,40.000   no other key with names of joints
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q numpy==2.4.6 && v/bin/pip download -q --no-deps mjlab==1.6.0
v/bin/python - <<'PY'
import ast, glob, types, zipfile

import numpy as np

wheel = zipfile.ZipFile(glob.glob("mjlab-*.whl")[0])
tree = ast.parse(wheel.read("mjlab/rl/exporter_utils.py").decode())
tree.body = [node for node in tree.body if isinstance(node, ast.FunctionDef)]


class Tensor(np.ndarray):
    cpu = lambda self: self


tensor = lambda *numbers: np.array([numbers], dtype=np.float32).view(Tensor)
Stub = types.SimpleNamespace
# The functions of the file; of other parts they need types, and the values of an environment: three joints, of which the second has no actuator.
names = {"torch": Stub(Tensor=Tensor), "Entity": object, "ManagerBasedRlEnv": object, "JointPositionAction": Stub, "onnx": None}
exec(compile(tree, "exporter_utils.py", "exec"), names)
actuators = [Stub(target=f"robot/{name}", id=i) for i, name in enumerate(("hip", "knee"))]
joints = ["hip", "slide", "knee"]
robot = Stub(spec=Stub(actuators=actuators), joint_names=joints, data=Stub(default_joint_pos=tensor(0.1, 0.0, -0.3)))
model = Stub(actuator_gainprm=np.array([[20.0], [40.0]]), actuator_biasprm=np.array([[0, -20, -1.0], [0, -40, -2.0]]))
env = Stub(
    scene={"robot": robot}, sim=Stub(mj_model=model), command_manager=Stub(active_terms=[]), observation_manager=Stub(active_terms={"actor": []}),
    action_manager=Stub(get_term=lambda name: Stub(_scale=tensor(0.5, 0.25))),
)  # fmt: skip
found = names["get_base_metadata"](env, "run")
written = {key: names["list_to_csv_str"](value) for key, value in found.items() if isinstance(value, list) and value}
for key, value in written.items():
    print(key, value)
assert written["joint_names"] == "hip,slide,knee" and written["default_joint_pos"] == "0.100,0.000,-0.300"
assert written["joint_stiffness"] == "20.000,40.000" and written["joint_damping"] == "1.000,2.000" and written["action_scale"] == "0.500,0.250"
assert [key for key, value in written.items() if "knee" in value] == ["joint_names"]
yam = wheel.read("mjlab/asset_zoo/robots/i2rt_yam/yam_constants.py").decode()
assert "right_finger" in yam
PY
