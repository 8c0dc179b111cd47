"""Policies of Stable-Baselines3: the deterministic action of `predict`."""

import numpy as np
import pytest

import actq

torch = pytest.importorskip("torch", reason="torch is not installed (requirements-optional.txt)")
sb3 = pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed (requirements-optional.txt)")
gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed")
spaces = gymnasium.spaces

WIDE = spaces.Box(np.array([-2, 0, -5], np.float32), np.array([2, 1, 7], np.float32))


class Env(gymnasium.Env):
    metadata = {}
    observation_space = spaces.Box(-1, 1, (17,))

    def __init__(self, actions):
        self.action_space = actions


def model(algorithm, actions, **options):
    torch.manual_seed(0)
    made = getattr(sb3, algorithm)("MlpPolicy", Env(actions), seed=0, device="cpu", **options)
    with torch.no_grad():
        for parameter in made.policy.parameters():
            parameter.add_(0.1 * torch.randn_like(parameter))
    return made


def image_of(policy):
    imported = actq.import_policy(policy, torch.zeros(1, 17))
    return actq.Head(actq.quantize(imported, bits=8, method="rtn", activations=16, progress=False))


@pytest.mark.parametrize(
    ("algorithm", "options"), [("PPO", {}), ("A2C", {"use_sde": True}), ("SAC", {"buffer_size": 9}), ("TD3", {"buffer_size": 9})]
)
def test_a_policy_is_its_predicted_action(algorithm, options):
    made = model(algorithm, WIDE, **options)
    observations = np.random.default_rng(0).normal(size=(200, 17)).astype(np.float32)
    expected, _ = made.policy.predict(observations, deterministic=True)
    for policy in [made.policy] + ([made.policy.actor] if hasattr(made.policy, "actor") else []):
        found = image_of(policy)(observations)
        assert found.shape == (200, 3), "the critic's value has the shape (200, 1)"
        error = ((found - expected) ** 2).mean(axis=0) / expected.var(axis=0)
        assert error.max() < 0.02
        assert (found >= WIDE.low).all() and (found <= WIDE.high).all()


@pytest.mark.parametrize(("algorithm", "options"), [("PPO", {}), ("DQN", {"buffer_size": 9})])
def test_scores_choose_the_predicted_action(algorithm, options):
    made = model(algorithm, spaces.Discrete(4), **options)
    observations = np.random.default_rng(0).normal(size=(200, 17)).astype(np.float32)
    expected, _ = made.policy.predict(observations, deterministic=True)
    assert (image_of(made.policy)(observations).argmax(axis=1) == expected).mean() > 0.97


def test_other_objects_are_refused_with_the_right_one(tmp_path):
    made = model("PPO", WIDE)
    with pytest.raises(actq.Error, match="the policy is of type PPO; pass model.policy"):
        actq.import_policy(made, torch.zeros(1, 17))
    with pytest.raises(actq.Error, match=r"output_0 \(64 values\), output_1 \(64 values\); choose one"):
        actq.import_policy(made.policy.mlp_extractor, torch.zeros(1, 17))
    made.save(tmp_path / "model.zip")
    with pytest.raises(actq.Error, match="load it with Stable-Baselines3, and pass model.policy"):
        actq.import_policy(tmp_path / "model.zip", torch.zeros(1, 17))
    with pytest.raises(actq.Error, match="pass a module of the policy's actor that returns its scores"):
        actq.import_policy(model("PPO", spaces.MultiDiscrete([2, 3])).policy, torch.zeros(1, 17))


def test_an_other_prediction_is_refused():
    made = model("PPO", WIDE)
    predict = type(made.policy).predict

    class Doubled(type(made.policy)):
        def predict(self, *given, **options):
            actions, state = predict(self, *given, **options)
            return 2 * actions, state

    made.policy.__class__ = Doubled
    with pytest.raises(actq.Error, match="policy.predict gives other actions"):
        actq.import_policy(made.policy, torch.zeros(1, 17))


def test_an_exported_policy_asks_for_the_action(tmp_path):
    """As torch.onnx.export writes it, which draws the action."""
    file = tmp_path / "policy.onnx"
    made = model("PPO", WIDE)
    torch.onnx.export(made.policy, (torch.zeros(1, 17),), str(file), opset_version=17, dynamo=False)
    with pytest.raises(actq.Error, match=r"no other output is named action; choose one by .* \(1 values\)"):
        actq.import_policy(file)
