#!/bin/sh
# tinygrad 0.14.0, onnxruntime 1.32.0, onnx 1.23.2: tinygrad's OnnxRunner gives other numbers for an ONNX file's Attention, without an error. Of grouped heads it hands the keys and values out
# in turn (heads 0 and 2 have the first ones, 1 and 3 the second ones), where neighbors share them. With is_causal and a cache, a new token looks back from the cache's beginning: it sees the
# first cached key only. softcap is applied after the mask, and so limits -inf: a key that is masked counts. Equal heads, causal without a cache, scale and masks are onnxruntime's.
# Seen on 2026-11-29:  values of two key heads 1, 2 for four query heads: 1 1 2 2, tinygrad 1 2 1 2   cache 1, 2, new 6: 3, tinygrad 1   softcap 1, values 1, 7, mask 0, -inf: 1, tinygrad 2.61
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnx==1.23.2 onnxruntime==1.32.0 tinygrad==0.14.0 numpy==2.4.6
DEV=PYTHON CACHELEVEL=0 v/bin/python -W ignore - <<'PY'
import numpy as np, onnx, onnxruntime
from onnx import TensorProto, checker, helper
from tinygrad import Tensor
from tinygrad.nn.onnx import OnnxRunner


def both(values, queries, mask=None, cache=None, **attributes):
    """The first output of onnxruntime and of tinygrad; all scores are 0 before the mask."""
    v = np.array(values, np.float32)[None, ..., None]
    given = {"q": np.zeros((1, *queries, 1), np.float32), "k": np.zeros_like(v), "v": v}
    if mask:
        given["mask"] = np.array(mask, np.float32)
    names, outputs = [*given, *([] if mask else [""])], ["y"]
    if cache:
        given |= {"past_k": np.zeros((1, 1, len(cache), 1), np.float32), "past_v": np.array(cache, np.float32).reshape(1, 1, -1, 1)}
        names, outputs = names + ["past_k", "past_v"], ["y", "present_k", "present_v"]
    info = lambda name, shape: helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
    shapes = {"y": [1, *queries, 1]} | {name: [1, 1, len(cache or []) + v.shape[2], 1] for name in outputs[1:]}
    node = helper.make_node("Attention", names, outputs, **attributes)
    graph = helper.make_graph([node], "g", [info(name, x.shape) for name, x in given.items()], [info(name, shapes[name]) for name in outputs])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 23)], ir_version=10)
    checker.check_model(model, full_check=True)
    onnx.save(model, "m.onnx")
    expected = onnxruntime.InferenceSession("m.onnx", providers=["CPUExecutionProvider"]).run(None, given)[0]
    found = OnnxRunner("m.onnx")({name: Tensor(x) for name, x in given.items()})["y"].numpy()
    found = [[round(float(n), 2) for n in y.ravel()] for y in (expected, found)]
    print(f"values {values}, mask {mask}, cache {cache}, {attributes}: onnxruntime {found[0]}, tinygrad {found[1]}")
    return found


masked = [[0, -np.inf]]
assert both([[1], [2]], (4, 1)) == [[1, 1, 2, 2], [1, 2, 1, 2]]
assert both([[1], [2]], (2, 1)) == [[1, 2]] * 2
assert both([[6]], (1, 1), cache=[1, 2], is_causal=1) == [[3], [1]]
assert both([[6]], (1, 1), cache=[1, 2]) == [[3]] * 2
assert both([[1, 2, 6]], (1, 3), is_causal=1) == [[1, 1.5, 3]] * 2
assert both([[1, 7]], (1, 1), mask=masked, softcap=1.0) == [[1], [2.61]]
assert both([[1, 7]], (1, 1), mask=masked) == [[1]] * 2
PY
