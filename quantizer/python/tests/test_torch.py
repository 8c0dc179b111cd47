"""Modules of torch and TorchScript files."""

import numpy as np
import pytest

import actq

torch = pytest.importorskip("torch", reason="torch is not installed (requirements-optional.txt)")
nn = torch.nn


def actor():
    torch.manual_seed(0)
    return nn.Sequential(nn.Linear(12, 32), nn.ELU(), nn.LayerNorm(32), nn.Linear(32, 32), nn.SiLU(), nn.Linear(32, 4))


class Recurrent(nn.Module):
    def __init__(self):
        super().__init__()
        self.lstm = nn.LSTM(12, 16)
        self.out = nn.Linear(16, 4)

    def forward(self, obs, h, c):
        y, (h, c) = self.lstm(obs[None], (h, c))
        return self.out(y[0]), h, c


class Normed(nn.Module):
    def __init__(self):
        super().__init__()
        self.norm, self.out = nn.RMSNorm(12), nn.Linear(12, 4)

    def forward(self, obs):
        return self.out(self.norm(obs))


def near(policy, module, observations):
    """An image of 8 bits and int16 activations is within 2 % of the module."""
    image = actq.quantize(policy, bits=8, method="rtn", activations=16, progress=False)
    with torch.no_grad():
        expected = module(torch.from_numpy(observations)).numpy()
    found = actq.Head(image)(observations)
    assert np.abs(found - expected).max() < 0.02 * np.abs(expected).max()


def test_a_module_is_imported(observations):
    module = actor().train()
    policy = actq.import_policy(module, torch.zeros(1, 12), name="actor")
    assert (policy.name, policy.obs_len, policy.act_len) == ("actor", 12, 4)
    assert policy.parameters == sum(p.numel() for p in module.parameters())
    assert module.training, "the module's mode is as before"
    near(policy, module, observations)


def test_a_module_with_an_operator_of_the_newer_exporter_is_imported(observations):
    pytest.importorskip("onnxscript", reason="onnxscript is not installed (requirements-optional.txt)")
    module = Normed().eval()
    near(actq.import_policy(module, torch.zeros(1, 12)), module, observations)


def test_a_torchscript_file_is_imported(observations, tmp_path):
    module = actor().eval()
    torch.jit.script(module).save(tmp_path / "actor.pt")
    policy = actq.import_policy(tmp_path / "actor.pt", torch.zeros(1, 12))
    assert policy.name == "actor"
    near(policy, module, observations)


def test_a_module_has_the_bytes_of_its_file(command, observations, tmp_path):
    module = actor().eval()
    torch.onnx.export(module, (torch.zeros(1, 12),), str(tmp_path / "actor.onnx"), opset_version=17, dynamo=False)
    np.save(tmp_path / "obs.npy", observations)
    options = ["--calib", tmp_path / "obs.npy", "--bpw", "3", "--steps", "5"]
    command("quantize", tmp_path / "actor.onnx", "--out", tmp_path / "c.actq", *options)
    policy = actq.import_policy(module, torch.zeros(1, 12), name="actor")
    image = actq.quantize(policy, observations, bpw=3, steps=5, progress=False)
    assert image.bytes == (tmp_path / "c.actq").read_bytes()


def test_a_recurrent_module_keeps_its_state(observations):
    torch.manual_seed(0)
    module = Recurrent()
    state = torch.zeros(1, 1, 16)
    policy = actq.import_policy(
        module,
        (torch.zeros(1, 12), state, state),
        input_names=["obs", "h", "c"],
        output_names=["action", "h_next", "c_next"],
        states={"h": "h_next", "c": "c_next"},
    )
    assert policy.state_len == 32
    image = actq.quantize(policy, bits=8, method="rtn", activations=16, progress=False)
    head, h, c = actq.Head(image), state, state
    for row in observations[:20]:
        with torch.no_grad():
            expected, h, c = module(torch.from_numpy(row[None]), h, c)
        assert np.abs(head(row) - expected.numpy()[0]).max() < 0.02


def test_what_cannot_be_imported_is_named():
    class Sorted(nn.Module):
        def forward(self, obs):
            return obs.sort().values

    with pytest.raises(actq.Error, match="Sorted: "):
        actq.import_policy(Sorted(), torch.zeros(1, 12))
    with pytest.raises(actq.Error, match=r"Linear: pass an example of the module's input, as torch.zeros\(1, n_obs\)"):
        actq.import_policy(nn.Linear(12, 4))
    with pytest.raises(actq.Error, match="Linear: torch cannot export the module"):
        actq.import_policy(nn.Linear(12, 4), torch.zeros(1, 5))
