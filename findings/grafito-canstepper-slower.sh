#!/bin/sh
# grafito-canstepper 0.2.3, pyserial 3.5 (steppers over CAN): a coordinated move makes later ones slower, for good. MotionGroup.move_to() stretches
# the axes with less to do, so that all end together, by writing a lower MAX_SPEED to their nodes. It never writes the old one back. An axis without a
# limit of its own takes MAX_SPEED as its limit in the next move, and so the stretched speed becomes the limit. After one move of 100 in x and 1 in y,
# a move of 100 in y takes 100 times as long. The next one with 1 in x makes x as slow. CoreXY and Cartesian without a speed do the same. The
# documentation speaks of the node's "current MAX_SPEED parameter". Two moves that belong together in a program that runs all day end in a creep.
# There is no error, until a blocking move of more than 120 s runs into its timeout.
# Seen on 2026-12-01:  y 0 to 100: 1.75 s   after a move of (100, 1): 174.6 s, MAX_SPEED of y 80 -> 0.573   CoreXY (0, 0) to (50, -50): 1.75 s, after
#                      (50, 49): 173.4 s
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps grafito-canstepper==0.2.3 pyserial==3.5
cat > run.py <<'PY'
from canstepper import Axis, CANStepperBus, Cartesian, CoreXY, MotionGroup, Param
from canstepper.sim import SimNetwork


def nodes():
    """Two nodes of the package's own simulator, switched on."""
    bus = CANStepperBus(SimNetwork([1, 2]))
    pair = bus.node(1), bus.node(2)
    for node in pair:
        node.enable()
    return pair


def speed(axis):
    return axis.deg_to_units(axis.node.get_param(Param.MAX_SPEED))


x, y = (Axis(node, 40.0, name=name) for node, name in zip(nodes(), "xy"))
group = MotionGroup([x, y])
fresh = group.move_to({"x": 0, "y": 100}, blocking=False)
group.move_to({"x": 0, "y": 0}, blocking=False)
before = speed(y)
group.move_to({"x": 100, "y": 1}, blocking=False)
group.move_to({"x": 0, "y": 0}, blocking=False)
after = speed(y)
later = group.move_to({"x": 0, "y": 100}, blocking=False)
print(f"SEEN y 0 to 100: {fresh:.2f} s, after a move of (100, 1): {later:.1f} s, MAX_SPEED of y {before:.1f} -> {after:.4f}")
assert abs(fresh - 1.75) < 1e-3 and later > 90 * fresh and before > 100 * after

core = CoreXY(*nodes(), 40.0)
fresh = core.move_to(50, -50, blocking=False)
core.move_to(0, 0, blocking=False)
core.move_to(50, 49, blocking=False)
core.move_to(0, 0, blocking=False)
later = core.move_to(50, -50, blocking=False)
print(f"SEEN CoreXY (0, 0) to (50, -50): {fresh:.2f} s, after a move of (50, 49): {later:.1f} s")
assert later > 90 * fresh

bed = Cartesian.from_nodes(*nodes())
fresh = bed.move_to(0, 100, blocking=False)
bed.move_to(0, 0, blocking=False)
bed.move_to(100, 1, blocking=False)
bed.move_to(0, 0, blocking=False)
later = bed.move_to(0, 100, blocking=False)
print(f"SEEN Cartesian (0, 0) to (0, 100): {fresh:.2f} s, after a move of (100, 1): {later:.1f} s")
assert later > 90 * fresh

# A limit of the axis's own keeps the speed.
x, y = (Axis(node, 40.0, name=name, max_speed=80.0) for node, name in zip(nodes(), "xy"))
group = MotionGroup([x, y])
group.move_to({"x": 100, "y": 1}, blocking=False)
group.move_to({"x": 0, "y": 0}, blocking=False)
later = group.move_to({"x": 0, "y": 100}, blocking=False)
print(f"SEEN with max_speed of the axes: {later:.2f} s")
assert abs(later - 1.75) < 1e-3
PY
v/bin/python run.py
