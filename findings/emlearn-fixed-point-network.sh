#!/bin/sh
# emlearn 0.23.2, scikit-learn 1.9.1: convert(..., method="inline", use_fixedpoint=True) of an MLPClassifier always ends in a compiler error: the C code that
# it builds names a type of emlearn's fixed-point header, which the code does not include.
# Seen on 2026-11-28:  CompileError; the compiler reports: unknown type name 'eml_q16_t'
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q emlearn==0.23.2 scikit-learn==1.9.1
v/bin/python -W ignore - 2>compiler.txt <<'PY'
import emlearn, numpy as np
from sklearn.neural_network import MLPClassifier

x = np.random.default_rng(0).standard_normal((400, 4))
net = MLPClassifier(hidden_layer_sizes=(16,), max_iter=300, random_state=0).fit(x, x[:, 0] > 0)
emlearn.convert(net, method="inline")
try:
    emlearn.convert(net, method="inline", use_fixedpoint=True)
except Exception as error:
    print(type(error).__name__)
    assert type(error).__name__ == "CompileError"
else:
    raise SystemExit("it compiles now")
PY
grep -o "unknown type name .eml_q16_t." compiler.txt | head -n 1 || grep -q "unknown type name .*eml_q16_t" compiler.txt
