#!/bin/sh
# lerobot-robot-xarm 0.0.3 (LeRobot plug-in, UFACTORY arms): its observation has joint velocities by default, which are the difference to the observation before times 60, whatever the time between them. At LeRobot's default of 30 observations
# per second, a joint that turns at 1 rad/s is observed at 2 rad/s, at 10 per second at 6; one look between two steps, as a camera preview makes, changes the next. The accelerations are differences of those without a factor: 1 rad/s^2 is 0.07
# at 30 per second. The velocities that the arm itself measures come with the same answer and are dropped. And the address in the configuration, ip, is not used: two arms with two addresses both connect to 192.168.1.184. There is no error.
# Seen on 2026-11-30:  1 rad/s at 60, 30, 10 observations per second: 1.00, 2.00, 6.00 (the arm measures 1.00)   1 rad/s^2 at 30 per second: 0.07   ip="10.0.0.7": connects to 192.168.1.184
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q numpy==2.4.6 transforms3d==0.4.2 && v/bin/pip install -q --no-deps lerobot-robot-xarm==0.0.3
cat > run.py <<'PY'
import importlib.machinery
import sys
import types
from unittest import mock

connected = []


class Arm:
    """An arm that moves by itself, and measures its joints' positions, velocities and efforts."""

    def __init__(self, address, **_):
        connected.append(address)
        self.position, self.velocity = 0.0, 0.0

    def get_servo_angle(self):
        return 0, [self.position] * 7

    def get_joint_states(self):
        return 0, ([self.position] * 7, [self.velocity] * 7, [0.0] * 7)

    def __getattr__(self, name):
        return lambda *_, **__: 0


register = type("RobotConfig", (), {"register_subclass": staticmethod(lambda _: lambda kind: kind)})
known = {"XArmAPI": Arm, "RobotConfig": register, "make_cameras_from_configs": lambda _: {}}
known["Robot"] = type("Robot", (), {"__init__": lambda self, config: None})
known["DeviceNotConnectedError"] = known["DeviceAlreadyConnectedError"] = RuntimeError


class Jacobi:
    def __init__(self, *_, **__):
        pass

    def set_joint_position(self, *_):
        pass

    def get_ee_pose(self):
        import numpy

        return numpy.eye(4)


known["JacobiRobot"] = Jacobi


class Anything(types.ModuleType):
    __path__ = []

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return known.get(name) or mock.MagicMock()


class Finder:
    def find_spec(self, name, *_):
        return importlib.machinery.ModuleSpec(name, self, is_package=True) if name.split(".")[0] in ("lerobot", "xarm", "teleop") else None

    def create_module(self, spec):
        return Anything(spec.name)

    def exec_module(self, module):
        pass


sys.meta_path.insert(0, Finder())
from lerobot_robot_xarm.config_xarm import XarmConfig
from lerobot_robot_xarm.xarm import Xarm

assert XarmConfig().use_velocity and XarmConfig().use_acceleration


def observed(rate, velocity=1.0, acceleration=0.0):
    """The last observation of a joint with a velocity and an acceleration, and what the arm measured."""
    robot = Xarm(XarmConfig(ip="10.0.0.7"))
    robot.connect()
    for step in range(20):
        time = step / rate
        robot._arm.position, robot._arm.velocity = velocity * time + acceleration * time**2 / 2, velocity + acceleration * time
        observation = robot.get_observation()
    return observation["joint1.vel"], observation["joint1.acc"], robot._arm.velocity


velocities = [observed(rate)[0] for rate in (60, 30, 10)]
measured = observed(30)[2]
acceleration = observed(30, 0.0, 1.0)[1]
print("SEEN", [f"{value:.2f}" for value in velocities], f"measured {measured:.2f}, acceleration {acceleration:.3f}, connected to {set(connected)}")
assert max(abs(a - b) for a, b in zip(velocities, (1, 2, 6))) < 1e-6 and measured == 1.0
assert abs(acceleration - 2 / 30) < 1e-6 and set(connected) == {"192.168.1.184"}
PY
v/bin/python run.py | grep SEEN
