#!/bin/sh
# canmatrix 1.3.3, cantools 45.1.0 (messages of a CAN bus from a DBC file): Frame.encode() takes a number for the raw value and a string for the
# physical one. With a factor of 0.1 and an offset of 5, Pos=12.3 is packed as raw 12, which is 6.2 degrees, and Pos="12.3" as 12.3. Frame.decode()
# gives both values, and encoding what phys_value says does not give the frame back. The documentation says "data dictionary". cantools takes a number
# for the physical value. A raw number is cut to whole, and one that is too large wraps to the other sign: 5000 degrees as a string is packed as
# -1553.6, where cantools raises an error. And if the multiplexer is given by its name, as decode()'s named_value has it, all signals of that choice
# are left out and packed as 0: the motor is told to go to 5 degrees, the offset. For all of this there is no error.
# Seen on 2026-12-01:  Pos=12.3 degrees: canmatrix 6.2, as a string 12.3, cantools 12.3   "5000": -1553.6, cantools OverflowError   Mode="pos": 5.0,
#                      cantools 12.3
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q canmatrix==1.3.3 cantools==45.1.0
cat > motor.dbc <<'DBC'
VERSION ""

NS_ :

BS_:

BU_: Host Motor

BO_ 100 Command: 4 Host
 SG_ Mode M : 0|8@1+ (1,0) [0|255] "" Motor
 SG_ Pos m1 : 8|16@1- (0.1,5) [0|0] "deg" Motor
 SG_ Vel m2 : 8|16@1- (0.01,0) [0|0] "rad/s" Motor

VAL_ 100 Mode 1 "pos" 2 "vel" ;
DBC
cat > run.py <<'PY'
import canmatrix.formats
import cantools

frame = canmatrix.formats.loadp_flat("motor.dbc").frame_by_name("Command")
message = cantools.database.load_file("motor.dbc").get_message_by_name("Command")


def seen(data):
    """The position in degrees that both packages read in a frame, which they agree on."""
    physical = float(frame.decode(data)["Pos"].phys_value)
    assert abs(message.decode(bytes(data))["Pos"] - physical) < 1e-9
    return round(physical, 6)


number, text = (seen(frame.encode({"Mode": 1, "Pos": position})) for position in (12.3, "12.3"))
right = seen(message.encode({"Mode": 1, "Pos": 12.3}))
print(f"SEEN Pos 12.3: canmatrix {number}, as a string {text}, cantools {right}")
assert (number, text, right) == (6.2, 12.3, 12.3)

sent = message.encode({"Mode": 1, "Pos": 12.3})
again = frame.encode({name: signal.phys_value for name, signal in frame.decode(sent).items()})
raw = frame.encode({name: signal.raw_value for name, signal in frame.decode(sent).items()})
named = frame.encode({name: signal.named_value for name, signal in frame.decode(sent).items()})
print("SEEN the frame again from phys_value:", seen(again), " from raw_value:", seen(raw), " from named_value:", seen(named))
assert (seen(again), seen(raw), seen(named)) == (6.2, 12.3, 5.0)

large = seen(frame.encode({"Mode": 1, "Pos": "5000"}))
try:
    message.encode({"Mode": 1, "Pos": 5000})
    error = "none"
except Exception as raised:
    error = type(raised).__name__
print(f"SEEN Pos 5000: canmatrix, as a string, {large}, cantools {error}")
assert large == -1553.6 and error != "none"

choice, other = seen(frame.encode({"Mode": "pos", "Pos": "12.3"})), seen(message.encode({"Mode": "pos", "Pos": 12.3}))
print(f'SEEN Mode "pos", Pos 12.3: canmatrix {choice}, cantools {other}')
assert (choice, other) == (5.0, 12.3)
PY
v/bin/python run.py 2> err.txt || { tail -n 20 err.txt; exit 1; }
