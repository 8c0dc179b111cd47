#!/bin/sh
# emlearn 0.23.2, scikit-learn 1.9.1: a converted MLPRegressor with three outputs predicts one number for each observation, and that number is NaN.
# There is no error. With one output the predictions are scikit-learn's.
# Seen on 2026-11-28:  3 outputs: shape (5,), all NaN   1 output: largest difference below 1e-4
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q emlearn==0.23.2 scikit-learn==1.9.1
v/bin/python -W ignore - <<'PY'
import emlearn, numpy as np
from sklearn.neural_network import MLPRegressor

x = np.random.default_rng(0).standard_normal((400, 4))
y = x @ [[1, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, -1]]
for target in (y, y[:, 0]):
    net = MLPRegressor(hidden_layer_sizes=(16,), activation="tanh", max_iter=300, random_state=0).fit(x, target)
    got = np.asarray(emlearn.convert(net, method="loadable", return_type="regressor").predict(x[:5]))
    outputs = target.shape[1] if target.ndim == 2 else 1
    if outputs == 3:
        print("3 outputs:", got.shape, "all NaN" if np.isnan(got).all() else got)
        assert got.shape == (5,) and np.isnan(got).all()
    else:
        largest = np.abs(got - net.predict(x[:5])).max()
        print(f"1 output: largest difference {largest:.1e}")
        assert largest < 1e-4
PY
