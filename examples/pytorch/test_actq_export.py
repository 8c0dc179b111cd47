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


class Filter(nn.Module):
    """Keeps its last action in a buffer."""

    def __init__(self):
        super().__init__()
        self.net = nn.Linear(12, 3)
        self.register_buffer("low_pass", torch.zeros(1, 3))

    def forward(self, x):
        self.low_pass.mul_(0.8).add_(0.2 * self.net(x))
        return self.low_pass.clone()


class Mirror(nn.Module):
    """Chooses a branch by a value."""

    def __init__(self):
        super().__init__()
        self.net = nn.Linear(12, 3)

    def forward(self, x):
        return -self.net(-x) if x[0, 0] < 0 else self.net(x)


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
        for module, text in ((Filter(), "keeps from step to step (low_pass)"), (Mirror(), "off by")):
            try:
                export(module, observations, Path(temporary, "refused"), check=True)
            except ValueError as error:
                assert text in str(error), error
            else:
                raise AssertionError(f"{type(module).__name__} was taken")
        assert not Path(temporary, "refused").exists()
        frozen = nn.Sequential(nn.Linear(12, 8), nn.BatchNorm1d(8), nn.Linear(8, 3)).train()
        frozen[1].eval()
        export(frozen, observations, Path(temporary, "frozen"))
        assert frozen.training and not frozen[1].training, "the export changed the module's modes"
    print(f"{len(CASES)} modules, torch {torch.__version__}")


if __name__ == "__main__":
    os.environ.setdefault("ACTQ_PYTHON", os.sys.executable)
    main()
