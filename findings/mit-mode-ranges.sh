#!/bin/sh
# lerobot 0.6.1, robstride-dynamics 0.0.1, damiao-motor 1.0.6 (read from their wheels): a frame of the MIT mode has no units, so that a sender scales it by the
# motor's ranges. The packages have other ranges for the same motors. lerobot scales the stiffness and damping of all RobStride motors by 500 and 5,
# robstride-dynamics those of RS-03, RS-04 and RS-06 by 5000 and 100: 50 N m/rad of the one are 500 of the other. A velocity of 1 rad/s is between 0.4 and 1.5 rad/s,
# and the position of lerobot's O6 reaches to 112.5 rad, which others have as 4 pi. For Damiao motors lerobot and damiao-motor disagree about two of nine.
# Seen on 2026-11-29:  what 1 of lerobot's is to robstride-dynamics (position, velocity, torque, stiffness, damping):
#                      RS-00 1.0 1.5 1.2 1 1   RS-01 1 1 1 1 1   RS-02 1.0 1.3 0.9 1 1   RS-03 1.0 1.5 1.0 10 20   RS-04 1.0 0.5 1.0 10 20
#                      RS-05 1.0 0.7 3.1 1 1   RS-06 0.1 0.4 1.7 10 20   to damiao-motor (velocity, torque): 3507 1.7 0.5   4340 1.2 1.0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v
v/bin/pip download -q --no-deps --only-binary=:all: --python-version 3.12 lerobot==0.6.1 robstride-dynamics==0.0.1 damiao-motor==1.0.6
v/bin/python - <<'PY'
import ast, enum, glob, math, types, typing, zipfile


def tables(wheel, path, names):
    """The file's named classes and assignments."""
    scope = {"IntEnum": enum.IntEnum, "np": types.SimpleNamespace(pi=math.pi), **vars(typing)}
    source = zipfile.ZipFile(glob.glob(wheel)[0]).read(path).decode()
    for node in ast.parse(source).body:
        target = node.target if isinstance(node, ast.AnnAssign) else node.targets[0] if isinstance(node, ast.Assign) else node
        if getattr(target, "id", getattr(target, "name", "")) in names:
            exec(compile(ast.Module([node], []), path, "exec"), scope)
    return [scope[name] for name in names], source


names = ["MotorType", "MOTOR_LIMIT_PARAMS"]
((_, robstride), _), ((_, damiao), _) = (tables("lerobot-*", f"lerobot/motors/{make}/tables.py", names) for make in ("robstride", "damiao"))
sender = tables("lerobot-*", "lerobot/motors/robstride/robstride.py", [])[1]
assert "self._float_to_uint(kp, 0, 500, 12)" in sender and "self._float_to_uint(kd, 0, 5, 12)" in sender
kinds = [f"MODEL_MIT_{kind}_TABLE" for kind in ("POSITION", "VELOCITY", "TORQUE", "KP", "KD")]
ranges, _ = tables("robstride_dynamics-*", "robstride_dynamics/table.py", kinds)
seen = {}
for motor, (position, velocity, torque) in robstride.items():
    model = f"rs-{motor.name[1:]:0>2}"
    if model in ranges[0]:
        sent = (position, velocity, torque, 500, 5)
        seen[model] = [round(table[model] / scale, 2) for table, scale in zip(ranges, sent)]
        print(model, *seen[model])
(other,), _ = tables("damiao_motor-*", "damiao_motor/core/motor.py", ["_MOTOR_LIMIT_PARAM"])
other, equal = dict(other), 0
for motor, (_, *limits) in damiao.items():
    model = motor.name.removeprefix("DM")
    if model in other:
        seen[model] = [round(b / a, 2) for a, b in zip(limits, other[model][1:])]
        equal += seen[model] == [1, 1]
        seen[model] == [1, 1] or print("Damiao", model, *seen[model])
print("Damiao: equal", equal)
assert seen["rs-03"] == [1.0, 1.52, 1.0, 10, 20] and seen["rs-06"] == [0.11, 0.4, 1.67, 10, 20] and seen["rs-01"] == [1, 1, 1, 1, 1]
assert [seen[f"rs-0{i}"][1] for i in range(7)] == [1.52, 1.0, 1.33, 1.52, 0.45, 0.66, 0.4]
assert seen["4340"] == [1.25, 1.0] and seen["3507"] == [1.67, 0.5] and equal == 7, (seen, equal)
PY
