#!/bin/sh
# jparse-robotics 0.1.0, pin 4.1.0, numpy 2.4.6 (velocities of an arm's joints near singularities): num_joints, "Number of actuated joints", is the length of Pinocchio's configuration, in which a continuous joint has two numbers, its cosine and
# sine. The README's q = np.zeros(robot.num_joints) is then no configuration: the rotation of that joint is a matrix of zeros, the hand is at its axis, and the velocities are those of another arm.
# And the argument base_link, "Name of the base link (fixed frame)", is not read: poses and velocities are in the frame of the file's root, here turned by 90 degrees, and a name that the file does not have is taken
# too, where the documentation promises a ValueError. There is no error and no warning.
# Seen on 2026-11-30:  2 joints (one continuous): num_joints 3, num_velocities 2; zeros: hand at 0.0, 0.0, 0.0, determinant of its rotation 0   cos 0, sin 0: hand at 0.0, 0.7, 0.0   base_link "shoulder", "world", "nonsense": one result, 0.0, 0.7, 0.0 (in "shoulder": 0.7, 0.0, 0.0)
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q jparse-robotics==0.1.0 pin==4.1.0 numpy==2.4.6
cat > run.py <<'PY'
import jparse_robotics
import numpy as np

LINK = "<link name='{}'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
URDF = "<robot name='arm'>" + "".join(LINK.format(name) for name in ("world", "shoulder", "upper", "lower", "hand")) + """
<joint name='mount' type='fixed'><parent link='world'/><child link='shoulder'/><origin xyz='0 0 0' rpy='0 0 1.5707963267948966'/></joint>
<joint name='a' type='continuous'><parent link='shoulder'/><child link='upper'/><axis xyz='0 0 1'/></joint>
<joint name='b' type='revolute'><parent link='upper'/><child link='lower'/><origin xyz='0.4 0 0'/><axis xyz='0 0 1'/><limit lower='-3' upper='3' effort='1' velocity='1'/></joint>
<joint name='c' type='fixed'><parent link='lower'/><child link='hand'/><origin xyz='0.3 0 0'/></joint>
</robot>"""


def robot(base):
    return jparse_robotics.Robot.from_urdf(URDF, base, "hand")


arm = robot("shoulder")
place, turned = arm.forward_kinematics(np.zeros(arm.num_joints))
right = np.array([1.0, 0.0, 0.0])  # cosine and sine of the first joint, angle of the second
print("SEEN joints:", arm.num_joints, "velocities:", arm.num_velocities, " zeros: hand at", place.round(3), "determinant", round(float(np.linalg.det(turned)), 6))
assert arm.num_joints == 3 and arm.num_velocities == 2
assert np.abs(place).max() < 1e-9 and abs(np.linalg.det(turned)) < 1e-9
assert np.abs(arm.jparse(np.zeros(3)) - arm.jparse(right)).max() > 0.1

places = {base: robot(base).forward_kinematics(right)[0].round(6) for base in ("shoulder", "world", "nonsense")}
rates = {base: robot(base).jacobian(right)[:3].round(6).tolist() for base in places}
print("SEEN base_link:", {base: at.tolist() for base, at in places.items()}, rates)
assert all(np.allclose(at, (0.0, 0.7, 0.0), atol=1e-6) for at in places.values())
assert rates["shoulder"] == rates["world"] == rates["nonsense"]
assert "fixed frame" in jparse_robotics.Robot.from_urdf.__doc__ and "If the specified links are not found" in jparse_robotics.Robot.from_urdf.__doc__
PY
v/bin/python run.py
