#!/bin/sh
# jax2onnx 0.17.1, jax 0.10.2, onnxruntime 1.32.0, onnx 1.23.2: jax.nn.dot_product_attention with key_value_seq_lengths is exported so that the first query alone attends to its keys; the output
# of the others is 0. With query_seq_lengths, queries see the first key only. There is no error. The same function imported by its name (from jax.nn import ...) is exported right: the exporter
# replaces the attribute of the module. And jax.lax.dynamic_slice moves a window that would end after the data back into it; the file cuts it off, and its output is shorter.
# Seen on 2026-11-29:  values 1, 2, 6, two keys valid, three queries: jax 1.5 1.5 1.5, file 1.5 0 0; imported by name: 1.5 1.5 1.5   window of 3 at 4 of 0 to 5: jax 3 4 5, file 4 5
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q jax2onnx==0.17.1 jax==0.10.2 jaxlib==0.10.2 onnx==1.23.2 onnxruntime==1.32.0 numpy==2.4.6
JAX_PLATFORMS=cpu v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import jax, jax.numpy as jnp, numpy as np, onnxruntime
from jax.nn import dot_product_attention
from jax2onnx import to_onnx

onnxruntime.set_default_logger_severity(4)


def both(what, function, *inputs):
    expected = np.asarray(function(*inputs)).ravel().round(3).tolist()
    model = to_onnx(function, inputs=[jax.ShapeDtypeStruct(x.shape, x.dtype) for x in inputs])
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    found = session.run(None, {port.name: x for port, x in zip(session.get_inputs(), inputs)})[0].ravel().round(3).tolist()
    print(f"SEEN {what}: jax {expected}, file {found}")
    return expected, found


zeros = np.zeros((1, 3, 1, 1), np.float32)
tokens = zeros, zeros, np.array([1, 2, 6], np.float32).reshape(1, 3, 1, 1)
two, row = jnp.array([2]), np.arange(6, dtype=np.float32)
keys = both("two keys", lambda q, k, v: jax.nn.dot_product_attention(q, k, v, key_value_seq_lengths=two), *tokens)
assert keys == ([1.5, 1.5, 1.5], [1.5, 0, 0])
queries = both("two queries", lambda q, k, v: jax.nn.dot_product_attention(q, k, v, query_seq_lengths=two), *tokens)
assert queries == ([3, 3, 0], [1, 1, 0])
by_name = both("two keys, imported by name", lambda q, k, v: dot_product_attention(q, k, v, key_value_seq_lengths=two), *tokens)
assert by_name == ([1.5, 1.5, 1.5],) * 2
causal = both("causal", lambda q, k, v: jax.nn.dot_product_attention(q, k, v, is_causal=True), *tokens)
assert causal == ([1, 1.5, 3],) * 2
assert both("window of 3 at 4", lambda x: jax.lax.dynamic_slice(x, (4,), (3,)), row) == ([3, 4, 5], [4, 5])
assert both("window of 3 at 2", lambda x: jax.lax.dynamic_slice(x, (2,), (3,)), row) == ([2, 3, 4],) * 2
PY
grep SEEN out.txt
