#!/bin/sh
# keras 3.15.0, tensorflow-cpu 2.21.0, tf2onnx 1.17.0, onnx 1.23.2, onnxruntime 1.32.0: the ONNX file of a network with an adapted Normalization layer has three
# inputs, not one: the observation and the layer's two constants. The file does not hold the values of these (no initializer has the mean), so onnxruntime
# refuses to run it with the observation alone; and the second one is read by no node.
# Seen on 2026-11-28:  obs: read   Sub/y [1, 5]: read, no initializer   Sqrt/x [1, 5]: not read, no initializer   with obs alone: ValueError
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q keras==3.15.0 tensorflow-cpu==2.21.0 tf2onnx==1.17.0 onnx==1.23.2 onnxruntime==1.32.0
KERAS_BACKEND=tensorflow TF_CPP_MIN_LOG_LEVEL=3 CUDA_VISIBLE_DEVICES= v/bin/python -W ignore - 2>err.txt <<'PY' || { tail -n 20 err.txt; exit 1; }
import keras, numpy as np, onnx, onnxruntime
from onnx import numpy_helper

keras.utils.set_random_seed(0)
normalize = keras.layers.Normalization()
normalize.adapt(np.random.default_rng(0).normal(1, 2, (64, 5)).astype(np.float32))
model = keras.Sequential([keras.layers.Input((5,), name="obs"), normalize, keras.layers.Dense(3)])
obs = np.zeros((1, 5), dtype=np.float32)
expected = np.asarray(model(obs))
model.export("k.onnx", format="onnx", verbose=False)
graph = onnx.load("k.onnx").graph
read = {name for node in graph.node for name in node.input}
constants = {tensor.name: numpy_helper.to_array(tensor) for tensor in graph.initializer}
for value in graph.input:
    shape = [side.dim_value for side in value.type.tensor_type.shape.dim]
    kind = "initializer" if value.name in constants else "no initializer"
    print(f"{value.name} {shape}: {'read' if value.name in read else 'not read'}, {kind}")
names = [value.name for value in graph.input]
print("initializers:", {name: list(array.shape) for name, array in constants.items()})
assert len(names) == 3 and names[0] == "obs" and "Sub/y" in names[1] and "Sqrt/x" in names[2], names
assert names[1] in read and names[2] not in read and not set(names) & set(constants)
mean = np.asarray(normalize.mean).ravel()
assert not any(array.size == 5 and np.allclose(np.abs(array.ravel()), np.abs(mean)) for array in constants.values())
session = onnxruntime.InferenceSession("k.onnx", providers=["CPUExecutionProvider"])
try:
    session.run(None, {"obs": obs})
except ValueError as error:
    print("with obs alone:", type(error).__name__)
else:
    raise SystemExit("it runs with obs alone now")
given = {names[0]: obs, names[1]: np.asarray(normalize.mean).reshape(1, 5), names[2]: np.asarray(normalize.variance).reshape(1, 5)}
assert np.abs(session.run(None, {value.name: given[value.name] for value in session.get_inputs()})[0] - expected).max() < 1e-4
PY
