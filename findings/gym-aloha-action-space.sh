#!/bin/sh
# gym-aloha 0.1.5 (read from its wheel): the action space of its environments is -1 to 1, but actions are joint positions in rad that go to the motors as they are, and their limits are up to
# 3.14. The environment's own start pose is not in the space: a policy whose actions are clipped to it (ClipAction, or limits that are taken from the space) moves both elbows by 0.16 rad
# when it is told to stay. And the grippers' positions, "0: close, 1: open", are between 0.07 and 0.98: the fingers' limits are narrower than what is normalized by.
# Seen on 2026-11-29:  limits beyond 1: 12 of 12 arm joints (shoulder -1.85 to 1.26, waist 3.14)   start pose: elbows 1.16, clipped 1.00   gripper: 0.065 to 0.975
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip download -q --no-deps --only-binary=:all: --python-version 3.12 gym-aloha==0.1.5
v/bin/python - <<'PY'
import ast, glob, zipfile
from xml.etree import ElementTree

wheel = zipfile.ZipFile(glob.glob("gym_aloha-*.whl")[0])
read = lambda path: wheel.read(f"gym_aloha/{path}").decode()
constants = {"__file__": "constants.py"}
exec(read("constants.py"), constants)
spaces = [node for node in ast.walk(ast.parse(read("env.py"))) if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "self.action_space"]
assert [ast.unparse(node.value) for node in spaces] == ["spaces.Box(low=-1, high=1, shape=(len(ACTIONS),), dtype=np.float32)"]
# What becomes of an action on its way to the motors: the arms' numbers are not scaled.
task = ast.unparse([node for node in ast.walk(ast.parse(read("tasks/sim.py"))) if getattr(node, "name", "") == "before_step"][0])
assert "left_arm_action = action[:6]" in task and "[left_arm_action, full_left_gripper_action, right_arm_action, full_right_gripper_action]" in task
for scene in ("transfer_cube", "insertion"):
    motors = ElementTree.fromstring(read(f"assets/bimanual_viperx_{scene}.xml")).find("actuator").findall("position")
    limits = {motor.get("joint"): [float(limit) for limit in motor.get("ctrlrange").split()] for motor in motors}
    arms = {joint: limit for joint, limit in limits.items() if "finger" not in joint}
    beyond = [joint for joint, (low, high) in arms.items() if low < -1 and high > 1]
    start = dict(zip(limits, constants["START_ARM_POSE"]))
    outside = {joint: start[joint] for joint in arms if not -1 <= start[joint] <= 1}
    grippers = [round(constants["normalize_puppet_gripper_position"](limit), 3) for limit in limits["vx300s_left/left_finger"]]
    print(f"{scene}: {len(beyond)} of {len(arms)} arm joints go beyond -1 and 1; start pose outside: {outside}; gripper {grippers}")
    assert len(beyond) == len(arms) == 12 and arms["vx300s_left/waist"][1] > 3.14
    assert outside == {"vx300s_left/elbow": 1.16, "vx300s_right/elbow": 1.16}
    assert grippers == [0.065, 0.975]
PY
