"""What the tests share: the tree's policies, and the command."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
UR3 = ROOT / "examples/ur3/policy"
FLOW = ROOT / "examples/ur3/flow"


@pytest.fixture(scope="session")
def command():
    """Runs the command `actq`, and returns its standard output."""
    program = os.environ.get("ACTQ")
    if program is None:
        pytest.skip("ACTQ does not name the command; `cargo xtask python` builds it and runs these tests")

    def run(*arguments, given=b"", fails=False):
        done = subprocess.run([program, *map(str, arguments)], input=given, capture_output=True)
        assert (done.returncode != 0) == fails, done.stderr.decode()
        return done.stderr.decode() if fails else done.stdout

    return run


@pytest.fixture(scope="session")
def obs_len():
    return 12


@pytest.fixture(scope="session")
def mlp(tmp_path_factory):
    """A small network as an ONNX file, made without an exporter, and observations for it."""
    onnx = pytest.importorskip("onnx")
    random = np.random.default_rng(1)
    sizes, nodes, tensors, value = [12, 32, 32, 4], [], [], "obs"
    for i, (cols, rows) in enumerate(zip(sizes, sizes[1:])):
        weight = random.normal(size=(cols, rows)).astype(np.float32) / np.float32(np.sqrt(cols))
        bias = 0.1 * random.normal(size=rows).astype(np.float32)
        tensors += [onnx.numpy_helper.from_array(weight, f"w{i}"), onnx.numpy_helper.from_array(bias, f"b{i}")]
        nodes.append(onnx.helper.make_node("Gemm", [value, f"w{i}", f"b{i}"], [f"y{i}"]))
        value = f"y{i}"
        nodes.append(onnx.helper.make_node("Tanh", [value], [f"{value}_t"]))
        value = f"{value}_t"
    nodes[-1].output[0] = "action"
    ports = [onnx.helper.make_tensor_value_info(name, 1, [1, n]) for name, n in (("obs", 12), ("action", 4))]
    graph = onnx.helper.make_graph(nodes, "mlp", ports[:1], ports[1:], tensors)
    model = onnx.helper.make_model(graph, opset_imports=[onnx.helper.make_opsetid("", 17)], ir_version=8)
    path = tmp_path_factory.mktemp("mlp") / "mlp.onnx"
    onnx.save(model, path)
    return path


@pytest.fixture(scope="session")
def observations():
    return np.random.default_rng(2).normal(size=(500, 12)).astype(np.float32)
