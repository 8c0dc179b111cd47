#!/bin/sh
# emx-onnx-cgen 1.4.0 (C of an ONNX file, for microcontrollers), onnx 1.23.2, onnxruntime 1.32.0, numpy 2.4.6: in the generated C, Relu, Clip, Max and Min turn NaN into a number, where onnxruntime hands it on, which the package compares
# itself with ("comparable to ONNX Runtime"). A policy with a relu layer, one of whose observations is NaN (a sensor that dropped out, 0 / 0), gives NaN actions in onnxruntime, which a driver's check refuses, and in C the last
# layer's biases, whatever the other observations are: finite actions that look right. A Clip to -1 and 1 at the end makes NaN -1, full speed backward. For numbers all results agree, so that the package's own
# verification, with random observations, sees nothing. There is no error.
# Seen on 2026-11-30:  observations with NaN: onnxruntime nan, nan, C 0.30, -0.20 (the biases), for 100 observations the same   Relu(nan): 0   Clip(nan, -1, 1): -1   Max(nan, 0), Min(nan, 0): 0   without NaN: largest difference 2e-6
# It needs a C compiler.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q emx-onnx-cgen==1.4.0 onnx==1.23.2 onnxruntime==1.32.0 numpy==2.4.6
cat > run.py <<'PY'
import ctypes
import re
import subprocess

import numpy as np
import onnxruntime
from onnx import TensorProto, checker, helper, numpy_helper, save

draw = np.random.default_rng(0)
size = {"x": 6, "h": 8, "y": 2}
constants = {
    "w1": draw.normal(size=(6, 8)), "b1": draw.normal(size=8), "w2": draw.normal(size=(8, 2)), "b2": np.array([0.3, -0.2]),
    "low": np.array(-1.0), "high": np.array(1.0), "zero": np.zeros(1),
}


def both(name, nodes, inputs, outputs, x):
    """The results for each row of x, of onnxruntime and of the generated C."""
    used = [key for node in nodes for key in node.input if key in constants]
    values = lambda names: [helper.make_tensor_value_info(key, TensorProto.FLOAT, [1, width]) for key, width in names]
    graph = helper.make_graph(nodes, name, values(inputs), values(outputs), [numpy_helper.from_array(constants[key].astype(np.float32), key) for key in dict.fromkeys(used)])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 20)], ir_version=10)
    checker.check_model(model, full_check=True)
    save(model, f"{name}.onnx")
    subprocess.run(["v/bin/emx-onnx-cgen", "compile", f"{name}.onnx", f"{name}.c"], check=True, capture_output=True)
    subprocess.run(["cc", "-O1", "-std=c99", "-shared", "-fPIC", f"{name}.c", "-o", f"./{name}.so", "-lm"], check=True)
    with open(f"{name}.c") as file:
        function = getattr(ctypes.CDLL(f"./{name}.so"), re.findall(r"^void (\w+)\(", file.read(), re.M)[-1])
    session = onnxruntime.InferenceSession(f"{name}.onnx", providers=["CPUExecutionProvider"])
    expected, given = [], []
    for row in x.astype(np.float32):
        row = np.ascontiguousarray(row[None])
        result = np.zeros((1, outputs[0][1]), np.float32)
        function(row.ctypes.data_as(ctypes.c_void_p), result.ctypes.data_as(ctypes.c_void_p))
        expected.append(session.run(None, {inputs[0][0]: row})[0][0])
        given.append(result[0])
    return np.array(expected), np.array(given)


node = helper.make_node
policy = [node("Gemm", ["x", "w1", "b1"], ["h"]), node("Relu", ["h"], ["r"]), node("Gemm", ["r", "w2", "b2"], ["y"])]
observations = draw.normal(size=(100, 6))
broken = observations.copy()
broken[:, 2] = np.nan
sound = both("sound", policy, [("x", 6)], [("y", 2)], observations)
expected, given = both("policy", policy, [("x", 6)], [("y", 2)], broken)
single = {
    name: both(name.lower(), [node(name, ["x", *more], ["y"])], [("x", 1)], [("y", 1)], np.array([[np.nan]]))
    for name, more in (("Relu", []), ("Clip", ["low", "high"]), ("Max", ["zero"]), ("Min", ["zero"]))
}
difference = np.abs(sound[0] - sound[1]).max()
print("SEEN without NaN:", f"{difference:.1e}", " with NaN: onnxruntime", expected[0], "C", given[0], "different rows:", len(np.unique(given, axis=0)))
print("SEEN", {name: (float(a[0, 0]), float(b[0, 0])) for name, (a, b) in single.items()})
assert difference < 1e-5 and np.isnan(expected).all()
assert np.allclose(given, [0.3, -0.2]) and all(np.isnan(a).all() for a, _ in single.values())
assert [float(b[0, 0]) for _, b in single.values()] == [0.0, -1.0, 0.0, 0.0]
PY
v/bin/python run.py 2>err.txt || { tail -n 20 err.txt; exit 1; }
