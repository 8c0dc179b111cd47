#!/bin/sh
# onnxslim 0.1.98, onnxsim 0.8.1, onnxoptimizer 0.4.2, with onnx 1.23.2 and onnxruntime 1.32.0: each takes two random nodes without a seed for the same
# expression and keeps one: two noises that were independent become equal, and their difference, which moved the output, becomes 0. onnxslim besides that makes
# a constant of a RandomNormal node, so a policy that samples its action gives the same action for an observation for ever.
# Seen on 2026-11-28:  no tool: independent, varies   onnxslim: equal, constant   onnxsim: equal, varies   onnxoptimizer: equal, varies
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnxslim==0.1.98 onnxsim==0.8.1 onnxoptimizer==0.4.2 onnx==1.23.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python - 2>/dev/null <<'PY'
import copy, numpy as np, onnx, onnxoptimizer, onnxruntime, onnxsim, onnxslim
from onnx import TensorProto, helper


def model(nodes):
    values = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, 4]) for name in ("mean", "action")]
    graph = helper.make_graph(nodes, "g", values[:1], values[1:])
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)
    onnx.checker.check_model(made, full_check=True)
    return made


two = model([
    helper.make_node("RandomNormalLike", ["mean"], ["n1"]),
    helper.make_node("RandomNormalLike", ["mean"], ["n2"]),
    helper.make_node("Sub", ["n1", "n2"], ["noise"]),
    helper.make_node("Add", ["mean", "noise"], ["action"]),
])
one = model([helper.make_node("RandomNormal", [], ["noise"], shape=[1, 4]), helper.make_node("Add", ["mean", "noise"], ["action"])])
tools = {
    "no tool": lambda m: m,
    "onnxslim": onnxslim.slim,
    "onnxsim": lambda m: onnxsim.simplify(m)[0],
    "onnxoptimizer": onnxoptimizer.optimize,
}


def actions(made):
    session = onnxruntime.InferenceSession(made.SerializeToString(), providers=["CPUExecutionProvider"])
    mean = np.ones((1, 4), dtype=np.float32)
    return np.array([session.run(None, {"mean": mean})[0] for _ in range(20)])


seen = {}
for name, tool in tools.items():
    equal = bool((actions(tool(copy.deepcopy(two))) == 1).all())
    constant = bool(np.ptp(actions(tool(copy.deepcopy(one))), axis=0).max() == 0)
    seen[name] = (equal, constant)
    print(f"{name}: {'equal' if equal else 'independent'}, {'constant' if constant else 'varies'}")
assert seen == {"no tool": (False, False), "onnxslim": (True, True), "onnxsim": (True, False), "onnxoptimizer": (True, False)}, seen
PY
