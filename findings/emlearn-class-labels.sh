#!/bin/sh
# emlearn 0.23.2, scikit-learn 1.9.1: predict() of a converted MLPClassifier or GaussianNB gives the index of the class, not its label: with the labels 5, 6, 7
# it predicts 0, 1, 2, and with names it predicts numbers. The C code that it saves does not hold the names either.
# Seen on 2026-11-28:  MLPClassifier, labels 5 6 7: 0 1 2   labels left right straight: 0 1 2   GaussianNB, labels 5 6 7: 0 1 2   the same names: 0 1 2
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q emlearn==0.23.2 scikit-learn==1.9.1
v/bin/python -W ignore - <<'PY'
import emlearn, numpy as np
from sklearn.naive_bayes import GaussianNB
from sklearn.neural_network import MLPClassifier

x = np.random.default_rng(0).uniform(-1, 1, (600, 4))
index = (x[:, 0] > 0).astype(int) + (x[:, 1] > 0)
for net in (MLPClassifier((16,), max_iter=600, random_state=0), GaussianNB()):
    for labels in (np.array([5, 6, 7]), np.array(["left", "right", "straight"])):
        net.fit(x, labels[index])
        model = emlearn.convert(net, method="loadable")
        got = np.asarray(model.predict(x))
        model.save(file="net.h", name="net")
        print(f"{type(net).__name__}, labels", *labels, ":", *sorted(set(got.tolist())))
        assert set(net.predict(x)) == set(labels) and set(got.tolist()) == {0, 1, 2}
        assert np.mean(labels[got] == net.predict(x)) > 0.8 and (labels.dtype.kind == "i" or "straight" not in open("net.h").read())
PY
