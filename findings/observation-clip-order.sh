#!/bin/sh
# isaaclab 3.0.0, mjlab 1.6.0, holosoma 0.0.3 (read from their wheels): an observation term has a scale and a clip in all three, and each writes both of them
# beside an exported policy, without their order. mjlab and Isaac Lab clip and then scale; holosoma scales and then clips: with scale 0.05 and clip [-10, 10], a
# joint velocity of 30 is 0.5 for the policies of two and 1.5 for those of one.
# Seen on 2026-11-28:  isaaclab: clip, scale   mjlab: clip, scale   holosoma: scale, clip
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v
for package in isaaclab==3.0.0 mjlab==1.6.0 holosoma==0.0.3; do v/bin/pip download -q --no-deps --only-binary=:all: --python-version 3.12 $package; done
v/bin/python - <<'PY'
import ast, glob, zipfile

files = {
    "isaaclab": "isaaclab/managers/observation_manager.py",
    "mjlab": "mjlab/managers/observation_manager.py",
    "holosoma": "holosoma/managers/observation/manager.py",
}
seen = {}
for package, path in files.items():
    tree = ast.parse(zipfile.ZipFile(glob.glob(f"{package}-*.whl")[0]).read(path).decode())
    compute = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) and node.name in ("compute_group", "_compute_group")][0]
    tests = [(node.lineno, ast.unparse(node.test)) for node in ast.walk(compute) if isinstance(node, ast.If)]
    order = [key for _, test in sorted(tests) for key in ("clip", "scale") if f"term_cfg.{key}" in test]
    seen[package] = order
    print(f"{package}: {', '.join(order)}")
assert seen == {"isaaclab": ["clip", "scale"], "mjlab": ["clip", "scale"], "holosoma": ["scale", "clip"]}, seen
PY
