#!/bin/sh
# rosbags 0.11.9, numpy 2.4.6: an array of a message is written by its bytes: an array of int64, which numpy makes of whole numbers, in a field of float64 has other numbers when it is read, and there is no error. The joint positions
# np.array([0, 1, -2]) of a JointState are [0, 5e-324, NaN] in the file, in ROS 1 and in ROS 2. int32 in a field of float32 is the same: efforts, images of depth. Big-endian float64 in ROS 2 are 3e-319, too. Where the sizes differ
# (float32, int32 in float64) an error is raised. Positions that were calculated as floats are right, so that it shows only where an action or a motor's steps are whole.
# Seen on 2026-11-30:  [0, 1, -2]: [0.0, 5e-324, nan] in ROS 1 and ROS 2   float64: [0.0, 1.0, -2.0]   float32: ValueError   int32 ranges [1, 2] of a LaserScan: [1.4e-45, 2.8e-45]
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q rosbags==0.11.9 numpy==2.4.6
v/bin/python - <<'PY'
import numpy as np
from rosbags.typesys import Stores, get_typestore

for name in (Stores.ROS2_HUMBLE, Stores.ROS1_NOETIC):
    store = get_typestore(name)
    two = name is Stores.ROS2_HUMBLE
    write, read = (store.serialize_cdr, store.deserialize_cdr) if two else (store.serialize_ros1, store.deserialize_ros1)
    stamp = store.types["builtin_interfaces/msg/Time"](sec=1, nanosec=0)
    header = store.types["std_msgs/msg/Header"](**({} if two else {"seq": 0}), stamp=stamp, frame_id="base")

    def positions(array):
        kind = "sensor_msgs/msg/JointState"
        message = store.types[kind](header=header, name=["a", "b", "c"], position=array, velocity=np.zeros(0), effort=np.zeros(0))
        return read(write(message, kind), kind).position

    def ranges(array):
        kind = "sensor_msgs/msg/LaserScan"
        numbers = ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min", "range_max")
        message = store.types[kind](header=header, **dict.fromkeys(numbers, 0.0), ranges=array, intensities=np.zeros(0, np.float32))
        return read(write(message, kind), kind).ranges

    whole, real, scan = positions(np.array([0, 1, -2])), positions(np.array([0.0, 1.0, -2.0])), ranges(np.array([1, 2], np.int32))
    try:
        positions(np.zeros(3, np.float32))
        raised = False
    except ValueError:
        raised = True
    print(f"SEEN {name.name}: whole {whole.tolist()}, real {real.tolist()}, ranges {scan.tolist()}, float32 refused {raised}")
    assert whole[0] == 0.0 and whole[1] == 5e-324 and np.isnan(whole[2])
    assert real.tolist() == [0.0, 1.0, -2.0] and raised and (0 < scan).all() and (scan < 1e-40).all()
    big = positions(np.array([0.0, 1.0, -2.0], ">f8"))
    assert big[1] < 1e-300 if two else big.tolist() == [0.0, 1.0, -2.0]
PY
