"""The examples run."""

import json

import numpy as np
import pytest

import actq
from conftest import ROOT


@pytest.fixture(autouse=True)
def examples(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "python/examples"))


def test_a_policy_in_lerobots_layout(tmp_path):
    """Against LeRobot's arithmetic, which this test writes out."""
    onnx = pytest.importorskip("onnx", reason="onnx is not installed")
    import lerobot_layout

    lerobot_layout.make(tmp_path)
    policy = actq.import_policy(tmp_path, accept_profile=True, answers={"graph.complete": True})
    assert (policy.obs_len, policy.act_len, policy.rate_hz) == (8, 4, 30.0)
    image = actq.quantize(policy, bits=8, activations=16, method="rtn", progress=False)
    raw = (tmp_path / lerobot_layout.BEFORE).read_bytes()
    length = int.from_bytes(raw[:8], "little")
    header, data = json.loads(raw[8 : 8 + length]), raw[8 + length :]
    statistics = {name: np.frombuffer(data[slice(*at["data_offsets"])], "<f4") for name, at in header.items()}
    network = onnx.load(tmp_path / "policy.onnx")
    weights = [onnx.numpy_helper.to_array(tensor) for tensor in network.graph.initializer]
    head, states = actq.Head(image), np.random.default_rng(2).normal(size=(20, 8))
    for state in states:
        x = (state - statistics["observation.state.mean"]) / (statistics["observation.state.std"] + 1e-8)
        for weight in weights:
            x = np.tanh(x @ weight)
        expected = x * statistics["action.std"] + statistics["action.mean"]
        assert np.abs(head(state) - expected).max() < 0.02
    kinds = [(kind, names) for kind, _, names, _ in lerobot_layout.quantize(tmp_path, steps=5).ports]
    assert kinds[1] == ("position", lerobot_layout.JOINTS)


def test_open_questions_are_listed(tmp_path):
    import lerobot_layout

    lerobot_layout.make(tmp_path)
    with pytest.raises(actq.Error) as raised:
        actq.import_policy(tmp_path)
    text = str(raised.value)
    assert "says profile lerobot" in text and "\nthe bundle (family lerobot) leaves 1 question open; " in text


def test_engines_of_the_speed_comparison_agree(tmp_path, monkeypatch):
    pytest.importorskip("torch", reason="torch is not installed (requirements-optional.txt)")
    pytest.importorskip("onnxruntime", reason="onnxruntime is not installed (requirements-optional.txt)")
    import speed

    monkeypatch.setenv("RAYON_NUM_THREADS", "1")
    path, observations = str(tmp_path / "speed.onnx"), np.random.default_rng(0).normal(size=(64, speed.LAYERS[0])).astype(np.float32)
    speed.write_onnx(path)
    engines = {}
    for engine in (speed.by_actq, speed.by_onnxruntime, speed.by_torch):
        engines.update(engine(path, 64, observations, 1))
    ours, by_onnx, by_torch = (engines[name]() for name in ("actq, 2 bits", "onnxruntime, f32", "torch, f32"))
    assert np.abs(by_onnx[0] - by_torch.numpy()).max() < 1e-5
    # 2 bits, not learned: near enough to be the same network.
    assert ours.shape == (64, 12) and np.corrcoef(ours.ravel(), by_onnx[0].ravel())[0, 1] > 0.5


def test_stable_baselines3_in_mujoco():
    for name in ("stable_baselines3", "mujoco"):
        pytest.importorskip(name, reason=f"{name} is not installed (requirements-optional.txt)")
    import mujoco_pendulum

    trained, driven, image = mujoco_pendulum.compare(steps=12_000, frames=9000, bpw=2.0, learning=1000)
    assert image.bits_per_weight <= 2.0
    assert trained > 50 and driven > 0.9 * trained
