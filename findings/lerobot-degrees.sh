#!/bin/sh
# lerobot 0.6.1 (read from its wheel): a calibration with drive_mode 1 turns the sign of a motor's values in the modes RANGE_M100_100 and RANGE_0_100, but not
# in DEGREES, which is the default of its SO-100 and SO-101 arms: the same arm with the same calibration moves the other way. And DEGREES alone does not limit
# what is sent to the calibrated range.
# Seen on 2026-11-28:  drive_mode 0 and 1: RANGE_M100_100 opposite, RANGE_0_100 opposite, DEGREES equal   far beyond the range: 3500, 3500, then 4596 (DEGREES)
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip download -q --no-deps --only-binary=:all: --python-version 3.12 lerobot==0.6.1
v/bin/python - <<'PY'
import ast, enum, glob, re, types, zipfile

wheel = zipfile.ZipFile(glob.glob("lerobot-*.whl")[0])
source = wheel.read("lerobot/motors/motors_bus.py").decode()
# "type X = .." is of Python 3.12; the two conversions are run as they are.
found = [node for node in ast.walk(ast.parse(re.sub(r"(?m)^type .*$", "", source))) if getattr(node, "name", "") in ("_normalize", "_unnormalize")]
Mode = enum.Enum("Mode", "RANGE_M100_100 RANGE_0_100 DEGREES")
run = {"MotorNormMode": Mode}
exec(compile(ast.Module(found, []), "motors_bus.py", "exec"), run)


def bus(mode, drive_mode):
    joint = types.SimpleNamespace(range_min=500, range_max=3500, drive_mode=drive_mode, norm_mode=mode, model="sts3215")
    made = types.SimpleNamespace(calibration={"joint": joint}, motors={"joint": joint}, apply_drive_mode=True, model_resolution_table={"sts3215": 4096})
    made._id_to_name, made._id_to_model = lambda _: "joint", lambda _: "sts3215"
    return made


assert "apply_drive_mode = True" in wheel.read("lerobot/motors/feetech/feetech.py").decode()
assert "use_degrees: bool = True" in wheel.read("lerobot/robots/so_follower/config_so_follower.py").decode()
seen = {}
for mode in Mode:
    read = [run["_normalize"](bus(mode, drive), {1: 1000})[1] for drive in (0, 1)]
    sent = run["_unnormalize"](bus(mode, 0), {1: 228.3})[1]
    seen[mode.name] = ("equal" if read[0] == read[1] else "opposite", sent)
    print(f"{mode.name}: tick 1000 reads {read[0]:.2f} and {read[1]:.2f} with drive_mode 0 and 1; 228.3 sends {sent}")
assert [way for way, _ in seen.values()] == ["opposite", "opposite", "equal"], seen
assert seen["RANGE_M100_100"][1] == seen["RANGE_0_100"][1] == 3500 and seen["DEGREES"][1] > 4095, seen
PY
