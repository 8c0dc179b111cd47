#!/bin/sh
# diffusers 0.42.1, torch 2.15.0: asked for as many inference steps as training steps, which is what a diffusion policy does by default, DPMSolverMultistep, UniPC, DEIS and SASolver give
# NaN, and PNDM another action; there is no error. Their timesteps are 101 places between 0 and 99, rounded, so that two are the same: a step of length 0. With one
# step less, and with DDPM, DDIM and Euler, the samples are right. The network is exact here: it knows that all actions are 0.5.
# Seen on 2026-11-29:  100 of 100: DPMSolverMultistep NaN, UniPC NaN, DEIS NaN, SASolver NaN, PNDM 1.26, DDPM DDIM Euler 0.50   99 of 100: all 0.50
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q diffusers==0.42.1 torch==2.15.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import math

import diffusers, torch

ACTION = 0.5


def mean(name, steps):
    """The mean of samples that a network which knows the action denoises."""
    scheduler = getattr(diffusers, name + "Scheduler")(num_train_timesteps=100, beta_schedule="squaredcos_cap_v2")
    scheduler.set_timesteps(steps)
    sample = torch.randn(1000, 1, generator=torch.Generator().manual_seed(0)) * float(scheduler.init_noise_sigma)
    for place, time in enumerate(scheduler.timesteps):
        seen = scheduler.scale_model_input(sample, time)
        if name == "EulerDiscrete":
            signal = 1 / (1 + scheduler.sigmas[place] ** 2)
        else:
            signal = scheduler.alphas_cumprod[int(time)]
        noise = (seen - signal.sqrt() * ACTION) / (1 - signal).sqrt()
        sample = scheduler.step(noise, time, sample).prev_sample
    return sample.mean().item()


right = ["DDPM", "DDIM", "EulerDiscrete"]
for name in ["DPMSolverMultistep", "UniPCMultistep", "DEISMultistep", "SASolver", "PNDM"] + right:
    torch.manual_seed(0)
    fewer, all_of_them = mean(name, 99), mean(name, 100)
    print(f"SEEN {name}: 99 steps {fewer:.2f}, 100 steps {all_of_them:.2f}")
    assert abs(fewer - ACTION) < 0.02
    if name in right:
        assert abs(all_of_them - ACTION) < 0.02
    else:
        assert all_of_them > 1 if name == "PNDM" else math.isnan(all_of_them)
PY
grep SEEN out.txt
