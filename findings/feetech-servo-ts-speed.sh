#!/bin/sh
# feetech-servo-ts 1.0.0 (npm), st3215 0.4.2 (PyPI): the package for Feetech's STS3215 converts speeds by the scale of another make's servos (1023 for 114 rpm), where the goal speed of these is in steps per second, of 4096
# for a turn, as its own table of models has it and st3215 states: 60 rpm become 538, with which the servo turns at 7.9 rpm, and speeds are limited to 1023, 15 rpm. Speeds and positions below 0, which have a
# sign bit, are read as large ones: -100 steps per second as 3663 rpm, and a position of -10 as 2881 degrees. There is no error.
# Seen on 2026-11-29:  rpmToSpeed(60): 538, 7.9 rpm   clampSpeed(4096): 1023   speed -100: 3663 rpm   position -10: 2881 degrees   position 1024: 90 degrees
# It needs node and npm.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
npm install --silent --no-audit --no-fund feetech-servo-ts@1.0.0 >/dev/null
python3 -m venv v && v/bin/pip install -q st3215==0.4.2
v/bin/python -c 'from st3215 import ST3215; assert "Unit: Step/s" in ST3215.SetSpeed.__doc__'
cat > speed.js <<'JS'
const assert = require("node:assert");
const { helpers, MODEL_CONTROL_TABLE, MODEL_RESOLUTION } = require("feetech-servo-ts");

assert(MODEL_CONTROL_TABLE.sts3215.Goal_Speed.address === 46 && MODEL_RESOLUTION.sts3215 === 4096);
const speed = helpers.rpmToSpeed(60);
const turns = (speed / MODEL_RESOLUTION.sts3215) * 60;
const limit = helpers.clampSpeed(4096);
const sign = 1 << 15;
const back = helpers.speedToRpm(sign | 100);
const below = helpers.positionToDegrees(sign | 10, "sts3215");
const quarter = helpers.positionToDegrees(1024, "sts3215");
console.log(`60 rpm: ${speed}, the servo turns at ${turns.toFixed(1)} rpm   limit ${limit}   speed -100: ${back.toFixed(0)} rpm   position -10: ${below.toFixed(0)} degrees, 1024: ${quarter}`);
assert(speed === 538 && limit === 1023 && Math.round(back) === 3663 && Math.round(below) === 2881 && quarter === 90);
JS
node speed.js
