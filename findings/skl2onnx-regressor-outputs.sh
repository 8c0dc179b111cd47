#!/bin/sh
# skl2onnx 1.20.0, scikit-learn 1.9.1, onnxruntime 1.32.0, onnx 1.23.2: the ONNX file of an MLPRegressor with three outputs gives an action as a column of three rows, and declares one output: [1, 3] becomes [3, 1], four
# observations give [12, 1]. There is no error. A reader that takes the first row, or the first number of each, has one action of three, and one that takes the declared size believes in a policy with one action.
# In a pipeline it is the same. LinearRegression and MultiOutputRegressor around the same network give [1, 3], as does a DecisionTreeRegressor, which declares [None, 1]. The numbers are right.
# Seen on 2026-11-29:  MLPRegressor, 1 and 4 observations: [3, 1], [12, 1], declared [None, 1]   LinearRegression, MultiOutputRegressor: [1, 3], [4, 3], declared [None, 3]   DecisionTreeRegressor: [1, 3], declared [None, 1]
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q skl2onnx==1.20.0 scikit-learn==1.9.1 onnxruntime==1.32.0 onnx==1.23.2 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import numpy as np, onnxruntime
from skl2onnx import to_onnx
from sklearn.linear_model import LinearRegression
from sklearn.multioutput import MultiOutputRegressor
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.tree import DecisionTreeRegressor

x = np.random.default_rng(0).standard_normal((300, 6)).astype(np.float32)
y = np.stack([x[:, 0], x[:, 1], x[:, 0] * x[:, 2]], axis=1)
network = lambda: MLPRegressor(hidden_layer_sizes=(8,), max_iter=50, random_state=0)
regressors = {
    "MLPRegressor": network(),
    "in a pipeline": make_pipeline(StandardScaler(), network()),
    "MultiOutputRegressor": MultiOutputRegressor(network()),
    "LinearRegression": LinearRegression(),
    "DecisionTreeRegressor": DecisionTreeRegressor(max_depth=4),
}
for name, regressor in regressors.items():
    regressor.fit(x, y)
    session = onnxruntime.InferenceSession(to_onnx(regressor, x[:1]).SerializeToString(), providers=["CPUExecutionProvider"])
    one, four = (session.run(None, {session.get_inputs()[0].name: x[:count]})[0] for count in (1, 4))
    declared = session.get_outputs()[0].shape[1]
    print(f"SEEN {name}: {list(one.shape)}, {list(four.shape)}, declared [None, {declared}]")
    column = name in ("MLPRegressor", "in a pipeline")
    assert (one.shape, four.shape) == (((3, 1), (12, 1)) if column else ((1, 3), (4, 3)))
    assert declared == (1 if column or name == "DecisionTreeRegressor" else 3)
    assert np.allclose(four.ravel(), regressor.predict(x[:4]).ravel(), atol=1e-4)
PY
grep SEEN out.txt
