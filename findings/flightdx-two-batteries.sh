#!/bin/sh
# flightdx 0.1.0, pymavlink 2.4.50, pyulog 1.3.0, pydantic 2.14.4 (diagnosis of ArduPilot's logs): the sensors of one kind are taken for one. A log marks them by a number in each message (BAT's Inst, GPS's I, VIBE's IMU); flightdx reads all into one series,
# in which the voltage jumps from one battery's to the other's with each message. A drone with a full battery of 6 cells for its motors and a full one of 3 for its camera has a "critical" sag to 12.3 V for the whole flight, and one with a second GPS that has no fix a
# "critical" loss of the fix, with 14 satellites on the first one. The other way round, a log without a battery's messages has the autopilot's own supply (POWR's Vcc, 5 V) as battery_voltage. And clipping of the accelerometers, "Clip0", "Clip1", "Clip2",
# which older logs have, is 0 for the logs of today, whose VIBE has one "Clip" for each IMU: of 450 clips in 9 s nothing is reported, where the same in the old form is critical (the messages' fields are those of ArduPilot's sources, from knowledge). There is no error; the quality report says that vibration is there.
# Seen on 2026-12-01:  one battery: no incident   two: critical, 12.3 V   second GPS without a fix: critical, 0   450 clips: none; old form: accel_clipping, critical   only POWR: battery_voltage 5.0 V
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q flightdx==0.1.0 pymavlink==2.4.50 pyulog==1.3.0 pydantic==2.14.4 numpy==2.4.6
cat > run.py <<'PY'
import struct

from flightdx import analyze_log, parse_dataflash

# Kinds of messages: number, format of the fields, their names.
KINDS = {
    "BAT": (200, "QBff", "TimeUS,Inst,Volt,Curr"),
    "GPS": (201, "QBBIHBf", "TimeUS,I,Status,GMS,GWk,NSats,HDop"),
    "POWR": (202, "Qff", "TimeUS,Vcc,VServo"),
    "VIBE": (203, "QBfffI", "TimeUS,IMU,VibeX,VibeY,VibeZ,Clip"),
    "VIBE, old": (203, "QfffIII", "TimeUS,VibeX,VibeY,VibeZ,Clip0,Clip1,Clip2"),
    "MSG": (204, "QZ", "TimeUS,Message"),
}


def analyze(title, kind, *sensors):
    """The incidents of ten seconds of one message a second for each sensor."""
    number, form, names = KINDS[kind]
    size = 3 + struct.calcsize("<" + form)
    head = b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", 128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")
    head += b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", number, size, kind[:4].encode(), form.encode(), names.encode())
    body = b"".join(
        b"\xa3\x95" + bytes([number]) + struct.pack("<" + form, i * 1_000_000, *(value(i) if callable(value) else value for value in sensor))
        for i in range(1, 11) for sensor in sensors
    )
    with open("flight.bin", "wb") as file:
        file.write(head + body)
    log = parse_dataflash("flight.bin")
    found = [(i.type, i.severity, round(i.evidence[0].value, 1)) for i in analyze_log(log).incidents]
    print(f"SEEN {title}: {found or 'no incident'}")
    return log, found


assert analyze("one battery, 24.6 V", "BAT", (0, 24.6, 5.0))[1] == []
log, found = analyze("a second one, 12.3 V", "BAT", (0, 24.6, 5.0), (1, 12.3, 1.0))
assert found == [("battery_voltage_sag", "critical", 12.3)]
assert [round(v, 1) for v in log.signals["battery_voltage"].values[:4]] == [24.6, 12.3, 24.6, 12.3]
assert analyze("one GPS", "GPS", (0, 3, 1000, 2400, 14, 0.7))[1] == []
log, found = analyze("a second one without a fix", "GPS", (0, 3, 1000, 2400, 14, 0.7), (1, 0, 1000, 2400, 0, 99.9))
assert ("gps_fix_loss", "critical", 0.0) in found and log.signals["gps_nsats"].values[:4] == [14, 0, 14, 0]
log, _ = analyze("only POWR", "POWR", (5.0, 5.0))
print(f"SEEN only POWR: battery_voltage {log.signals['battery_voltage'].values[0]} V")
assert log.signals["battery_voltage"].values[0] == 5.0
log, found = analyze("50 clips a second", "VIBE", (0, 1.0, 1.0, 2.0, lambda i: 50 * i))
assert found == [] and set(log.signals["clip0"].values) == {0.0} and log.quality.has_vibration
assert analyze("50 clips a second, old form", "VIBE, old", (1.0, 1.0, 2.0, lambda i: 50 * i, 0, 0))[1] == [("accel_clipping", "critical", 450.0)]
PY
v/bin/python run.py
