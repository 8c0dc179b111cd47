"""Steps a second of a policy at 2 bits, beside the same policy in f32 by onnxruntime and torch, in one run on all cores.

    pip install onnxruntime torch
    python speed.py --robots 4096 --seconds 5
"""

from __future__ import annotations

import argparse
import io
import os
import statistics
import time
from typing import Callable, Dict, List

import numpy as np
import onnxruntime
import torch
from torch import nn

import actq

#: Lengths of the layers, from the observation to the action: 190 thousand weights.
LAYERS = [48, 512, 256, 128, 12]
#: Each is measured this many times, in turn; the median counts.
ROUNDS = 5


def network() -> nn.Module:
    torch.manual_seed(0)
    layers: List[nn.Module] = []
    for cols, rows in zip(LAYERS, LAYERS[1:]):
        layers += [nn.Linear(cols, rows), nn.ELU()]
    return nn.Sequential(*layers[:-1]).eval()


def session(module: nn.Module, cores: int) -> onnxruntime.InferenceSession:
    """Returns a session for any batch."""
    file, example = io.BytesIO(), torch.zeros(2, LAYERS[0])
    torch.onnx.export(
        module,
        (example,),
        file,  # type: ignore[arg-type]
        input_names=["obs"],
        output_names=["action"],
        dynamic_axes={"obs": {0: "batch"}},
        dynamo=False,
    )
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = cores
    return onnxruntime.InferenceSession(file.getvalue(), options, providers=["CPUExecutionProvider"])


def engines(robots: int, cores: int) -> Dict[str, Callable[[], object]]:
    """Returns a step of all robots by each engine."""
    module = network()
    observations = np.random.default_rng(0).normal(size=(robots, LAYERS[0])).astype(np.float32)
    policy = actq.import_policy(module, torch.zeros(1, LAYERS[0]), name="speed")
    head = actq.Head(actq.quantize(policy, bits=2, method="rtn", activations=8, progress=False), robots)
    onnx, tensor = session(module, cores), torch.from_numpy(observations)
    torch.set_num_threads(cores)

    def by_torch() -> object:
        with torch.inference_mode():
            return module(tensor)

    return {
        "actq, 2 bits": lambda: head(observations),
        "onnxruntime, f32": lambda: onnx.run(None, {"obs": observations}),
        "torch, f32": by_torch,
    }


def rate(step: Callable[[], object], robots: int, seconds: float) -> float:
    """Returns the steps of robots in a second."""
    step()
    begun, steps = time.perf_counter(), 0
    while time.perf_counter() - begun < seconds:
        step()
        steps += robots
    return steps / (time.perf_counter() - begun)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=4096)
    parser.add_argument("--seconds", type=float, default=5.0, help="of each measurement")
    args = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    measured: Dict[str, List[float]] = {}
    all_engines = engines(args.robots, cores)
    for _ in range(ROUNDS):
        for name, step in all_engines.items():
            measured.setdefault(name, []).append(rate(step, args.robots, args.seconds))
    print(f"{args.robots} robots, {cores} cores, steps a second: median, least and most of {ROUNDS}")
    for name, rates in measured.items():
        print(f"{name:17} {statistics.median(rates):10.0f} {min(rates):10.0f} {max(rates):10.0f}")


if __name__ == "__main__":
    main()
