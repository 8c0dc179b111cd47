#!/bin/sh
# ai-edge-quantizer 0.10.0, ai-edge-litert 2.3.0, tensorflow-cpu 2.21.0: of the quantizer's ready recipes, some do not do to a small policy (45 observations, layers of 64) what their names say.
# dynamic_wi8b32_afp32 and dynamic_wi8b64_afp32 (8 bits, blocks of 32 and 64) leave all weights in float32; there is no error and no warning. The recipes with a rotation (_hr) write a
# matrix for it in float32 into the file: the file of 4 bits is more than three times as large as without, and with an odd number of inputs they end in numpy's error about shapes. dynamic_wi2c_afp32 has
# three codes, and its step is the largest weight: every weight below half of it is 0.
# Seen on 2026-11-29:  64 inputs, float 37 KB: wi8c 12 KB, wi8b32 and wi8b64 37 KB in float32, wi4c 8 KB, wi4c_hr 26 KB   wi2c: codes -1 0 1, half of the weights 0   45 inputs, _hr: ValueError
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q ai-edge-litert==2.3.0 ai-edge-quantizer==0.10.0 tensorflow-cpu==2.21.0 numpy==2.4.6
TF_CPP_MIN_LOG_LEVEL=3 v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import numpy as np, tensorflow as tf
from ai_edge_litert.interpreter import Interpreter
from ai_edge_quantizer import quantizer, recipe

tf.keras.utils.set_random_seed(0)
relu = dict(activation="relu")


def policy(inputs):
    network = tf.keras.Sequential([tf.keras.Input((inputs,)), *(tf.keras.layers.Dense(64, **relu) for _ in range(2)), tf.keras.layers.Dense(12)])
    file = tf.lite.TFLiteConverter.from_keras_model(network).convert()
    open("float.tflite", "wb").write(file)
    return len(file)


def quantized(name):
    work = quantizer.Quantizer("float.tflite")
    work.load_quantization_recipe(getattr(recipe, name)())
    return bytes(work.quantize(None).quantized_model)


def hidden_weights(file):
    interpreter = Interpreter(model_content=file)
    tensors = [entry for entry in interpreter.get_tensor_details() if tuple(entry["shape"]) == (64, 64)]
    return [(entry["dtype"].__name__, interpreter.get_tensor(entry["index"])) for entry in tensors]


size, seen = policy(64), {}
for name in ("wi8c", "wi8b32", "wi8b64", "wi4c", "wi4b32", "wi4c_hr", "wi2c"):
    file = quantized(f"dynamic_{name}_afp32")
    seen[name] = len(file) / size, sorted({kind for kind, _ in hidden_weights(file)})
    print("SEEN", name, len(file), "of", size, "bytes", *seen[name][1])
    if name == "wi2c":
        codes = hidden_weights(file)[0][1]
        print("SEEN codes", *np.unique(codes), f"share of 0: {(codes == 0).mean():.2f}")
        assert set(np.unique(codes)) == {-1, 0, 1} and 0.45 < (codes == 0).mean() < 0.55
assert all(seen[name][0] > 0.95 and seen[name][1] == ["float32"] for name in ("wi8b32", "wi8b64"))
assert all(seen[name][0] < 0.4 and seen[name][1] == ["int8"] for name in ("wi8c", "wi4c", "wi4b32")) and seen["wi4c_hr"][0] > 3 * seen["wi4c"][0]
policy(45)
quantized("dynamic_wi4c_afp32")
try:
    quantized("dynamic_wi4c_hr_afp32")
    raise SystemExit("45 inputs are rotated now")
except ValueError as error:
    print("SEEN 45 inputs:", str(error)[:80])
    assert "mismatch in its core dimension" in str(error)
PY
grep SEEN out.txt
