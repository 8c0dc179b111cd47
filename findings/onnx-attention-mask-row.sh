#!/bin/sh
# onnx 1.23.2, onnxruntime 1.32.0: a mask of one row, which says for all queries which keys are padding, gives three results with the operator Attention and is_causal = 1. onnx's
# reference evaluator lets every query see the first key only: it makes the causal mask as small as the mask. onnx's own definition of the operator by others (what tools that do not
# have it expand it to) is causal. onnxruntime refuses the file with operator sets 23 and 24, also without is_causal, although the mask "must be broadcastable", and with 25 runs it.
# With a mask that has a row for each query, all of them agree.
# Seen on 2026-11-29:  values 1, 2, 6, equal scores: reference 1 1 1   its definition 1 1.5 3   onnxruntime with set 23 or 24 refused, with set 25 1 1.5 3   mask 3 x 3: 1 1.5 3
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnx==1.23.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import numpy as np, onnxruntime
from onnx import TensorProto, checker, helper, inliner
from onnx.reference import ReferenceEvaluator

onnxruntime.set_default_logger_severity(4)
tokens = {name: np.zeros((1, 1, 3, 1), np.float32) for name in "qk"} | {"v": np.array([1, 2, 6], np.float32).reshape(1, 1, 3, 1)}


def ort(model, given):
    try:
        return onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"]).run(None, given)[0]
    except onnxruntime.capi.onnxruntime_pybind11_state.Fail as error:
        assert "inconsistent q_sequence_length" in str(error)
        return np.array([])


def attend(operator_set, mask, causal):
    given = tokens | {"mask": np.ones(mask, bool)}
    kinds = {name: TensorProto.BOOL if name == "mask" else TensorProto.FLOAT for name in given}
    inputs = [helper.make_tensor_value_info(name, kinds[name], value.shape) for name, value in given.items()]
    node = helper.make_node("Attention", list(given), ["y"], is_causal=causal)
    graph = helper.make_graph([node], "g", inputs, [helper.make_tensor_value_info("y", TensorProto.FLOAT, [1, 1, 3, 1])])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", operator_set)], ir_version=10)
    checker.check_model(model, full_check=True)
    expanded = inliner.inline_selected_functions(model, [("", "Attention")], inline_schema_functions=True)
    assert "Attention" not in {node.op_type for node in expanded.graph.node}
    found = [ReferenceEvaluator(model).run(None, given)[0], ReferenceEvaluator(expanded).run(None, given)[0], ort(expanded, given), ort(model, given)]
    found = [value.ravel().round(4).tolist() for value in found]
    print(f"set {operator_set}, mask {mask}, is_causal {causal}: reference {found[0]}, definition {found[1]} {found[2]}, onnxruntime {found[3] or 'refused'}")
    return found


full, first, causal = [3, 3, 3], [1, 1, 1], [1, 1.5, 3]
for operator_set, runs in ((23, False), (24, False), (25, True)):
    for mask in ((1, 3), (1, 1, 1, 3)):
        assert attend(operator_set, mask, 0) == [full, full, full, full if runs else []]
        assert attend(operator_set, mask, 1) == [first, causal, causal, causal if runs else []]
    assert attend(operator_set, (3, 3), 1) == [causal] * 4
PY
