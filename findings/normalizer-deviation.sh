#!/bin/sh
# stable-baselines3 2.9.2, skrl 2.1.1, rl-games 1.6.5, rsl-rl-lib 5.5.1, torch 2.15.0: the observation normalizers of four libraries disagree about one
# observation after the same data: 51,200 values with a standard deviation of 0.01 (a joint velocity in units of 100 rad/s, or a gyro at rest). At a distance of
# one standard deviation, Stable-Baselines3 gives 1.00 and rsl_rl 0.50, as it adds 0.01 to the deviation; skrl and rl_games are between, because their initial
# variance of 1 counts as a value of the data for ever. At 40 deviations, the limits show: 10, 5, 5 and none. So a mean and a deviation do not describe a normalizer.
# Seen on 2026-11-29:  1 deviation: stable-baselines3 1.00, skrl 0.91, rl_games 0.87, rsl_rl 0.50   40 deviations: 10.0, 5.0, 5.0, 20.0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q stable-baselines3==2.9.2 skrl==2.1.1 rl-games==1.6.5 rsl-rl-lib==5.5.1 torch==2.15.0
v/bin/python -W ignore - 2>err.txt <<'PY' || { tail -n 20 err.txt; exit 1; }
import numpy as np, torch
from rl_games.algos_torch.running_mean_std import RunningMeanStd as RlGames
from rsl_rl.modules import EmpiricalNormalization
from skrl.resources.preprocessors.torch import RunningStandardScaler
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

batches = (np.random.default_rng(0).normal(size=(200, 256, 1)) * 0.01 + 0.3).astype(np.float32)
sb3, skrl, rl_games, rsl_rl = RunningMeanStd(shape=(1,)), RunningStandardScaler(size=1, device="cpu"), RlGames((1,)), EmpiricalNormalization(1)
for batch in batches:
    sb3.update(batch)
    skrl(torch.from_numpy(batch), train=True)
    rl_games.train()(torch.from_numpy(batch))
    rsl_rl.train().update(torch.from_numpy(batch))
limits = VecNormalize.__init__.__defaults__
assert limits[3] == 10.0 and limits[6] == 1e-8, limits
rl_games.eval(), rsl_rl.eval()
normalizers = {
    "stable-baselines3": lambda x: np.clip((x.numpy() - sb3.mean) / np.sqrt(sb3.var + 1e-8), -10, 10), "skrl": skrl, "rl_games": rl_games, "rsl_rl": rsl_rl,
}
seen = {}
with torch.no_grad():
    for name, normalize in normalizers.items():
        seen[name] = [float(normalize(torch.tensor([[0.3 + 0.01 * deviations]]))[0, 0]) for deviations in (1, 40)]
        print(f"{name}: {seen[name][0]:.2f} at one deviation, {seen[name][1]:.1f} at 40")
one = [values[0] for values in seen.values()]
assert np.allclose(one, [1.0, 0.906, 0.872, 0.4995], atol=0.01), one
assert [round(values[1], 1) for values in seen.values()] == [10.0, 5.0, 5.0, 20.0]
PY
