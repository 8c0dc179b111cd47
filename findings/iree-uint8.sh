#!/bin/sh
# iree-base-compiler and iree-base-runtime 3.13.0, onnx 1.23.2, onnxruntime 1.32.0: compiled by IREE, an ONNX file's Div, Mod, Clip and MaxPool of UINT8 compute with signed numbers, and Cast from
# floating-point numbers to UINT8 ends at 127: pixels and codes above 127 are other numbers. There is no error. Comparisons, shifts, Cast of UINT8 to floating-point numbers and ReduceMax are
# right. And QLinearConv with a scale for each channel and a bias gives other codes, where one scale for all is right; that is how 8-bit convolutions are usually written.
# Seen on 2026-11-29:  Div of 200 by 2: 100, IREE 228   MaxPool of 5 200 100 7: 200, IREE 100   Clip of 128 to 10 .. 210: 128, IREE 210   Mod of 200 by 7: 4, IREE 0
#                      Cast of 200.0: 200, IREE 127   QLinearConv, scales 1 and 2, bias 3: 13 23 33 and 26 46 66, IREE 160 170 180 and 170 190 210; one scale: right
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q iree-base-compiler==3.13.0 iree-base-runtime==3.13.0 onnx==1.23.2 onnxruntime==1.32.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import subprocess, sys

import iree.compiler.tools, iree.runtime
import numpy as np, onnx, onnxruntime
from onnx import TensorProto, helper, numpy_helper


def results(operator, x, constants=(), kind=TensorProto.UINT8, **attributes):
    tensors = [numpy_helper.from_array(np.asarray(value), f"c{i}") for i, value in enumerate(constants)]
    node = helper.make_node(operator, ["x", *(tensor.name for tensor in tensors)], ["y"], **attributes)
    given = helper.make_tensor_value_info("x", helper.np_dtype_to_tensor_dtype(x.dtype), x.shape)
    graph = helper.make_graph([node], "one", [given], [helper.make_tensor_value_info("y", kind, None)], tensors)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 21)], ir_version=10)
    expected = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"]).run(None, {"x": x})[0]
    model.graph.output[0].CopyFrom(helper.make_tensor_value_info("y", kind, expected.shape))
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, "one.onnx")
    subprocess.run([sys.executable, "-m", "iree.compiler.tools.import_onnx", "one.onnx", "-o", "one.mlir"], check=True)
    code = iree.compiler.tools.compile_file("one.mlir", target_backends=["llvm-cpu"], input_type="onnx", extra_args=["--iree-llvmcpu-target-cpu=generic"])
    context = iree.runtime.SystemContext(config=iree.runtime.Config("local-task"))
    context.add_vm_module(iree.runtime.VmModule.copy_buffer(context.instance, code))
    found = np.asarray(context.modules.module["one"](x).to_host())
    return expected, found.view(np.uint8) if kind == TensorProto.UINT8 else found  # IREE's 8 bits have no sign


pixels, byte = np.array([[5, 127, 128, 200, 230, 255]], np.uint8), np.uint8
scales = lambda scale: (np.float32(0.02), byte(7), np.ones((2, 1, 1, 1), np.int8), scale, np.zeros_like(scale, np.int8), np.float32(0.02), byte(0), np.array([3, 3], np.int32))
image = np.array([[[[17, 27, 37]]]], np.uint8)
right = [
    ("Greater", pixels, [np.array([100], byte)], {"kind": TensorProto.BOOL}),
    ("BitShift", pixels, [np.array([1], byte)], {"direction": "RIGHT"}),
    ("Cast", pixels, [], {"to": TensorProto.FLOAT, "kind": TensorProto.FLOAT}),
    ("ReduceMax", pixels, [], {"keepdims": 0}),
    ("QLinearConv", image, scales(np.float32(1)), {}),
]
wrong = [
    ("Div", pixels, [np.array([2], byte)], {}),
    ("Mod", pixels, [np.array([7], byte)], {}),
    ("Clip", pixels, [byte(10), byte(210)], {}),
    ("MaxPool", np.array([[[[5, 200], [100, 7]]]], byte), [], {"kernel_shape": [2, 2]}),
    ("Cast", pixels.astype(np.float32), [], {"to": TensorProto.UINT8}),
    ("QLinearConv", image, scales(np.array([1, 2], np.float32)), {}),
]
for case in right + wrong:
    operator, x, constants, options = case
    expected, found = results(operator, x, constants, **options)
    same = bool((expected == found).all())
    print("SEEN", operator, "of", x.dtype, "same" if same else f"right {expected.ravel()} IREE {found.ravel()}")
    assert same == any(case is other for other in right)
PY
grep SEEN out.txt
