#!/bin/sh
# micromlgen 1.1.28, scikit-learn 1.9.1: the C++ of two classifiers predicts other classes than the classifier, with no error. A LogisticRegression of two classes predicts the wrong one of them each time: scikit-learn keeps one
# row of weights, the score of class 1, and the C++ takes it for the score of class 0, beside 0 for class 1. With three classes it is right. A RandomForestClassifier with a limited depth, as a microcontroller needs it, is another classifier: the
# trees vote for one class each, where scikit-learn adds their probabilities: 5 % of 500 unseen observations get another class with 10 trees of depth 4, none with trees of full depth. Single trees are right.
# Seen on 2026-11-30:  agreement with scikit-learn: logistic, 2 classes: 0.00   3 classes: 1.00   forest, depth 4: 0.95   full depth: 1.00   tree: 1.00
# It needs a C++ compiler.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q micromlgen==1.1.28 scikit-learn==1.9.1 numpy==2.4.6
cat > main.cpp <<'CPP'
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <cmath>
using namespace std;
#include "model.h"

int main() {
    float x[6];
    Eloquent::ML::Port::Model model;
    while (fread(x, sizeof x, 1, stdin) == 1)
        printf("%d\n", model.predict(x));
}
CPP
v/bin/python -W ignore - <<'PY'
import subprocess
from pathlib import Path
import numpy as np
from micromlgen import port
from sklearn.ensemble import RandomForestClassifier
from sklearn.linear_model import LogisticRegression
from sklearn.tree import DecisionTreeClassifier

random = np.random.default_rng(0)
x, unseen = random.standard_normal((600, 6)).astype(np.float32), random.standard_normal((500, 6)).astype(np.float32)
score = x[:, 0] + 0.5 * x[:, 1] * x[:, 2] + 0.5 * random.standard_normal(600)
three = (score > 0.3) * 1 + (score < -0.5) * 2
two = (score > 0) * 1


def compiled(model, classes):
    model.fit(x, classes)
    Path("model.h").write_text(port(model, classname="Model"))
    subprocess.check_call(["c++", "-w", "-o", "model", "main.cpp"])
    out = subprocess.run(["./model"], input=unseen.tobytes(), capture_output=True, check=True).stdout
    return np.array(out.split(), int), model.predict(unseen)


agreements = {}
for name, model, classes in (
    ("logistic, 2 classes", LogisticRegression(), two),
    ("logistic, 3 classes", LogisticRegression(), three),
    ("forest, depth 4", RandomForestClassifier(10, max_depth=4, random_state=0), three),
    ("forest, full depth", RandomForestClassifier(10, random_state=0), three),
    ("tree, depth 4", DecisionTreeClassifier(max_depth=4, random_state=0), three),
):
    ours, theirs = compiled(model, classes)
    agreements[name] = np.mean(ours == theirs)
    print(f"SEEN {name}: agreement {agreements[name]:.3f}, classes {np.bincount(ours, minlength=3).tolist()}, scikit-learn {np.bincount(theirs, minlength=3).tolist()}")
    if name == "logistic, 2 classes":
        assert np.array_equal(ours, 1 - theirs)
assert 0.85 < agreements.pop("forest, depth 4") < 0.99
assert agreements.pop("logistic, 2 classes") == 0.0
assert all(agreement == 1.0 for agreement in agreements.values())
PY
