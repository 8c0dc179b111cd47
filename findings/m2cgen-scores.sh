#!/bin/sh
# m2cgen 0.10.0, scikit-learn 1.9.1: the C of two models is valid and not what its user takes it for. A DecisionTreeRegressor with two outputs becomes a function of one number, the first output; a RandomForestRegressor is the same.
# The scores of an SVC with three classes are those of its pairs of classes (one against one), not those of scikit-learn's decision_function: the greatest of the three numbers names the class of 30 % of 500 observations, and
# that of decision_function names it for 99.6 %. There is no error and no warning. A LinearRegression gives both outputs, and an SVC of two classes is decision_function's.
# Seen on 2026-11-30:  tree [1.08, 3.17]: 1.08   SVC, greatest score is the class: C 0.304, decision_function 0.996
# It needs a C compiler.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q m2cgen==0.10.0 scikit-learn==1.9.1 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import ctypes, subprocess
from pathlib import Path
import m2cgen
import numpy as np
from sklearn.ensemble import RandomForestRegressor
from sklearn.linear_model import LinearRegression
from sklearn.svm import SVC
from sklearn.tree import DecisionTreeRegressor

random = np.random.default_rng(0)
x = random.standard_normal((600, 6)).astype(np.float32)
score = x[:, 0] + 0.5 * x[:, 1] * x[:, 2] + 0.5 * random.standard_normal(600)
classes = (score > 0.3) * 1 + (score < -0.5) * 2
actions = np.stack([score, 2 * score + 1], axis=1)
unseen = random.standard_normal((500, 6)).astype(np.float32)


def compiled(model, name):
    """The C function's numbers for the unseen observations: one each, or as many as its signature has."""
    source = m2cgen.export_to_c(model)
    Path(f"{name}.c").write_text(source)
    subprocess.check_call(["cc", "-w", "-shared", "-fPIC", "-o", f"{name}.so", f"{name}.c", "-lm"])
    function = ctypes.CDLL(f"./{name}.so").score
    one = "double score(double * input)" in source
    function.restype = ctypes.c_double if one else None
    rows = []
    for row in unseen.astype(float):
        output = (ctypes.c_double * 3)()
        returned = function((ctypes.c_double * 6)(*row), *(() if one else (output,)))
        rows.append([returned] if one else list(output))
    return np.array(rows)


for name, model in (("tree", DecisionTreeRegressor(max_depth=4)), ("forest", RandomForestRegressor(5, max_depth=4, random_state=0))):
    numbers, expected = compiled(model.fit(x, actions), name), model.predict(unseen)
    print(f"SEEN {name}: {numbers[0].round(2).tolist()} for {expected[0].round(2).tolist()}")
    assert numbers.shape == (500, 1) and np.allclose(numbers[:, 0], expected[:, 0])
linear = LinearRegression().fit(x, actions)
assert np.allclose(compiled(linear, "linear")[:, :2], linear.predict(unseen), atol=1e-5)

support = SVC(gamma=0.1).fit(x, classes)
scores, right = compiled(support, "support"), support.predict(unseen)
agreement, theirs = (scores.argmax(axis=1) == right).mean(), (support.decision_function(unseen).argmax(axis=1) == right).mean()
print(f"SEEN SVC: the greatest score is the class: C {agreement:.3f}, decision_function {theirs:.3f}")
assert agreement < 0.5 and theirs > 0.99
pairs = SVC(gamma=0.1, decision_function_shape="ovo").fit(x, classes)
assert np.allclose(scores, pairs.decision_function(unseen))
PY
