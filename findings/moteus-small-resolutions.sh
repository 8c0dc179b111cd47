#!/bin/sh
# moteus 1.1.1: with the small resolutions (mp.INT16, mp.INT8), which several joints in one CAN frame need, a command beyond what the number can hold is sent as the greatest number, and there is no error: a joint that has a gear
# that is told to go to 5 revolutions of its motor goes to 3.2767. A kp_scale of 2, for a stiffer joint, is 1. A watchdog_timeout of 60 s is 32.767 s, and a velocity_limit of 20 is 8.19. An infinite velocity, for no limit, becomes
# NaN, which means the configured one. A feedforward torque of 0.4 Nm is 0 with INT8, whose step is 0.5 Nm. Only floats (the default) keep them.
# Seen on 2026-11-30:  INT16: position 5 -> 3.2767, kp_scale 2 -> 1, watchdog_timeout 60 -> 32.767, velocity_limit 20 -> 8.19175, inf -> NaN   INT8: feedforward torque 0.4 -> 0   F32: as given
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q moteus==1.1.1
v/bin/python -W error::UserWarning - <<'PY'
import math
import moteus
from moteus import multiplex as mp, protocol


def sent(resolution, **command):
    """The one command of a position frame as a controller reads it."""
    (name,) = command
    resolutions = moteus.PositionResolution()
    setattr(resolutions, name, resolution)
    frame = moteus.Controller(position_resolution=resolutions).make_position(**command)
    register = {
        "position": moteus.Register.COMMAND_POSITION,
        "kp_scale": moteus.Register.COMMAND_KP_SCALE,
        "watchdog_timeout": moteus.Register.COMMAND_TIMEOUT,
        "velocity_limit": moteus.Register.COMMAND_VELOCITY_LIMIT,
        "feedforward_torque": moteus.Register.COMMAND_FEEDFORWARD_TORQUE,
    }[name]
    values = {part.register: protocol.scale_register(part.register, part.resolution, part.value) for part in mp.parse_frame(frame.data) if part.type == mp.SubframeType.WRITE}
    return values[register]


for resolution, name, value, expected in (
    (mp.INT16, "position", 5.0, 3.2767),
    (mp.INT16, "kp_scale", 2.0, 1.0),
    (mp.INT16, "watchdog_timeout", 60.0, 32.767),
    (mp.INT16, "velocity_limit", 20.0, 8.19175),
    (mp.INT16, "velocity_limit", math.inf, math.nan),
    (mp.INT8, "feedforward_torque", 0.4, 0.0),
):
    small, full = sent(resolution, **{name: value}), sent(mp.F32, **{name: value})
    print(f"SEEN {name} {value}: {small:.5g}, as a float {full:.5g}")
    assert math.isnan(small) if math.isnan(expected) else abs(small - expected) < 1e-6
    assert full == value or abs(full - value) < 1e-6
PY
