#!/bin/sh
# onnxruntime 1.32.0, onnx 1.23.2, ml_dtypes 0.6.0: Cast of floating-point numbers to INT4, UINT4, INT2 and UINT2 rounds in onnxruntime, halves away from zero, and its Cast to INT8 truncates.
# onnx's reference evaluator and ml_dtypes truncate for all of these. A rounded value that the type does not have wraps: 7.5 is -8 in INT4, where 7 is meant, and 1.5 is -2 in INT2. A
# network that quantizes with Mul, Clip and Cast has other codes in the runtime than in the reference, with 4 and 2 bits only. QuantizeLinear agrees in both.
# Seen on 2026-11-29:  INT4 of -2.5, 0.75, 7.5: onnxruntime -3 1 -8, others -2 0 7   INT2 of 0.75, 1.5: onnxruntime 1 -2, others 0 1   INT8: all the same
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnx==1.23.2 onnxruntime==1.32.0 ml_dtypes==0.6.0 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import ml_dtypes, numpy as np, onnxruntime
from onnx import TensorProto, checker, helper
from onnx.reference import ReferenceEvaluator

onnxruntime.set_default_logger_severity(3)
FLOAT = TensorProto.FLOAT


def cast(kind, values, quantize=False):
    x = np.array(values, np.float32)
    to = getattr(TensorProto, kind.upper())
    first = helper.make_node("QuantizeLinear", ["x", "one"], ["q"], output_dtype=to) if quantize else helper.make_node("Cast", ["x"], ["q"], to=to)
    info = [helper.make_tensor_value_info(name, FLOAT, x.shape) for name in "xy"]
    graph = helper.make_graph([first, helper.make_node("Cast", ["q"], ["y"], to=FLOAT)], "g", info[:1], info[1:], [helper.make_tensor("one", FLOAT, [], [1])])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 25)], ir_version=12)
    checker.check_model(model, full_check=True)
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    found = [run(None, {"x": x})[0].tolist() for run in (session.run, ReferenceEvaluator(model).run)]
    found.append(x.astype(getattr(ml_dtypes, kind, kind)).astype(np.float32).tolist())
    print(f"{'QuantizeLinear' if quantize else 'Cast'} to {kind} of {values}: onnxruntime {found[0]}, reference {found[1]}, ml_dtypes {found[2]}")
    return found


assert cast("int4", [-2.5, 0.75, 6.5, 7.5]) == [[-3, 1, 7, -8], [-2, 0, 6, 7], [-2, 0, 6, 7]]
assert cast("uint4", [0.75, 14.5, 15.5]) == [[1, 15, 0], [0, 14, 15], [0, 14, 15]]
assert cast("int2", [-0.5, 0.75, 1.5]) == [[-1, 1, -2], [0, 0, 1], [0, 0, 1]]
assert cast("uint2", [0.75, 2.5, 3.5]) == [[1, 3, 0], [0, 2, 3], [0, 2, 3]]
assert cast("int8", [-2.5, 0.75, 7.5, 126.5]) == [[-2, 0, 7, 126]] * 3
assert cast("int4", [-2.5, 0.75, 6.5, 7.5], quantize=True)[:2] == [[-2, 1, 6, 7]] * 2
PY
