#!/bin/sh
# mujoco 4.0.0 (and from 3.12.0 on), numpy 2.4.6: if an entry of a model's jnt_type equals mjtJoint.mjJNT_HINGE depends on the side that it is written on. jnt_type[0] == mjJNT_HINGE is true,
# mjJNT_HINGE == jnt_type[0] is false: the enumeration compares itself with Python's int, and no more with numpy's. So `jnt_type[0] in (mjJNT_HINGE, mjJNT_SLIDE)` is false for a hinge, and a
# dict by joint types does not find it, although both hashes are equal: code that collects the actuated joints so has none, without an error. With 3.11.0 all of these are true.
# gymnasium-robotics 1.4.2, which takes any version of mujoco, asserts it: its set_joint_qpos and three more functions refuse every hinge and slide.
# Seen on 2026-11-29:  3.11.0: all true   4.0.0: jnt_type[0] == mjJNT_HINGE true, the other way, in a tuple, list and set, as a dict's key: false; with int(): true
#                      gymnasium-robotics: AssertionError
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
cat > compare.py <<'PY'
import mujoco

HINGE, SLIDE = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
model = mujoco.MjModel.from_xml_string('<mujoco><worldbody><body><joint name="j" type="hinge"/><geom size=".1"/></body></worldbody></mujoco>')
kind = model.jnt_type[0]
seen = {
    "kind == HINGE": bool(kind == HINGE),
    "jnt_type == HINGE": bool((model.jnt_type == HINGE).all()),
    "equal hashes": hash(kind) == hash(HINGE),
    "int in tuple": int(kind) in (HINGE, SLIDE),
    "int key of a dict": int(kind) in {HINGE: "hinge"},
    "HINGE == kind": bool(HINGE == kind),
    "in tuple": kind in (HINGE, SLIDE),
    "in list": kind in [HINGE, SLIDE],
    "in set": kind in {HINGE, SLIDE},
    "key of a dict": kind in {HINGE: "hinge"},
}
print(mujoco.__version__, *(f"{name}: {value}  " for name, value in seen.items()))
assert all(list(seen.values())[:5])
assert list(seen.values())[5:] == [mujoco.__version__ == "3.11.0"] * 5
PY
python3 -m venv old && old/bin/pip install -q mujoco==3.11.0 numpy==2.4.6
old/bin/python compare.py
python3 -m venv v && v/bin/pip install -q mujoco==4.0.0 gymnasium-robotics==1.4.2 gymnasium==1.4.0 numpy==2.4.6
v/bin/python compare.py
v/bin/python -W ignore - 2>err.txt <<'PY' || { tail -n 20 err.txt; exit 1; }
import mujoco
from gymnasium_robotics.utils import mujoco_utils

for kind in ("hinge", "slide"):
    model = mujoco.MjModel.from_xml_string(f'<mujoco><worldbody><body><joint name="j" type="{kind}"/><geom size=".1"/></body></worldbody></mujoco>')
    try:
        mujoco_utils.set_joint_qpos(model, mujoco.MjData(model), "j", 0.3)
        raise SystemExit(f"set_joint_qpos takes a {kind} now")
    except AssertionError:
        print("gymnasium-robotics: set_joint_qpos of a", kind, "AssertionError")
PY
