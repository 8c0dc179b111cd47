#!/bin/sh
# onnx 1.23.2: onnx.utils.extract_model, which cuts an actor out of a file that has the critic, too, drops the file's metadata: names and order of the
# joints, gains and scales are gone, without a warning. version_converter, shape inference, add_prefix and merge_models of the same package keep them.
# Seen on 2026-11-29:  convert_version: kept   infer_shapes: kept   add_prefix: kept   merge_models: kept   extract_model: lost
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q onnx==1.23.2 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import warnings

import numpy as np, onnx
from onnx import TensorProto, compose, helper, numpy_helper, shape_inference, utils, version_converter

value = lambda name, length: helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, length])
weights = [numpy_helper.from_array(np.ones((4, length), np.float32), name) for name, length in (("a", 2), ("c", 1))]
nodes = [helper.make_node("MatMul", ["obs", "a"], ["action"]), helper.make_node("MatMul", ["obs", "c"], ["critic"])]
graph = helper.make_graph(nodes, "policy", [value("obs", 4)], [value("action", 2), value("critic", 1)], weights)
model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
helper.set_model_props(model, {"joint_names": "hip,knee", "action_scale": "0.25,0.5"})
onnx.checker.check_model(model, full_check=True)
onnx.save(model, "policy.onnx")


def extracted():
    utils.extract_model("policy.onnx", "actor.onnx", ["obs"], ["action"])
    return onnx.load("actor.onnx")


seen = {}
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    for name, run in (
        ("convert_version", lambda: version_converter.convert_version(model, 21)),
        ("infer_shapes", lambda: shape_inference.infer_shapes(model)),
        ("add_prefix", lambda: compose.add_prefix(model, "a/")),
        ("merge_models", lambda: compose.merge_models(compose.add_prefix(model, "a/"), compose.add_prefix(model, "b/"), io_map=[])),
        ("extract_model", extracted),
    ):
        seen[name] = {entry.key: entry.value for entry in run().metadata_props}.get("joint_names")
        print(f"{name}: {'kept' if seen[name] == 'hip,knee' else 'lost'}")
assert seen.pop("extract_model") is None and set(seen.values()) == {"hip,knee"} and not caught
PY
