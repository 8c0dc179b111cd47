#!/usr/bin/env python3
"""Export a PyTorch module as a policy folder for actq.

    from actq_export import export
    export(actor, observations, "policies/walker")

`actor` is an nn.Module from a batch of observations, or several batches (a tuple of arrays), to actions: Sequential, Linear,
activations, norms, residual blocks. A recurrent module takes its states after the observations, and returns the next states after the
action; `states` names them with their shapes:

    export(actor, observations, "policies/walker", states={"h": (1, 1, 64), "c": (1, 1, 64)})

`observations` are recorded observations of the policy, [frame, value] or [episode, step, value] (several inputs: concatenated in
order); the quantizer learns from them. As a command, for a whole module written by torch.save:

    actq_export.py actor.pt obs.npy policies/walker

Needs torch and numpy, and actq in PATH (or the path in ACTQ). torch.onnx writes the file; actq reads it, and names each operation that
it refuses.
"""
import argparse
import copy
import os
import subprocess
import tempfile
import warnings
from pathlib import Path
from unittest import mock

import numpy
import torch

#: Largest difference of two right runs, as a share of the largest action.
TOLERANCE = 1e-5


def export(module, observations, folder, sizes=None, states=None, check=False, force=False):
    """Writes policy.json, policy.safetensors and calib.npz to `folder`, and returns the report of actq.

    sizes: lengths of the module's inputs, if it has several; their sum is the length of an observation.
    states: names and shapes of a recurrent module's states, including a batch of 1.
    check: compares policy and module with onnxruntime, which must be installed beside this torch.

    Raises ValueError if the action depends on values that the module keeps from step to step, or on random numbers, and with
    `check` if the file gives other actions than the module, as where forward chooses a branch by a value.
    """
    observations = numpy.asarray(observations, numpy.float32)
    if observations.ndim not in (2, 3):
        raise ValueError(f"observations are {observations.shape}; [frame, value] or [episode, step, value] is needed")
    width = observations.shape[-1]
    sizes = list(sizes or [width])
    if sum(sizes) != width:
        raise ValueError(f"the inputs have {sizes} values, which are not the {width} of an observation")
    states = dict(states or {})
    frame = torch.from_numpy(observations.reshape(-1, width)[:1].copy())
    inputs = [*torch.split(frame, sizes, dim=1), *(torch.zeros(shape) for shape in states.values())]
    names = ["obs"] if len(sizes) == 1 else [f"obs_{i}" for i in range(len(sizes))]
    with tempfile.TemporaryDirectory() as temporary:
        model, recording = Path(temporary, "policy.onnx"), Path(temporary, "obs.npy")
        numpy.save(recording, observations)
        module, frames = copy.deepcopy(module).eval().cpu(), torch.from_numpy(observations.reshape(-1, width)[:32].copy())
        refuse_memory(module, frames, sizes, states)
        write_onnx(copy.deepcopy(module), inputs, model, names, states)
        if check:
            compare(module, model, frames, sizes, states)
        command = [os.environ.get("ACTQ", "actq"), "import", str(model), "--out", str(folder), "--calib", str(recording)]
        command += [f"--state={name}_in={name}_out" for name in states]
        command += ["--check"] * check + ["--force"] * force
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(done.stderr.strip())
        return done.stdout


def write_onnx(module, inputs, path, names, states):
    """Writes one step of the module as an ONNX file."""
    with torch.no_grad(), warnings.catch_warnings(), mock.patch.object(torch.nn.RMSNorm, "forward", rms_norm):
        # The tracing exporter needs only torch. It warns of its age, and of a fixed batch. Its warnings that a value becomes
        # a constant are the user's to see.
        warnings.simplefilter("ignore")
        warnings.simplefilter("default", torch.jit.TracerWarning)
        torch.onnx.export(
            module,
            tuple(inputs),
            str(path),
            input_names=[*names, *(f"{name}_in" for name in states)],
            output_names=["actions", *(f"{name}_out" for name in states)],
            opset_version=17,
            dynamo=False,
        )


def refuse_memory(module, frames, sizes, states):
    """Refuses a module that gives other actions on the same observations later. Only a copy of it runs."""
    used = copy.deepcopy(module)
    with torch.no_grad():
        before = [step(used, frame, sizes, states)[0] for frame in frames]
        after = [step(used, frame, sizes, states)[0] for frame in frames.flip(0)][::-1]
    if error(torch.stack(after), torch.stack(before)) <= TOLERANCE:
        return
    old = dict(module.named_buffers())
    changed = [name for name, value in used.named_buffers() if name not in old or not torch.equal(value, old[name])]
    raise ValueError(
        f"the action depends on values that the module keeps from step to step ({', '.join(changed) or 'none is a buffer'}), or on "
        "random numbers; take them as inputs, and those of LSTM and GRU layers as states"
    )


def compare(module, path, frames, sizes, states):
    """Refuses a file that gives other actions than the module, on observations of several sizes and signs."""
    import onnxruntime

    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    names = [port.name for port in session.get_inputs()]

    def file(*inputs):
        given = {name: tensor.numpy() for name, tensor in zip(names, inputs)}
        return tuple(map(torch.from_numpy, session.run(None, given)))

    for factor in (1, -1, 0.001, 0.01, 0.1, 10, 100, 1000):
        actions = []
        for run in (copy.deepcopy(module), file):
            held, rows = {}, []
            with torch.no_grad():
                for frame in factor * frames:
                    action, held = step(run, frame, sizes, states, held)
                    rows.append(action)
            actions.append(torch.stack(rows))
        off = error(actions[1], actions[0])
        if off > TOLERANCE:
            raise ValueError(
                f"the file is off by {off:.1e} of the module's largest action on observations times {factor}; forward chooses by "
                "values, or computes outside of torch: torch's warnings name the lines"
            )


def step(run, frame, sizes, states, held=None):
    """Returns the action on a frame, and the next states by name; states are zeros at first."""
    held = held or {name: torch.zeros(shape) for name, shape in states.items()}
    outputs = run(*torch.split(frame[None], sizes, dim=1), *held.values())
    action, *after = outputs if isinstance(outputs, (tuple, list)) else (outputs,)
    # A copy, because a module may write to what it has returned.
    return action.flatten().clone(), dict(zip(states, after))


def error(actions, right):
    return float((actions - right).abs().max() / right.abs().max().clamp(min=1e-30))


def rms_norm(self, x):
    """Expresses nn.RMSNorm by operations that the tracing exporter supports."""
    axes = tuple(range(-len(self.normalized_shape), 0))
    eps = torch.finfo(x.dtype).eps if self.eps is None else self.eps
    y = x * torch.rsqrt((x * x).mean(axes, keepdim=True) + eps)
    return y if self.weight is None else y * self.weight


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("module", help="a file written by torch.save(module, FILE); it is unpickled: use only trusted files")
    parser.add_argument("observations", help="an .npy array")
    parser.add_argument("folder", help="the policy's folder")
    parser.add_argument("--check", action="store_true", help="compare with onnxruntime")
    parser.add_argument("--force", action="store_true", help="replace existing files")
    args = parser.parse_args()
    module = torch.load(args.module, map_location="cpu", weights_only=False)
    print(export(module, numpy.load(args.observations), args.folder, check=args.check, force=args.force), end="")


if __name__ == "__main__":
    main()
