#!/bin/sh
# MNN 3.6.1, onnxruntime 1.32.0, onnx 1.23.2: operators of an ONNX file that MNN converts without an error and computes otherwise. Round takes halves away from zero, not to even. Softplus ends at 87
# (and is 0 below -20). Cast to BOOL truncates, so that 0.3 is false and 2 stays 2. Mod with fmod = 1 has the divisor's sign. Codes that a
# network rounds by itself, masks that it casts and deviations that it makes positive by Softplus are affected.
# Seen on 2026-11-29:  Round of -2.5 0.5 2.5: -2 0 2, MNN -3 1 3   Softplus of 100: 100, MNN 87   Cast to BOOL of -0.5 0.3 2: 1 1 1, MNN 0 0 2   Mod of -2 by 1.5: -0.5, MNN 1
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q mnn==3.6.1 onnx==1.23.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import _tools, MNN.expr, MNN.nn  # _tools is what the command mnnconvert calls
import numpy as np, onnx, onnxruntime
from onnx import TensorProto, helper, numpy_helper


def results(nodes, x, constant=None):
    x = np.array(x, np.float32)
    tensors = [] if constant is None else [numpy_helper.from_array(constant, "c")]
    value = lambda name, shape: helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
    model = helper.make_model(helper.make_graph(nodes, "one", [value("x", x.shape)], [value("y", None)], tensors), opset_imports=[helper.make_opsetid("", 21)], ir_version=10)
    expected = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"]).run(None, {"x": x})[0]
    model.graph.output[0].CopyFrom(value("y", expected.shape))
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, "one.onnx")
    _tools.mnnconvert(["mnnconvert", "-f", "ONNX", "--modelFile", "one.onnx", "--MNNModel", "one.mnn", "--bizCode", "x"])
    network = MNN.nn.load_module_from_file("one.mnn", ["x"], ["y"])
    found = network.forward([MNN.expr.const(x, list(x.shape), MNN.expr.NCHW, MNN.expr.float)])[0]
    return expected.ravel(), np.array(found.read()).ravel()


node = helper.make_node
truth = [node("Cast", ["x"], ["b"], to=TensorProto.BOOL), node("Cast", ["b"], ["y"], to=TensorProto.FLOAT)]
cases = {
    "Round": (([node("Round", ["x"], ["y"])], [[-2.5, 0.5, 2.5]]), [-3, 1, 3]),
    "Softplus": (([node("Softplus", ["x"], ["y"])], [[50, 100, 1000]]), [50, 87, 87]),
    "Cast to BOOL": ((truth, [[-0.5, 0.3, 2]]), [0, 0, 2]),
    "Mod": (([node("Mod", ["x", "c"], ["y"], fmod=1)], [[-2, -1, 2]], np.array([1.5], np.float32)), [1, 0.5, 0.5]),
}
for name, (given, wrong) in cases.items():
    expected, found = results(*given)
    print("SEEN", name, "right", expected.round(3), "MNN", found.round(3))
    assert np.abs(expected - wrong).max() > 0.05 and np.abs(found - wrong).max() < 1e-3
PY
grep SEEN out.txt
