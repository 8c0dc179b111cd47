#!/bin/sh
# node-pid-controller 1.0.1 (npm): without a stated dt, the controller counts a whole second for its first update and for each one that comes in the same millisecond as the one before. At 1 kHz and above this happens all the
# time: in a loop of 2 kHz, every second update adds a second of error to the integral, which is 1,000 times too large after 1 s, and the derivative is one 2,000th. At 100 Hz the first update alone adds a second: an
# integral that needs 1 s to build up is there at once. There is no error. With the option dt the numbers are right.
# Seen on 2026-11-29:  error 1 for 1 s, integral: 2 kHz 1002.0   100 Hz 2.0   2 kHz with dt 1.0   100 Hz with dt 1.0
# It needs node and npm.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
npm install --silent --no-audit --no-fund node-pid-controller@1.0.1 >/dev/null
cat > pid.js <<'JS'
const assert = require("node:assert");
const Controller = require("node-pid-controller");

// The integral of an error of 1 after 1 s of a loop, by a clock that is as exact as the loop.
function integral(rate, options) {
  const pid = new Controller({ k_p: 0, k_i: 1, k_d: 0, ...options });
  pid.setTarget(1);
  let output;
  for (let step = 0; step < rate; step++) {
    Date.now = () => 1_000_000 + Math.floor((step * 1000) / rate);
    output = pid.update(0);
  }
  return output;
}

const seen = [integral(2000, {}), integral(100, {}), integral(2000, { dt: 1 / 2000 }), integral(100, { dt: 1 / 100 })];
console.log(`2 kHz ${seen[0].toFixed(1)}   100 Hz ${seen[1].toFixed(1)}   2 kHz with dt ${seen[2].toFixed(1)}   100 Hz with dt ${seen[3].toFixed(1)}`);
assert(seen[0] > 900 && Math.abs(seen[1] - 2) < 0.05 && Math.abs(seen[2] - 1) < 0.01 && Math.abs(seen[3] - 1) < 0.01);
JS
node pid.js
