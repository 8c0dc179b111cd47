#!/bin/sh
# lerobot-robot-seeed-b601 1.0.5 (LeRobot plug-in, reBot B601): joint_directions, by default -1 or 1 for the six joints and -6 or 6 for the gripper, is applied to an action and not to an observation. An arm that has reached its action
# of 20 degrees everywhere is observed at -20 in shoulder_pan, shoulder_lift and wrist_roll of the Damiao arm, in elbow_flex, wrist_flex and wrist_yaw of the RobStride arm, and the gripper at 6 times the action. send_action() returns the motors'
# numbers too. State and action of one joint have two units in a data set: an action that is relative to the state, or "stay at the observed position", moves the arm to the other side. A joint without an entry in joint_directions is
# sent to 0, and a motor that has not answered is observed at 0.0. There is no error.
# Seen on 2026-11-30:  action 20, then observed: dm: pan -20, lift -20, roll -20, elbow 20, gripper -120   rs: pan 20, elbow -20, wrist_flex -20, yaw -20, gripper 120   stay: pan moves by 40 degrees   entry left out: sent 0   silent motor: 0.0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps lerobot-robot-seeed-b601==1.0.5
cat > run.py <<'PY'
import importlib.machinery
import sys
import types
from unittest import mock


class Anything(types.ModuleType):
    """LeRobot and the motors' bus, neither of which is needed for the numbers."""

    __path__ = []

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return mock.MagicMock()


class Finder:
    def find_spec(self, name, *_):
        return importlib.machinery.ModuleSpec(name, self, is_package=True) if name.split(".")[0] in ("lerobot", "motorbridge") else None

    def create_module(self, spec):
        return Anything(spec.name)

    def exec_module(self, module):
        if module.__name__ == "lerobot.robots.robot":
            module.Robot = type("Robot", (), {"__init__": lambda self, config: setattr(self, "calibration", {})})
            module.RobotConfig = type("RobotConfig", (), {"register_subclass": staticmethod(lambda _: lambda kind: kind)})


sys.meta_path.insert(0, Finder())
import math

import lerobot_robot_seeed_b601 as plugin


class Motor:
    """A motor that goes where it is sent."""

    def __init__(self, answers=True):
        self.at, self.answers = 0.0, answers

    def request_feedback(self):
        pass

    def get_state(self):
        return types.SimpleNamespace(pos=self.at, vel=0.0, torq=0.0, t_mos=30.0) if self.answers else None

    def goto(self, position, *_):
        self.at = position

    send_pos_vel = send_mit = send_force_pos = goto


def arm(kind, **changes):
    follower, config = {
        "dm": lambda: (plugin.SeeedB601DMFollower, plugin.SeeedB601DMFollowerConfig),
        "rs": lambda: (plugin.SeeedB601RSFollower, plugin.SeeedB601RSFollowerConfig),
    }[kind]()
    config = config(port="can0", **changes)
    config.cameras = {}
    robot = follower(config)
    robot.cameras = {}
    robot.bus = mock.MagicMock()
    robot.motors = {name: Motor() for name in robot.motor_names}
    return robot


seen = {}
for kind in ("dm", "rs"):
    robot = arm(kind)
    wide = {name: (-400.0, 400.0) for name in robot.motor_names}
    robot = arm(kind, joint_limits=wide)
    if kind == "rs":
        robot.mit_output_torque_limit = lambda motor, position: motor.goto(position) or 0.0
        robot.motors["gripper"].send_mit = lambda *_: None
    action = {f"{name}.pos": 20.0 for name in robot.motor_names}
    robot.send_action(action)
    observed = {name: round(robot.get_observation()[f"{name}.pos"], 3) for name in robot.motor_names}
    seen[kind] = observed
    print("SEEN", kind, "action 20, observed", observed)

assert [name for name, at in seen["dm"].items() if at == -20] == ["shoulder_pan", "shoulder_lift", "wrist_roll"] and seen["dm"]["gripper"] == -120
assert [name for name, at in seen["rs"].items() if at == -20] == ["elbow_flex", "wrist_flex", "wrist_yaw"] and seen["rs"]["gripper"] == 120

robot = arm("dm", joint_limits={})
robot.motors["shoulder_pan"].at = math.radians(-20.0)
before = robot.get_observation()
robot.send_action({key: value for key, value in before.items() if key.endswith(".pos")})
moved = robot.get_observation()["shoulder_pan.pos"] - before["shoulder_pan.pos"]
left_out = arm("dm", joint_limits={}, joint_directions={"shoulder_pan": 1.0})
left_out.send_action({"elbow_flex.pos": 20.0})
silent = arm("dm")
silent.motors["elbow_flex"] = Motor(answers=False)
silent = silent.get_observation()["elbow_flex.pos"]
print(f"SEEN stay: shoulder_pan moves by {moved:.1f}; an entry left out: {left_out.motors['elbow_flex'].at}; a silent motor: {silent}")
assert abs(moved - 40) < 1e-6 and left_out.motors["elbow_flex"].at == 0.0 and silent == 0.0
PY
v/bin/python run.py
