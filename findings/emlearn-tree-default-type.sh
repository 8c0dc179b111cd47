#!/bin/sh
# emlearn 0.23.2, scikit-learn 1.9.1: without dtype, a converted tree or forest makes whole numbers of the features: of observations between -1 and 1 nothing
# is left. A classifier is right for about half of what it was trained on, a regressor predicts one number for all. There is no error and no warning. With
# dtype="float" the regressor is scikit-learn's.
# Seen on 2026-11-28:  DecisionTreeClassifier: 0.53 right, scikit-learn 1.00   RandomForestClassifier: 0.53 right, scikit-learn 1.00
#                      DecisionTreeRegressor: 1 value for 400 observations, with float 400   RandomForestRegressor: 1, with float 400
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q emlearn==0.23.2 scikit-learn==1.9.1
v/bin/python -W error::UserWarning - <<'PY'
import emlearn, numpy as np
from sklearn.ensemble import RandomForestClassifier, RandomForestRegressor
from sklearn.tree import DecisionTreeClassifier, DecisionTreeRegressor

x = np.random.default_rng(0).uniform(-1, 1, (400, 4))
y = (x[:, 0] > 0).astype(int)
for tree in (DecisionTreeClassifier(random_state=0), RandomForestClassifier(10, random_state=0)):
    tree.fit(x, y)
    right, known = (np.mean(model.predict(x) == y) for model in (emlearn.convert(tree, method="inline"), tree))
    print(f"{type(tree).__name__}: {right:.2f} right, scikit-learn {known:.2f}")
    assert right < 0.6 and known > 0.95
for tree in (DecisionTreeRegressor(random_state=0), RandomForestRegressor(10, random_state=0)):
    tree.fit(x, 0.8 * x[:, 0])
    values, floats = (np.asarray(emlearn.convert(tree, method="inline", **kind).predict(x)) for kind in ({}, {"dtype": "float"}))
    print(f"{type(tree).__name__}: {len(set(values))} value for 400 observations, with float {len(set(floats))}")
    assert len(set(values)) == 1 and np.abs(floats - tree.predict(x)).max() < 1e-4
PY
