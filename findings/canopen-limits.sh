#!/bin/sh
# canopen 2.4.1: the limits that a drive's EDS file states for an object are read, and a value beyond them is sent all the same: of a target of 5000, where HighLimit is 1000, the package only writes a line to the log. A
# setpoint that is not whole loses its fraction in .raw, toward zero, and is rounded in .phys: 1.7 is 1 in one and 2 in the other. And a signed object's DefaultValue in hexadecimal, as EDS files have it, is
# read as a positive number, although its LowLimit is converted: 0xFFFF of an INTEGER16 is 65535, which the package then can't send.
# Seen on 2026-11-29:  HighLimit 1000, target 5000: sent 5000   1.7: raw 1, phys 2   -1.7: raw -1, phys -2   DefaultValue 0xFFFF: 65535, ValueError when sent   LowLimit 0xFC18: -1000
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
cat > drive.eds <<'EDS'
[FileInfo]
FileName=drive.eds
[DeviceInfo]
VendorName=Drive
[MandatoryObjects]
SupportedObjects=0
[OptionalObjects]
SupportedObjects=2
1=0x607A
2=0x6071
[607A]
ParameterName=Target position
ObjectType=0x7
DataType=0x0004
AccessType=rw
LowLimit=-1000
HighLimit=1000
DefaultValue=0
PDOMapping=1
[6071]
ParameterName=Target torque
ObjectType=0x7
DataType=0x0003
AccessType=rw
LowLimit=0xFC18
HighLimit=0x03E8
DefaultValue=0xFFFF
PDOMapping=1
EDS
python3 -m venv v && v/bin/pip install -q canopen==2.4.1
v/bin/python - 2>log.txt <<'PY' || { tail -n 20 log.txt; exit 1; }
import canopen


class Sent(canopen.variable.Variable):
    """An object of a drive that keeps the bytes that it is sent."""

    data = b""

    def get_data(self):
        return self.data

    def set_data(self, data):
        self.data = bytes(data)

    def number(self):
        return int.from_bytes(self.data, "little", signed=True)


drive = canopen.import_od("drive.eds", 1)
position, torque = Sent(drive[0x607A]), Sent(drive[0x6071])
position.raw = 5000
beyond = position.number()
print("HighLimit", drive[0x607A].max, "sent", beyond)
fractions = {}
for value in (1.7, -1.7):
    position.raw = value
    fractions[value] = [position.number()]
    position.phys = value
    fractions[value].append(position.number())
    print(f"{value}: raw {fractions[value][0]}, phys {fractions[value][1]}")
print("torque: LowLimit", drive[0x6071].min, "DefaultValue", drive[0x6071].default)
try:
    torque.raw = drive[0x6071].default
    raise SystemExit("the default is sent now")
except ValueError as error:
    print("ValueError:", error)
assert drive[0x607A].max == 1000 and beyond == 5000 and fractions == {1.7: [1, 2], -1.7: [-1, -2]}
assert drive[0x6071].min == -1000 and drive[0x6071].default == 65535
PY
grep "greater than max" log.txt
