#!/bin/sh
# MNN 3.6.1, onnxruntime 1.32.0, onnx 1.23.2: from operator set 18 on, ReduceL1, ReduceL2, ReduceSumSquare and ReduceLogSumExp of an ONNX file take their axes as an input. MNN does not read it
# for these four, and reduces over everything: the norm of each row becomes one norm, which broadcasts where it divides. There is no error. ReduceSum, ReduceMean and ReduceMax of the
# same set are right, and with set 17, where axes are an attribute, all are. GroupNormalization of set 21, which has a scale for each channel, is also computed otherwise.
# Seen on 2026-11-29:  rows 3 4 and 6 8 divided by their ReduceL2, set 18: 0.6 0.8 and 0.6 0.8, MNN 0.27 0.36 and 0.54 0.72; set 17: the same   ReduceSum: the same
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q mnn==3.6.1 onnx==1.23.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import _tools, MNN.expr, MNN.nn  # _tools is what the command mnnconvert calls
import numpy as np, onnx, onnxruntime
from onnx import TensorProto, helper, numpy_helper

x = np.array([[3, 4], [6, 8]], np.float32)


def results(nodes, constants, operator_set, x):
    value = lambda name: helper.make_tensor_value_info(name, TensorProto.FLOAT, x.shape)
    tensors = [numpy_helper.from_array(np.asarray(array), name) for name, array in constants.items()]
    graph = helper.make_graph(nodes, "norm", [value("x")], [value("y")], tensors)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", operator_set)], ir_version=8)
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, "norm.onnx")
    expected = onnxruntime.InferenceSession("norm.onnx", providers=["CPUExecutionProvider"]).run(None, {"x": x})[0]
    _tools.mnnconvert(["mnnconvert", "-f", "ONNX", "--modelFile", "norm.onnx", "--MNNModel", "norm.mnn", "--bizCode", "x"])
    network = MNN.nn.load_module_from_file("norm.mnn", ["x"], ["y"])
    found = network.forward([MNN.expr.const(x, list(x.shape), MNN.expr.NCHW, MNN.expr.float)])[0]
    return expected, np.array(found.read()).reshape(x.shape)


for operator in ("ReduceL1", "ReduceL2", "ReduceSumSquare", "ReduceLogSumExp", "ReduceSum", "ReduceMean", "ReduceMax"):
    for operator_set in (17, 18):
        constants, inputs, attributes = {}, ["x"], {"keepdims": 1}
        if operator_set == 18 or operator == "ReduceSum":
            constants, inputs = {"axes": np.array([1], np.int64)}, ["x", "axes"]
        else:
            attributes["axes"] = [1]
        nodes = [helper.make_node(operator, inputs, ["n"], **attributes), helper.make_node("Div", ["x", "n"], ["y"])]
        expected, found = results(nodes, constants, operator_set, x)
        same = np.abs(expected - found).max() < 1e-4
        print("SEEN", operator, operator_set, "same" if same else f"{expected.round(2).tolist()} MNN {found.round(2).tolist()}")
        assert same == (operator_set == 17 or operator in ("ReduceSum", "ReduceMean", "ReduceMax"))

x = np.arange(8, dtype=np.float32).reshape(1, 4, 2)
node = helper.make_node("GroupNormalization", ["x", "s", "b"], ["y"], num_groups=2, epsilon=1e-5)
expected, found = results([node], {"s": np.array([1, 2, 3, 4], np.float32), "b": np.zeros(4, np.float32)}, 21, x)
print("SEEN GroupNormalization", expected.round(2).tolist(), "MNN", found.round(2).tolist())
assert np.abs(expected - found).max() > 0.5
PY
grep SEEN out.txt
