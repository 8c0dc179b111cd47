#!/bin/sh
# damiao-motor 1.0.6, mini-cheetah-motor-driver-socketcan 0.4.3, TMotorCANControl 1.2.6 (read from their wheels): none of the three can command a velocity or a
# torque of zero. The CAN frame of this family of motors has 12 bits from -MAX to MAX, and no code is zero. The first two send the code below, the third one the
# code above: a velocity of 0 of a range of 45 rad/s means -0.011 or +0.011 rad/s, a torque of 0 of 18 N m -0.0044 or +0.0044 N m. The third one writes with
# 4096 steps and reads with 4095, and its largest command is one code below the largest one.
# Seen on 2026-11-29:  damiao-motor 2047, mini-cheetah 2047, TMotorCANControl 2048 for 0; 4095, 4095 and 4094 for the largest value
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v
for package in damiao-motor==1.0.6 mini-cheetah-motor-driver-socketcan==0.4.3 TMotorCANControl==1.2.6; do v/bin/pip download -q --no-deps --only-binary=:all: $package; done
v/bin/python - <<'PY'
import ast, glob, types, zipfile


def take(wheel, path):
    """The package's two conversions, and the numbers that its file defines."""
    source = ast.parse(zipfile.ZipFile(glob.glob(wheel)[0]).read(path).decode())
    names = {}
    for node in ast.walk(source):
        if isinstance(node, ast.FunctionDef) and node.name in ("float_to_uint", "uint_to_float", "limit_value"):
            node.decorator_list = []
        elif not (isinstance(node, ast.Assign) and ast.unparse(node.targets[0]).startswith("maxRaw")):
            continue
        exec(compile(ast.Module([node], []), path, "exec"), names)
    names["CAN_Manager"] = types.SimpleNamespace(**{"limit_value": names.get("limit_value")})
    return names["float_to_uint"], names["uint_to_float"]


seen = {}
for wheel, path in {
    "damiao_motor-*.whl": "damiao_motor/core/motor.py",
    "mini_cheetah_*.whl": "motor_driver/canmotorlib.py",
    "TMotorCANControl-*.whl": "TMotorCANControl/mit_can.py",
}.items():
    write, read = take(wheel, path)
    codes = write(0.0, -45.0, 45.0, 12), write(45.0, -45.0, 45.0, 12)
    zero = read(codes[0], -45.0, 45.0, 12), read(write(0.0, -18.0, 18.0, 12), -18.0, 18.0, 12)
    print(f"{path}: 0 is {codes[0]}, that is {zero[0]:+.4f} rad/s of 45, {zero[1]:+.4f} N m of 18; the largest is {codes[1]}")
    assert all(read(code, -45.0, 45.0, 12) != 0 for code in range(4096))
    seen[path] = codes
assert list(seen.values()) == [(2047, 4095), (2047, 4095), (2048, 4094)], seen
PY
