#!/bin/sh
# pytmcstepper 0.21.3, Mock.GPIO 0.2.0 (drivers of Trinamic's stepper chips), TMC5160 with the chip's ramp generator: set_motion_profile() takes a
# speed in micro-steps/s and an acceleration in micro-steps/s2 by its docstring and writes the numbers to the registers as they are. By the data
# sheet, at the clock of 12 MHz, VMAX counts in 0.715 micro-steps/s and AMAX in 65.5 micro-steps/s2: the motor runs at 72 % of the speed, and
# accelerates 65 times as fast as asked. VMAX is cut to 20 bits (the chip has 23): 1,100,000 micro-steps/s become 36,781. RampMode has
# VELOCITY_MODE_NEG = 1, which is the chip's mode for a positive speed, and HOLD_MODE = 2, which is its mode for a negative speed: who asks to hold
# starts the motor backward, and who asks for a negative speed drives it forward. There is no error.
# Seen on 2026-11-30:  asked for 10,000/s and 20,000/s2: 7,153/s and 1,309,672/s2   1,100,000/s: 36,781   modes by the chip: VELOCITY_MODE_NEG
# "velocity, positive", HOLD_MODE "velocity, negative"
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps pytmcstepper==0.21.3 Mock.GPIO==0.2.0
cat > run.py <<'PY'
from tmc_driver import Loglevel, Tmc5160, TmcEnableControlToff, TmcMotionControlIntRampGenerator
from tmc_driver.com._tmc_com_spi_base import TmcComSpiBase
from tmc_driver.motion_control._tmc_mc_int_ramp_generator import RampMode

CLOCK = 12e6
MODES = ["position", "velocity, positive", "velocity, negative", "hold"]  # RAMPMODE, data sheet
VMAX, AMAX, RAMPMODE = 0x27, 0x26, 0x20


class Chip(TmcComSpiBase):
    """The registers of the chip: a frame of 40 bits, whose answer holds what the frame before asked for."""

    def __init__(self):
        super().__init__()
        self.words, self.asked = {0x04: 0x30000000}, 0  # IOIN: the version

    def init(self):
        pass

    def deinit(self):
        pass

    def _spi_transfer(self, data):
        answer = [0, *self.words.get(self.asked, 0).to_bytes(4, "big")]
        if data[0] & 0x80:
            self.words[data[0] & 0x7F] = int.from_bytes(bytes(data[1:]), "big")
        self.asked = data[0] & 0x7F
        # GSTAT is cleared by writing ones.
        self.words[0x01] = 0
        return answer


chip = Chip()
ramp = TmcMotionControlIntRampGenerator()
motor = Tmc5160(TmcEnableControlToff(), ramp, chip, loglevel=Loglevel.NONE)


def profile(speed, acceleration):
    """The speed (1/s) and acceleration (1/s2) that the chip makes of the registers."""
    ramp.set_motion_profile(speed, acceleration, acceleration)
    # v = VMAX * clock / 2 / 2**23, a = AMAX * clock**2 / (512 * 256) / 2**24: section of the ramp generator.
    return chip.words[VMAX] * CLOCK / 2**24, chip.words[AMAX] * CLOCK**2 / (512 * 256) / 2**24


seen = {asked: profile(*asked) for asked in ((10_000, 20_000), (1_100_000, 1_000))}
for asked, got in seen.items():
    print(f"SEEN asked for {asked[0]}/s and {asked[1]}/s2: {got[0]:.0f}/s and {got[1]:.0f}/s2")
modes = {}
for name, mode in RampMode.__members__.items():
    ramp.set_ramp_mode(mode)
    modes[name] = MODES[chip.words[RAMPMODE]]
print("SEEN modes of the chip:", modes)
motor.tmc_ec = None
speed, acceleration = seen[10_000, 20_000]
assert round(speed) == 7153 and 65 < acceleration / 20_000 < 66 and round(seen[1_100_000, 1_000][0]) == 36_781
assert modes["VELOCITY_MODE_NEG"] == MODES[1] and modes["HOLD_MODE"] == MODES[2]
PY
v/bin/python run.py
