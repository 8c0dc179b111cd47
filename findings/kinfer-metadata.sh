#!/bin/sh
# kinfer 0.6.1: the metadata of its archive has three keys. Neither the control rate nor what the outputs are (positions, velocities, torques) can be stated: a
# file that names them is read without an error, and they are gone when it is written.
# Seen on 2026-11-28:  carry_size, command_names, joint_names
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q kinfer==0.6.1 onnx==1.20.1 numpy==2.4.6
v/bin/python - <<'PY'
import json
from kinfer.rust_bindings import PyModelMetadata, metadata_from_json

made = json.loads(PyModelMetadata(joint_names=["hip", "knee"], command_names=["x"], carry_size=[4]).to_json())
read = json.loads(metadata_from_json(json.dumps(made | {"control_frequency_hz": 50, "action_type": "position"})).to_json())
print(*sorted(read), sep=", ")
assert read == made and sorted(read) == ["carry_size", "command_names", "joint_names"]
PY
