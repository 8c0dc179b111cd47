#!/bin/sh
# mcap-ros2-support 0.6.0, mcap-ros2-support-fast 0.8.0, rosbags 0.11.9: a Duration of ROS 2 has signed seconds, and mcap-ros2-support takes them for unsigned: -0.5 s (sec -1, nanosec 500000000), a message that came late or a timeout of -1 s for
# "for ever", is read as 4294967295.5 s, 136 years, in the decoder that recordings are read with, also within a JointTrajectoryPoint. Its writer refuses to write it. mcap-ros2-support-fast and rosbags read -1. And a default of an array in
# the message's definition, float64[] gains [1.0, 2.0], which numbers and texts get in both packages, is left out by mcap-ros2-support's writer: a message without gains has no gains, and with mcap-ros2-support-fast [1, 2]. There is no error.
# Seen on 2026-11-30:  -0.5 s: rosbags -1, mcap-ros2-support-fast -1, mcap-ros2-support 4294967295; writing it: error   array's default: mcap-ros2-support [], mcap-ros2-support-fast [1.0, 2.0]; number's default: 7 and 7
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q mcap==1.6.0 mcap-ros2-support==0.6.0 mcap-ros2-support-fast==0.8.0 rosbags==0.11.9 numpy==2.4.6
cat > run.py <<'PY'
import io
import struct

import mcap_ros2_support_fast as fast
from mcap.reader import make_reader
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer
from rosbags.typesys import Stores, get_typestore

POINT = """float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start"""
NAME = "trajectory_msgs/msg/JointTrajectoryPoint"
store = get_typestore(Stores.ROS2_HUMBLE)


def schema(name, text):
    return Schema(id=1, name=name, encoding="ros2msg", data=text.encode())


def decoded(factory, name, text, data):
    return factory.decoder_for("cdr", schema(name, text))(data)


import numpy as np

empty = np.array([], np.float64)
duration = store.types["builtin_interfaces/msg/Duration"](sec=-1, nanosec=500_000_000)
message = store.types[NAME](positions=np.array([0.25]), velocities=empty, accelerations=empty, effort=empty, time_from_start=duration)
data = bytes(store.serialize_cdr(message, NAME))
seconds = {
    "rosbags": store.deserialize_cdr(data, NAME).time_from_start.sec,
    "fast": decoded(fast.DecoderFactory(), NAME, POINT, data).time_from_start.sec,
    "support": decoded(DecoderFactory(), NAME, POINT, data).time_from_start.sec,
}
point = dict(positions=[0.25], velocities=[], accelerations=[], effort=[], time_from_start=dict(sec=-1, nanosec=500_000_000))
writer = Writer(io.BytesIO())
try:
    writer.write_message("/t", writer.register_msgdef(NAME, POINT), point)
    refused = False
except struct.error:
    refused = True

DEFAULTS = "int32 steps 7\nfloat64[] gains [1.0, 2.0]"
stream = io.BytesIO()
writer = Writer(stream)
writer.write_message("/t", writer.register_msgdef("pkg/msg/Gains", DEFAULTS), {})
writer.finish()
one = [message.data for *_, message in make_reader(io.BytesIO(stream.getvalue())).iter_messages()][0]
two = bytes(fast.ROS2EncoderFactory().encoder_for(schema("pkg/msg/Gains", DEFAULTS))({}))
one, two = (decoded(DecoderFactory(), "pkg/msg/Gains", DEFAULTS, written) for written in (one, two))
print("SEEN", seconds, f"refused {refused}; defaults: support {one.steps} {one.gains}, fast {two.steps} {two.gains}")
assert seconds == {"rosbags": -1, "fast": -1, "support": 4294967295} and refused
assert (one.steps, one.gains, two.steps, two.gains) == (7, [], 7, [1.0, 2.0])
PY
v/bin/python run.py
