#!/bin/sh
# mcap-ros2-support 0.6.0, mcap 1.6.0: the writer of ROS 2 messages takes a dict, and what does not fit the message's definition is changed without an error. A field of another name, "positions" of a JointState in place of "position", is
# left out, and the message's own field is empty. Of seven numbers for an array of six, the last one is dropped; of five, the sixth is 0 (and the caller's list has a None more afterwards, so that the next message of it differs). A number
# for an integer loses its fraction. A recording of a robot whose driver has another number of joints than its definition says looks valid, and a policy is trained on it.
# Seen on 2026-11-30:  positions=[1, 2]: position []   float64[6] of 7: 1 2 3 4 5 6, of 5: 1 2 3 4 5 0, the list afterwards 1 2 3 4 5 None   int32 of 1.9: 1
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q mcap-ros2-support==0.6.0 mcap==1.6.0
v/bin/python - <<'PY'
import io
from mcap_ros2.reader import read_ros2_messages
from mcap_ros2.writer import Writer

STATE = "string[] name\nfloat64[] position\nfloat64[6] joints\nint32 ticks\nfloat64[<=2] ends\n"


def recorded(**message):
    """The message as a reader of the file has it."""
    file = io.BytesIO()
    writer = Writer(file)
    writer.write_message("/state", writer.register_msgdef("robot_msgs/msg/State", STATE), message)
    writer.finish()
    file.seek(0)
    return next(iter(read_ros2_messages(file))).ros_msg


other = recorded(name=["a", "b"], positions=[1.0, 2.0])
five, seven = [1.0, 2.0, 3.0, 4.0, 5.0], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
less, more = recorded(joints=five).joints, recorded(joints=seven).joints
print("SEEN positions=[1, 2]:", other.name, other.position, "  of 7:", more, "  of 5:", less, "  the list afterwards:", five)
assert (other.name, other.position) == (["a", "b"], []) and more == [1, 2, 3, 4, 5, 6] and less == [1, 2, 3, 4, 5, 0] and five == [1, 2, 3, 4, 5, None]
ticks, ends = recorded(ticks=1.9).ticks, recorded(ends=[1.0, 2.0, 3.0]).ends
print("SEEN int32 of 1.9:", ticks, "  at most two of three:", ends)
assert ticks == 1 and ends == [1, 2]
PY
