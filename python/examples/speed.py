"""Steps of a policy per second of processor time: actq at 2, 3 and 8 bits, onnxruntime in f32 and int8, torch in f32, in turn.

    pip install onnx onnxruntime torch
    python speed.py --robots 4096 --threads 1 --seconds 2

A package that is not installed is left out, by name.
"""

from __future__ import annotations

import argparse
import importlib
import os
import statistics
import tempfile
import time
from typing import Any, Callable, Dict, List, Tuple

import numpy as np
import numpy.typing as npt

#: Lengths of the layers, from the observation to the action: 190 thousand weights.
LAYERS = [48, 512, 256, 128, 12]
#: Each engine is measured this many times, in turn.
ROUNDS = 5

Floats = npt.NDArray[np.float32]
Step = Callable[[], object]


def weights() -> List[Tuple[Floats, Floats]]:
    """Returns each layer's weights, of outputs by inputs, and biases."""
    random = np.random.default_rng(0)
    shapes = zip(LAYERS[1:], LAYERS)
    draw = [(random.uniform(-1, 1, shape) * (3 / shape[1]) ** 0.5, random.uniform(-1, 1, shape[0])) for shape in shapes]
    return [(matrix.astype(np.float32), bias.astype(np.float32)) for matrix, bias in draw]


def write_onnx(path: str) -> None:
    """Writes the policy for any batch."""
    onnx: Any = importlib.import_module("onnx")
    helper, numbers = onnx.helper, onnx.numpy_helper
    nodes: List[Any] = []
    constants: List[Any] = []
    last = "obs"
    for i, (matrix, bias) in enumerate(weights()):
        constants += [numbers.from_array(matrix.T.copy(), f"w{i}"), numbers.from_array(bias, f"b{i}")]
        to = "action" if i + 2 == len(LAYERS) else f"y{i}"
        nodes.append(helper.make_node("Gemm", [last, f"w{i}", f"b{i}"], [to]))
        if to != "action":
            nodes.append(helper.make_node("Elu", [to], [f"x{i}"]))
        last = f"x{i}"
    value = [helper.make_tensor_value_info(name, 1, ["n", n]) for name, n in (("obs", LAYERS[0]), ("action", LAYERS[-1]))]
    graph = helper.make_graph(nodes, "speed", value[:1], value[1:], constants)
    onnx.save(helper.make_model(graph, ir_version=8, opset_imports=[helper.make_opsetid("", 17)]), path)


def by_actq(path: str, robots: int, observations: Floats, threads: int) -> Dict[str, Step]:
    os.environ["RAYON_NUM_THREADS"] = str(threads)
    actq: Any = importlib.import_module("actq")
    policy = actq.import_policy(path)

    def step(bits: int) -> Step:
        head = actq.Head(actq.quantize(policy, bits=bits, method="rtn", activations=8, progress=False), robots)
        return lambda: head(observations)

    return {f"actq, {bits} bits": step(bits) for bits in (2, 3, 8)}


def by_onnxruntime(path: str, robots: int, observations: Floats, threads: int) -> Dict[str, Step]:
    runtime: Any = importlib.import_module("onnxruntime")
    quantization: Any = importlib.import_module("onnxruntime.quantization")
    quantization.quantize_dynamic(path, path.replace(".onnx", "-int8.onnx"), weight_type=quantization.QuantType.QInt8)
    options = runtime.SessionOptions()
    options.intra_op_num_threads = threads
    # A thread that waits would count as one that works.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")

    def step(path: str) -> Step:
        session = runtime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
        return lambda: session.run(None, {"obs": observations})

    return {"onnxruntime, f32": step(path), "onnxruntime, int8": step(path.replace(".onnx", "-int8.onnx"))}


def by_torch(path: str, robots: int, observations: Floats, threads: int) -> Dict[str, Step]:
    torch: Any = importlib.import_module("torch")
    torch.set_num_threads(threads)
    layers: List[Any] = []
    for matrix, bias in weights():
        layer = torch.nn.Linear(matrix.shape[1], matrix.shape[0])
        layer.load_state_dict({"weight": torch.from_numpy(matrix), "bias": torch.from_numpy(bias)})
        layers += [layer, torch.nn.ELU()]
    module, tensor = torch.nn.Sequential(*layers[:-1]).eval(), torch.from_numpy(observations)

    def step() -> object:
        with torch.inference_mode():
            return module(tensor)

    return {"torch, f32": step}


def rate(step: Step, robots: int, seconds: float) -> List[float]:
    """Returns the steps of robots per second of processor time, of each call."""
    step()
    rates: List[float] = []
    end = time.process_time() + seconds
    while (begun := time.process_time()) < end:
        step()
        rates.append(robots / max(time.process_time() - begun, 1e-9))
    return rates


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=4096)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=2.0, help="of each measurement")
    args = parser.parse_args()
    observations = np.random.default_rng(0).normal(size=(args.robots, LAYERS[0])).astype(np.float32)
    engines: Dict[str, Step] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "speed.onnx")
        write_onnx(path)
        for engine in (by_actq, by_onnxruntime, by_torch):
            try:
                engines.update(engine(path, args.robots, observations, args.threads))
            except ImportError as error:
                print(f"left out: {error}")
    rates: Dict[str, List[float]] = {name: [] for name in engines}
    for _ in range(ROUNDS):
        for name, step in engines.items():
            rates[name] += rate(step, args.robots, args.seconds)
    print(f"{args.robots} robots, {args.threads} threads: steps per second of processor time, median and most")
    for name, all_rates in rates.items():
        print(f"{name:17} {statistics.median(all_rates):10.0f} {max(all_rates):10.0f}")


if __name__ == "__main__":
    main()
