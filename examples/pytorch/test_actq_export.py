"""Exports modules of every kind and compares each with onnxruntime: ACTQ=target/release/actq python3 test_actq_export.py"""
import json
import os
import tempfile
from pathlib import Path

import numpy
import torch
from torch import nn

from actq_export import export


class Residual(nn.Module):
    def __init__(self, n):
        super().__init__()
        self.body = nn.Sequential(nn.LayerNorm(n), nn.Linear(n, 2 * n), nn.SiLU(), nn.Linear(2 * n, n))

    def forward(self, x):
        return x + self.body(x)


class Recurrent(nn.Module):
    def __init__(self, kind, layers=1):
        super().__init__()
        self.cell, self.head = kind(12, 16, layers), nn.Linear(16, 3)

    def forward(self, x, *state):
        y, state = self.cell(x.unsqueeze(0), state if len(state) > 1 else state[0])
        return (self.head(y.squeeze(0)), *(state if isinstance(state, tuple) else (state,)))


class Two(nn.Module):
    def __init__(self):
        super().__init__()
        self.a, self.b = nn.Linear(8, 16), nn.Linear(4, 16)
        self.head = nn.Sequential(nn.Mish(), nn.Linear(16, 3), nn.Tanh())

    def forward(self, a, b):
        return self.head(self.a(a) * torch.sigmoid(self.b(b)))


def layers(*activations):
    return [part for activation in activations for part in (nn.Linear(16, 16), activation)]


ACTIVATIONS = [nn.ReLU(), nn.ELU(), nn.SiLU(), nn.GELU(), nn.GELU("tanh"), nn.Tanh(), nn.Sigmoid(), nn.Softplus(), nn.LeakyReLU(),
               nn.Mish(), nn.LayerNorm(16), nn.RMSNorm(16, eps=1e-6)]
CASES = [
    ("activations", nn.Sequential(nn.Linear(12, 16), *layers(*ACTIVATIONS), nn.Linear(16, 3)), {}, "mish"),
    ("residual", nn.Sequential(nn.Linear(12, 16), Residual(16), Residual(16), nn.Linear(16, 3)), {}, "add"),
    ("lstm", Recurrent(nn.LSTM, 2), {"states": {"h": (2, 1, 16), "c": (2, 1, 16)}}, "lstm"),
    ("gru", Recurrent(nn.GRU), {"states": {"h": (1, 1, 16)}}, "gru"),
    ("two inputs", Two(), {"sizes": [8, 4]}, "mul"),
]


def main():
    torch.manual_seed(0)
    observations = numpy.random.default_rng(0).standard_normal((2, 50, 12)).astype("float32")
    with tempfile.TemporaryDirectory() as temporary:
        for name, module, options, op in CASES:
            folder = Path(temporary, name)
            said = export(module, observations, folder, check=True, **options)
            ops = [entry["op"] for entry in json.loads(Path(folder, "policy.json").read_text())["ops"]]
            assert op in ops, (name, ops)
            assert numpy.load(Path(folder, "calib.npz"))["obs"].shape == observations.shape
            print(f"{name}: {[line for line in said.splitlines() if line.startswith('checked')][0]}")
        try:
            export(nn.Sequential(nn.Linear(12, 4), nn.Softmax(-1)), observations, Path(temporary, "refused"))
        except RuntimeError as error:
            assert "(Softmax)" in str(error), error
        else:
            raise AssertionError("a softmax was taken")
    print(f"{len(CASES)} modules, torch {torch.__version__}")


if __name__ == "__main__":
    os.environ.setdefault("ACTQ_PYTHON", os.sys.executable)
    main()
