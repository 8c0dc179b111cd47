"""A small policy of states in LeRobot's file layout, from its folder to an image of raw values.

Makes the folder first: `config.json`, the processors with their statistics, the dataset's `meta/info.json`, and the network as
an ONNX file. LeRobot itself is not needed. docs/families/lerobot.md tells how to export the network of a policy of yours.

    python lerobot_layout.py folder
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any, Dict

import numpy as np
import numpy.typing as npt
import onnx
from onnx import helper, numpy_helper

import actq

JOINTS = ["pan.pos", "lift.pos", "elbow.pos", "gripper.pos"]
NORMS = {"VISUAL": "MEAN_STD", "STATE": "MEAN_STD", "ACTION": "MEAN_STD"}
STATE = {"type": "STATE", "shape": [2 * len(JOINTS)]}
ACTION = {"type": "ACTION", "shape": [len(JOINTS)]}
#: Files of the statistics, as LeRobot names them.
BEFORE = "policy_preprocessor_step_3_normalizer_processor.safetensors"
AFTER = "policy_postprocessor_step_0_unnormalizer_processor.safetensors"

Floats = npt.NDArray[np.float32]


def make(folder: Path) -> None:
    """Writes the files of a policy with random weights."""
    random = np.random.default_rng(0)
    (folder / "meta").mkdir(parents=True, exist_ok=True)
    config = {
        "type": "gaussian_actor",
        "n_obs_steps": 1,
        "input_features": {"observation.state": STATE},
        "output_features": {"action": ACTION},
        "normalization_mapping": NORMS,
    }
    features = {"observation.state": STATE, "action": ACTION}
    norm = {"eps": 1e-8, "features": features, "norm_map": NORMS}
    before = [
        {"registry_name": "rename_observations_processor", "config": {"rename_map": {}}},
        {"registry_name": "to_batch_processor", "config": {}},
        {"registry_name": "device_processor", "config": {"device": "cpu", "float_dtype": None}},
        {"registry_name": "normalizer_processor", "config": norm, "state_file": BEFORE},
    ]
    after = [
        {"registry_name": "unnormalizer_processor", "config": norm, "state_file": AFTER},
        {"registry_name": "device_processor", "config": {"device": "cpu", "float_dtype": None}},
    ]
    info = {
        "codebase_version": "v3.0",
        "fps": 30,
        "features": {
            "action": {"dtype": "float32", "shape": [len(JOINTS)], "names": JOINTS},
            "observation.state": {
                "dtype": "float32",
                "shape": [2 * len(JOINTS)],
                "names": JOINTS + [name.replace(".pos", ".vel") for name in JOINTS],
            },
        },
    }
    for name, content in {
        "config.json": config,
        "policy_preprocessor.json": {"name": "policy_preprocessor", "steps": before},
        "policy_postprocessor.json": {"name": "policy_postprocessor", "steps": after},
        "meta/info.json": info,
    }.items():
        (folder / name).write_text(json.dumps(content, indent=2))
    statistics = {
        "observation.state.mean": random.normal(size=2 * len(JOINTS)),
        "observation.state.std": 0.5 + random.random(2 * len(JOINTS)),
        "action.mean": random.normal(size=len(JOINTS)),
        "action.std": 0.5 + random.random(len(JOINTS)),
    }
    for name in (BEFORE, AFTER):
        write_safetensors(folder / name, {key: value.astype(np.float32) for key, value in statistics.items()})
    write_network(folder / "policy.onnx", random)


def write_network(path: Path, random: np.random.Generator) -> None:
    """Writes a network of two hidden layers."""
    sizes = [2 * len(JOINTS), 64, 64, len(JOINTS)]
    nodes, tensors, value = [], [], "observation.state"
    for i, (cols, rows) in enumerate(zip(sizes, sizes[1:])):
        weight = (random.normal(size=(cols, rows)) / np.sqrt(cols)).astype(np.float32)
        tensors.append(numpy_helper.from_array(weight, f"w{i}"))
        nodes += [helper.make_node("MatMul", [value, f"w{i}"], [f"y{i}"]), helper.make_node("Tanh", [f"y{i}"], [f"z{i}"])]
        value = f"z{i}"
    nodes[-1].output[0] = "action"
    ports = [
        helper.make_tensor_value_info(name, 1, [1, size])
        for name, size in (("observation.state", sizes[0]), ("action", sizes[-1]))
    ]
    graph = helper.make_graph(nodes, "policy", ports[:1], ports[1:], tensors)
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), path)


def write_safetensors(path: Path, tensors: Dict[str, Floats]) -> None:
    header: Dict[str, Any] = {}
    at = 0
    for name, tensor in tensors.items():
        header[name] = {"dtype": "F32", "shape": list(tensor.shape), "data_offsets": [at, at + tensor.nbytes]}
        at += tensor.nbytes
    text = json.dumps(header).encode()
    content = b"".join(tensor.tobytes() for tensor in tensors.values())
    path.write_bytes(len(text).to_bytes(8, "little") + text + content)


def quantize(folder: Path, steps: int | None = None) -> actq.Image:
    """Imports the folder, and quantizes it on raw states."""
    # The ONNX file has the whole network: observations in, one action out.
    policy = actq.import_policy(folder, accept_profile=True, answers={"graph.complete": True})
    # A robot or a simulator would record these: raw states, tick after tick.
    states = np.cumsum(np.random.default_rng(1).normal(size=(3000, policy.obs_len)), axis=0) / 20
    return actq.quantize(policy, states.astype(np.float32), bpw=3, steps=steps)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    make(folder)
    image = quantize(folder)
    for kind, name, joints, length in image.ports:
        print(f"{kind} {name}: {length} values {joints}")
    print(actq.Head(image)(np.zeros(image.obs_len)))
    image.save(folder / "policy.actq")


if __name__ == "__main__":
    main()
