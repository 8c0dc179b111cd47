#!/bin/sh
# lerobot 0.6.1 (read from its wheel): the quantiles of a data set are the mean of its episodes' quantiles, not quantiles of its values. Where a joint is at another
# place in each episode, q01 and q99 are close together around the mean of all: of a joint that moves between -1 and 1 rad, 0.1 rad in each episode, q01 to q99
# span 0.10 rad, where the values span 1.92. Normalization by QUANTILES (PI05's default) then gives values up to 20, where it should give -1 to 1. Mean, deviation,
# minimum and maximum of the same function are those of all values.
# Seen on 2026-11-29:  q01 -0.05, q99 0.05, of all values -0.96 and 0.96   largest normalized value 20.5   mean, std, min, max: equal
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q numpy==2.4.6
v/bin/pip download -q --no-deps --only-binary=:all: --python-version 3.12 lerobot==0.6.1
v/bin/python - <<'PY'
import ast, glob, zipfile

import numpy as np

wheel = zipfile.ZipFile(glob.glob("lerobot-*.whl")[0])
# The file's functions and classes, without its imports of other parts.
tree = ast.parse(wheel.read("lerobot/datasets/compute_stats.py").decode())
tree.body = [node for node in tree.body if not (isinstance(node, ast.ImportFrom) and node.module != "__future__")]
lerobot = {}
exec(compile(tree, "compute_stats.py", "exec"), lerobot)
assert "2.0 * (tensor - q01) / denom - 1.0" in wheel.read("lerobot/processor/normalize_processor.py").decode()
random = np.random.default_rng(0)
episodes = [place + random.uniform(-0.05, 0.05, (200, 1)) for place in np.linspace(-0.95, 0.95, 39)]
stats = [lerobot["get_feature_stats"](episode, axis=0, keepdims=False) for episode in episodes]
merged, values = lerobot["aggregate_feature_stats"](stats), np.concatenate(episodes)
(low,), (high,) = merged["q01"], merged["q99"]
true_low, true_high = np.quantile(values, [0.01, 0.99])
largest = np.abs(2 * (values - low) / (high - low) - 1).max()
print(f"q01 {low:.2f}, q99 {high:.2f}; of all values {true_low:.2f} and {true_high:.2f}; largest normalized value {largest:.1f}")
for name, true in (("mean", values.mean()), ("std", values.std()), ("min", values.min()), ("max", values.max())):
    print(f"{name}: {merged[name][0]:.3f}, of all values {true:.3f}")
    assert abs(merged[name][0] - true) < 1e-6
assert abs(low + 0.05) < 0.005 and abs(high - 0.05) < 0.005 and true_low < -0.95 and true_high > 0.95 and largest > 15
PY
