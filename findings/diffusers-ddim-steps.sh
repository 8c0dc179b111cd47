#!/bin/sh
# diffusers 0.42.1, torch 2.15.0: DDIM of a policy trained with 100 steps gives worse actions with 51 to 75 steps than with 50 or 10, in each of its three timestep_spacings; there is no
# error and no warning. "leading", the default, takes every (100 // steps)th time from 0: 51 steps begin at 50, as pure noise, where the network expects to see half of the action. "trailing"
# and "linspace" go down from 99 by 100 / steps, but each step removes the noise of 100 // steps: with 51 steps, the noise of one time of two. 34 steps have the same fault, by less. DDPM of
# these two spacings asks for the next time and is right. LeRobot's configuration, which names both schedulers, has no number of steps by default and calls them "evenly spaced".
# Seen on 2026-11-29:  actions 0.5 +- 0.1, best network, DDIM: 10 steps 0.495 +- 0.064   50 steps 0.498 +- 0.089   51 steps: leading 0.454 +- 0.128, trailing 0.407 +- 0.300,
#                      linspace 0.407 +- 0.292   34 steps trailing 0.458 +- 0.198   DDPM 51 steps trailing 0.500 +- 0.080
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q diffusers==0.42.1 torch==2.15.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import diffusers, torch

MEAN, DEVIATION = 0.5, 0.1


def samples(name, steps, spacing):
    """First time, mean and deviation of samples, with the network that is best for normally distributed actions."""
    scheduler = getattr(diffusers, name + "Scheduler")(num_train_timesteps=100, beta_schedule="squaredcos_cap_v2", timestep_spacing=spacing)
    scheduler.set_timesteps(steps)
    generator = torch.Generator().manual_seed(0)
    sample = torch.randn(20000, 1, generator=generator)
    for time in scheduler.timesteps:
        signal = scheduler.alphas_cumprod[int(time)].double()
        gain = signal.sqrt() * DEVIATION**2 / (signal * DEVIATION**2 + 1 - signal)
        action = MEAN + gain * (sample.double() - signal.sqrt() * MEAN)
        noise = (sample - signal.sqrt() * action) / (1 - signal).sqrt()
        sample = scheduler.step(noise.float(), time, sample, generator=generator).prev_sample
    found = int(scheduler.timesteps[0]), sample.mean().item(), sample.std().item()
    print(f"SEEN {name} {steps} steps {spacing}: from {found[0]}, {found[1]:.3f} +- {found[2]:.3f}")
    return found


worse = []
for spacing in ("leading", "trailing", "linspace"):
    for steps in (10, 50, 100):
        _, mean, deviation = samples("DDIM", steps, spacing)
        assert abs(mean - MEAN) < 0.01 and deviation < 0.1
    worse.append(samples("DDIM", 51, spacing))
assert [begin for begin, *_ in worse] == [50, 99, 99]
assert abs(worse[0][1] - MEAN) > 0.04 and worse[0][2] > 0.12
assert all(abs(mean - MEAN) > 0.08 and deviation > 0.28 for _, mean, deviation in worse[1:])
assert samples("DDIM", 34, "trailing")[2] > 0.18
_, mean, deviation = samples("DDPM", 51, "trailing")
assert abs(mean - MEAN) < 0.005 and deviation < 0.1
PY
grep SEEN out.txt
