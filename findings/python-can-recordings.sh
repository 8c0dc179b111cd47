#!/bin/sh
# python-can 4.6.1: a recording of a bus, read back, depends on the file's ending. Of four messages (a command that was sent, its answer, and two of CAN FD, of 64 and 12 bytes), .csv and .db give CAN FD back as classic CAN, with
# 64 bytes in a frame that can have 8, and all as received: the commands of a policy can no longer be told from the motors' answers. .trc has no CAN FD, and counts channels from 1: each copy of a recording moves its messages to
# the next channel, 0, 1, 2. .csv and .db have no channel. There is no error; only .trc writes a warning to the log. .asc, .blf and .log (candump) keep all of it, the channel of .log as a name.
# Seen on 2026-11-30:  csv, db: is_fd False, is_rx True, channel None   trc: 2 of 4 messages, channel 0 is 1, and 2 when copied   asc, blf, log: as recorded
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q python-can==4.6.1
v/bin/python -W ignore - 2>log.txt <<'PY'
import can

START = 1764460800.0
messages = [
    can.Message(timestamp=START, arbitration_id=0x141, is_extended_id=False, data=range(8), channel=0, is_rx=False),
    can.Message(timestamp=START + 0.001, arbitration_id=0x241, is_extended_id=False, data=range(8), channel=0),
    can.Message(timestamp=START + 0.002, arbitration_id=1, is_extended_id=False, is_fd=True, bitrate_switch=True, data=range(64), channel=0),
    can.Message(timestamp=START + 0.003, arbitration_id=2, is_extended_id=False, is_fd=True, data=range(12), channel=0),
]


def copy(messages, name):
    with can.Logger(name) as logger:
        for message in messages:
            logger.on_message_received(message)
    with can.LogReader(name) as reader:
        return list(reader)


expected = [(False, False), (True, False), (True, True), (True, True)]
for ending in ("asc", "blf", "log", "csv", "db", "trc"):
    read = copy(messages, f"one.{ending}")
    seen = [(message.is_rx, message.is_fd) for message in read]
    channels = {message.channel for message in read}
    print(f"SEEN {ending}: rx, fd {seen}, channels {channels}, bytes {[len(message.data) for message in read]}")
    assert all(list(message.data) == list(range(len(message.data))) for message in read)
    if ending in ("csv", "db"):
        assert seen == [(True, False)] * 4 and channels == {None} and len(read[2].data) == 64
    elif ending == "trc":
        twice = copy(read, "two.trc")
        print(f"SEEN trc of trc: channels { {message.channel for message in twice} }")
        assert seen == expected[:2] and channels == {1} and {message.channel for message in twice} == {2}
    else:
        assert seen == expected and channels == ({"can0"} if ending == "log" else {0})
PY
