#!/bin/sh
# lerobot-motor-starai 0.0.7, lerobot-robot-viola 0.0.4 (LeRobot plug-ins): the bus of StarAI arms keeps positions in counts (0 to 4096 for -180 to 180 degrees) by its default position_unit, and its DEGREES mode hands these on: a joint at
# 30 degrees is read as 2389, and an action of 30 is a count, sent as -177.4 degrees. Viola's arm chooses DEGREES with use_degrees = True and leaves position_unit as it is, so that its "degrees" are counts, too; nothing limits them. A
# calibration's drive_mode turns the other two modes and not this one, and a read in DEGREES is limited to the calibrated range, a command is not. max_relative_target of the arm's configuration, the largest step of a joint, is
# documented at send_action() and not used: a step of 200 counts is sent. The bus warns of a "compatibility mode", not of units.
# Seen on 2026-11-30:  joint at 30 degrees: DEGREES reads 2389 (with position_unit="degrees": 30)   goal 30: sent -177.4 (30.0)   -150 degrees with range 1000 to 3000: read 1000, sent again -92.1   max_relative_target 5, step of 200: 199
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps lerobot-motor-starai==0.0.7 lerobot-robot-viola==0.0.4
cat > run.py <<'PY'
import dataclasses
import enum
import importlib.machinery
import sys
import types
import warnings
from unittest import mock

warnings.simplefilter("ignore")


class Mode(enum.Enum):
    RANGE_0_100, RANGE_M100_100, DEGREES = range(3)


@dataclasses.dataclass
class Motor:
    id: int
    model: str
    norm_mode: Mode


@dataclasses.dataclass
class Calibration:
    id: int
    drive_mode: int
    homing_offset: int
    range_min: float
    range_max: float


class Bus:
    def _get_motors_list(self, motors):
        return list(motors or self.motors)


@dataclasses.dataclass
class Options:
    id: int
    position: int
    motion_time: int
    power: int
    acceleration: int
    deceleration: int


class Port:
    """The servos: each is where it was sent, in tenths of a degree."""

    is_open = True

    def __init__(self, *_):
        self.at, self.write = {}, mock.MagicMock()
        self.sync_write = {"Goal_Position": lambda goals: self.at.update({goal.id: goal.position / 10 for goal in goals.values()})}

    def read_positions(self, ids):
        return {name: self.at.get(number, 0.0) for name, number in ids.items()}


class Robot:
    def __init__(self, config):
        self.calibration = {}


known = dict(MotorNormMode=Mode, Motor=Motor, MotorCalibration=Calibration, MotorsBus=Bus, PortHandler=Port, SyncPositionControlOptions=Options, Robot=Robot, make_cameras_from_configs=lambda _: {})
known["RobotConfig"] = type("RobotConfig", (), {"register_subclass": staticmethod(lambda _: lambda kind: kind)})


class Anything(types.ModuleType):
    __path__ = []

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return known.get(name) or type(name, (Exception,), {})


class Finder:
    def find_spec(self, name, *_):
        return importlib.machinery.ModuleSpec(name, self, is_package=True) if name.split(".")[0] in ("lerobot", "fashionstar_uart_sdk") else None

    def create_module(self, spec):
        return Anything(spec.name)

    def exec_module(self, module):
        pass


sys.meta_path.insert(0, Finder())
from lerobot_motor_starai.starai import StaraiMotorsBus
from lerobot_robot_viola.config_starai_viola import StaraiViolaConfig
from lerobot_robot_viola.starai_viola import StaraiViola


def bus(**options):
    return StaraiMotorsBus("port", {"joint": Motor(1, "ra8-u25", Mode.DEGREES)}, **options)


def read_at(made, degrees):
    made.port_handler.at = {1: degrees}
    return made.sync_read("Present_Position")["joint"]


def sent(made, goal):
    made.sync_write("Goal_Position", {"joint": goal})
    return made.port_handler.at[1]


default, degrees = bus(), bus(position_unit="degrees")
limited = bus(calibration={"joint": Calibration(1, 1, 0, 1000, 3000)})
reads = read_at(default, 30.0), read_at(degrees, 30.0)
goals = sent(default, 30.0), sent(degrees, 30.0)
beyond = read_at(limited, -150.0)
again = sent(limited, beyond)
unlimited = sent(limited, 4000.0)

config = StaraiViolaConfig(port="port", use_degrees=True, max_relative_target=5)
config.cameras = {}
arm = StaraiViola(config)
arm.bus.port_handler.at = {number: 30.0 for number in range(7)}
observed = arm.get_observation()["Motor_0.pos"]
arm.send_action({"Motor_0.pos": observed + 200})
step = arm.get_observation()["Motor_0.pos"] - observed
print(f"SEEN read {reads}, sent {goals}; -150 degrees reads {beyond}, sent again {again}; goal 4000 beyond the range: {unlimited}; viola at 30 degrees: {observed}, step {step}")
assert reads == (2389, 30.0) and goals == (-177.4, 30.0) and beyond == 1000 and again == -92.1 and unlimited > 170
assert observed == 2389 and step == 199
PY
v/bin/python run.py
