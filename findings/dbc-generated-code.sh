#!/bin/sh
# cantools 45.1.0: of one DBC file and one value, cantools' Python rounds to the signal's nearest step, and the C that cantools generates from the file truncates toward zero: 0.3 rad in steps of 0.1 is 3 on
# the computer and 2 on the microcontroller. The C does not bring back what it read itself: of the 60,001 positions between -3000 and 3000, 3,264 that were decoded are encoded as their neighbor
# toward zero, so that a joint that is told to stay where it was read moves. There is no error.
# Seen on 2026-11-29:  0.3 0.7 0.26 -0.29 in steps of 0.1: Python 3 7 3 -3   C 2 6 2 -2   decoded and encoded again, changed of 60001: Python 0, C 3264
# It needs a C compiler.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
cat > motor.dbc <<'DBC'
VERSION ""
NS_ :
BS_:
BU_: HOST
BO_ 100 Motor: 8 HOST
 SG_ Position : 0|16@1- (0.1,0) [-3000|3000] "rad" HOST
DBC
python3 -m venv v && v/bin/pip install -q cantools==45.1.0
v/bin/cantools generate_c_source motor.dbc >/dev/null
cat > main.c <<'C'
#include <stdio.h>
#include "motor.h"
int main(void)
{
    const double values[] = {0.3, 0.7, 0.26, -0.29};
    for (int i = 0; i < 4; i++) printf("%d ", motor_motor_position_encode(values[i]));
    int changed = 0;
    for (int raw = -30000; raw <= 30000; raw++) changed += motor_motor_position_encode(motor_motor_position_decode((int16_t)raw)) != raw;
    printf("%d\n", changed);
}
C
cc -o generated main.c motor.c && ./generated > c.txt
v/bin/python - <<'PY'
import cantools

motor = cantools.database.load_file("motor.dbc").get_message_by_name("Motor")
encode = lambda value: int.from_bytes(motor.encode({"Position": value})[:2], "little", signed=True)
decode = lambda raw: motor.decode(raw.to_bytes(2, "little", signed=True) + bytes(6))["Position"]
seen = {"Python": [encode(value) for value in (0.3, 0.7, 0.26, -0.29)] + [sum(encode(decode(raw)) != raw for raw in range(-30000, 30001))]}
seen["C"] = [int(word) for word in open("c.txt").read().split()]
for name, numbers in seen.items():
    print(f"{name}: 0.3 0.7 0.26 -0.29 are {numbers[:4]}; changed of 60001: {numbers[4]}")
assert seen["Python"] == [3, 7, 3, -3, 0] and seen["C"][:4] == [2, 6, 2, -2] and seen["C"][4] > 1000
PY
