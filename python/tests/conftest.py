"""What the tests share: the tree's policies, and the command."""

import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import actq

try:
    import torch
except ImportError:
    pass
else:
    # The machine's cores are shared with other tests.
    torch.set_num_threads(1)

ROOT = Path(__file__).resolve().parents[2]
UR3 = ROOT / "examples/ur3/policy"
FLOW = ROOT / "examples/ur3/flow"


def listings(document):
    """The listings in Python of a document in docs/."""
    text = (ROOT / f"docs/{document}.md").read_text()
    return re.findall(r"^```python\n(.*?)^```$", text, re.M | re.S)


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


def write_mlp(path, layers):
    """Writes a network of matrices and tanh as an ONNX file, without an exporter; the last layer is linear."""
    onnx = pytest.importorskip("onnx", reason="onnx is not installed")
    nodes, tensors, value = [], [], "obs"
    for i, (weight, bias) in enumerate(layers):
        arrays = {f"w{i}": weight.astype(np.float32), f"b{i}": bias.astype(np.float32)}
        tensors += [onnx.numpy_helper.from_array(array, name) for name, array in arrays.items()]
        nodes.append(onnx.helper.make_node("Gemm", [value, *arrays], [f"y{i}"]))
        nodes.append(onnx.helper.make_node("Tanh", [f"y{i}"], [f"z{i}"]))
        value = f"z{i}"
    nodes.pop()
    nodes[-1].output[0] = "action"
    sizes = (("obs", len(layers[0][0])), ("action", len(layers[-1][1])))
    ports = [onnx.helper.make_tensor_value_info(name, 1, [1, n]) for name, n in sizes]
    graph = onnx.helper.make_graph(nodes, path.stem, ports[:1], ports[1:], tensors)
    onnx.save(onnx.helper.make_model(graph, opset_imports=[onnx.helper.make_opsetid("", 17)], ir_version=8), path)
    return path


@pytest.fixture(scope="session")
def mlp(tmp_path_factory):
    """A small network of random weights."""
    random, sizes = np.random.default_rng(1), [12, 32, 32, 4]
    layers = [
        (random.normal(size=(cols, rows)) / np.sqrt(cols), 0.1 * random.normal(size=rows))
        for cols, rows in zip(sizes, sizes[1:])
    ]
    return write_mlp(tmp_path_factory.mktemp("mlp") / "mlp.onnx", layers)


@pytest.fixture(scope="session")
def cart_pole(tmp_path_factory):
    """A policy that balances Gymnasium's pole: random features, fitted to a linear controller."""
    random = np.random.default_rng(1)
    weight, bias = random.normal(size=(4, 64)), random.normal(size=64)
    states = random.normal(size=(4000, 4)) * [1.0, 1.0, 0.2, 1.0]
    features = np.tanh(states @ weight + bias)
    push = states @ [0.1, 0.3, 3.0, 1.0]
    fitted = np.linalg.lstsq(features, np.stack([-push, push], axis=1), rcond=None)[0]
    path = write_mlp(tmp_path_factory.mktemp("cart") / "cart-pole.onnx", [(weight, bias), (fitted, np.zeros(2))])

    def f32(observations, reset):
        return np.tanh(observations @ weight + bias) @ fitted

    return {"policy": actq.import_policy(path), "f32": f32}


@pytest.fixture(scope="session")
def flow():
    """An image of a flow policy, whose import takes seconds."""
    policy = actq.import_policy(FLOW)
    return actq.quantize(policy, bits=8, activations=16, method="rtn", progress=False)


@pytest.fixture(scope="session")
def observations():
    return np.random.default_rng(2).normal(size=(500, 12)).astype(np.float32)


def pytest_runtest_logreport(report):
    """Tells `cargo verify` what was skipped."""
    path = os.environ.get("ACTQ_SKIPPED")
    if path and report.skipped:
        with open(path, "a") as file:
            file.write(f"skipped: {report.nodeid}: {report.longrepr[2]}\n")
