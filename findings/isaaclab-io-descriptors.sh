#!/bin/sh
# isaaclab 3.0.0 (read from its wheel): the description of the observations that it exports (get_IO_descriptors) states history_length but not history_order,
# which says if the history of a group is in the observation term by term or step by step: two layouts have the same description. And it states the axes of
# root_quat_w as W, X, Y, Z, while the function gives x, y, z, w.
# Seen on 2026-11-28:  history_length: described   history_order: not described   axes W X Y Z, documented (x, y, z, w)
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip download -q --no-deps --only-binary=:all: --python-version 3.12 isaaclab==3.0.0
v/bin/python - <<'PY'
import ast, glob, zipfile

wheel = zipfile.ZipFile(glob.glob("isaaclab-*.whl")[0])


def function(path, name):
    tree = ast.parse(wheel.read(path).decode())
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) and node.name == name][0]


describe = function("isaaclab/managers/observation_manager.py", "_collect_io_descriptors")
words = {node.value for node in ast.walk(describe) if isinstance(node, ast.Constant)}
words |= {node.attr for node in ast.walk(describe) if isinstance(node, ast.Attribute)}
prepare = ast.unparse(function("isaaclab/managers/observation_manager.py", "_prepare_terms"))
assert "group_cfg.history_order == 'time'" in prepare
for name in ("history_length", "history_order"):
    print(f"{name}: {'described' if name in words else 'not described'}")
quaternion = function("isaaclab/envs/mdp/observations.py", "root_quat_w")
axes = [ast.literal_eval(word.value) for word in quaternion.decorator_list[0].keywords if word.arg == "axes"][0]
given = "(x, y, z, w)" in ast.get_docstring(quaternion)
print("axes", *axes, "  documented", "(x, y, z, w)" if given else "otherwise")
assert "history_length" in words and "history_order" not in words and "_group_obs_time_major" not in words
assert axes == ["W", "X", "Y", "Z"] and given
PY
