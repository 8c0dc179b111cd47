#!/bin/sh
# mjlab 1.6.0 (read from its wheel): the metadata of an exported policy holds each number of a list with three decimals. An action scale of its own G1 robot
# changes by 0.7 %, and an observation scale of 0.0004 becomes 0.
# Seen on 2026-11-28:  0.0745 is written as 0.075   0.0004 is written as 0.000   change of the action scale: 0.7 %
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip download -q --no-deps mjlab==1.6.0
v/bin/python - <<'PY'
import ast, glob, math, zipfile

wheel = zipfile.ZipFile(glob.glob("mjlab-*.whl")[0])


def take(path, wanted, names):
    tree = ast.parse(wheel.read(path).decode())
    names |= {"math": math, "NamedTuple": object}
    for node in tree.body:
        name = node.name if isinstance(node, ast.FunctionDef) else ast.unparse(node.targets[0]) if isinstance(node, ast.Assign) else ""
        if wanted(name):
            exec(compile(ast.Module([node], []), path, "exec"), names)
    return names


to_text = take("mjlab/rl/exporter_utils.py", lambda name: name == "list_to_csv_str", {})["list_to_csv_str"]
names = take("mjlab/utils/actuator.py", lambda name: name.startswith("reflected_inertia"), {})
robot = "mjlab/asset_zoo/robots/unitree_g1/g1_constants.py"
take(robot, lambda name: name.startswith(("ROTOR_", "GEARS_", "ARMATURE_", "NATURAL_FREQ", "STIFFNESS_")), names)
source = wheel.read(robot).decode()
assert "G1_ACTION_SCALE[n] = 0.25 * e / s" in source and "effort_limit=5.0," in source and "stiffness=STIFFNESS_4010," in source
scale = 0.25 * 5.0 / names["STIFFNESS_4010"]
written = to_text([scale, 0.0004]).split(",")
change = abs(float(written[0]) / scale - 1)
print(f"{scale:.4f} is written as {written[0]}   0.0004 is written as {written[1]}   change of the action scale: {100 * change:.1f} %")
assert written[0] == f"{scale:.3f}" and written[1] == "0.000" and change > 0.005
PY
