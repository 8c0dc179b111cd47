#!/bin/sh
# lerobot 0.6.1, moteus 1.1.1, minimalmodbus 2.1.1 (read from their wheels): each turns a setpoint into a register's whole number with int(), toward zero, where
# rounding is needed. A value that the register itself had, as a floating-point number, is written back as its neighbor. A joint of a LeRobot arm that is told
# again and again to stay where it was read creeps: at most 128 of 4,096 ticks (11 degrees) in 200 steps when its range is the whole turn (in DEGREES it stays).
# Seen on 2026-11-28:  lerobot RANGE_0_100: 511 of 4096 positions change, creeps 128 ticks   RANGE_M100_100: 726, 128 ticks   DEGREES: 0
#                      moteus position, int16: 4596 of 65535 change   minimalmodbus, two decimals: 1849 of 30001 (0.29 becomes 0.28)
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v
v/bin/pip download -q --no-deps --only-binary=:all: --python-version 3.12 lerobot==0.6.1 moteus==1.1.1 minimalmodbus==2.1.1 pyserial==3.5
v/bin/python - <<'PY'
import ast, enum, glob, io, re, struct, sys, types, zipfile

wheels = {name: glob.glob(f"{name}-*.whl")[0] for name in ("lerobot", "moteus", "minimalmodbus", "pyserial")}
# LeRobot's two conversions, as they are; the names of the file's types are of Python 3.12.
source = zipfile.ZipFile(wheels["lerobot"]).read("lerobot/motors/motors_bus.py").decode()
found = [node for node in ast.walk(ast.parse(re.sub(r"(?m)^type .*$", "", source))) if getattr(node, "name", "") in ("_normalize", "_unnormalize")]
Mode = enum.Enum("Mode", "RANGE_0_100 RANGE_M100_100 DEGREES")
lerobot = {"MotorNormMode": Mode}
exec(compile(ast.Module(found, []), "motors_bus.py", "exec"), lerobot)
seen = {}
for mode in Mode:
    motor = types.SimpleNamespace(range_min=0, range_max=4095, drive_mode=0, norm_mode=mode, model="sts3215")
    bus = types.SimpleNamespace(calibration={"joint": motor}, motors={"joint": motor}, apply_drive_mode=True, model_resolution_table={"sts3215": 4096})
    bus._id_to_name, bus._id_to_model = lambda _: "joint", lambda _: "sts3215"
    again = [lerobot["_unnormalize"](bus, lerobot["_normalize"](bus, {1: tick}))[1] for tick in range(4096)]
    place = list(range(4096))
    for _ in range(200):
        place = [again[tick] for tick in place]
    seen[mode.name] = (sum(tick != back for tick, back in enumerate(again)), max(abs(tick - end) for tick, end in enumerate(place)))
    print(f"lerobot {mode.name}: {seen[mode.name][0]} of 4096 positions change, creeps {seen[mode.name][1]} ticks")
# moteus without its transports: the package's folder inside the wheel.
sys.modules["moteus"] = package = types.ModuleType("moteus")
package.__path__ = [wheels["moteus"] + "/moteus"]
from moteus import multiplex, protocol


def moteus(value):
    buffer = io.BytesIO()
    protocol.Writer(buffer).write_position(value, multiplex.INT16)
    return struct.unpack("<h", buffer.getvalue())[0]


assert moteus(1.5) == 15000 and moteus(-0.0028) in (-28, -27)
seen["moteus"] = sum(moteus(count * 0.0001) != count for count in range(-32767, 32768))
print(f"moteus position, int16: {seen['moteus']} of 65535 change, {29 * 0.0001:.4f} rev becomes {moteus(29 * 0.0001) * 0.0001:.4f}")
sys.path += [wheels["minimalmodbus"], wheels["pyserial"]]
import minimalmodbus

register = lambda value: int.from_bytes(minimalmodbus._num_to_two_bytes(value, 2), "big")
seen["minimalmodbus"] = sum(register(count / 100) != count for count in range(30001))
print(f"minimalmodbus, two decimals: {seen['minimalmodbus']} of 30001 change, 0.29 becomes {register(0.29) / 100}")
lerobot = [seen[mode.name] for mode in Mode]
assert lerobot == [(511, 128), (726, 128), (0, 0)] and seen["moteus"] == 4596 and seen["minimalmodbus"] == 1849, seen
PY
