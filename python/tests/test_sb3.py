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
    return moved(getattr(sb3, algorithm)("MlpPolicy", Env(actions), seed=0, device="cpu", **options))


def moved(made):
    """Changes the weights: those of an untrained last layer give hardly any action."""
    with torch.no_grad():
        for parameter in made.policy.parameters():
            parameter.add_(0.1 * torch.randn_like(parameter))
    return made


def test_a_new_model_has_the_limits_of_its_action_space():
    policy = actq.import_policy(sb3.PPO("MlpPolicy", Env(WIDE), seed=0, device="cpu"))
    lines = [line.split() for line in actq.quantize(policy, bits=8, method="rtn", progress=False).inspect().splitlines()]
    i = lines.index(["action", "low", "high"])
    assert [line[1:] for line in lines[i + 1 : i + 4]] == [["-2", "2"], ["0", "1"], ["-5", "7"]], "a controller can arm"
    narrow = actq.import_policy(sb3.PPO("MlpPolicy", Env(WIDE), seed=0, device="cpu").policy, torch.zeros(1, 17), high=[1, 2, 3])
    random = 1e3 * np.random.default_rng(0).normal(size=(200, 17)).astype(np.float32)
    assert (narrow(random) <= [1, 1, 3]).all() and (narrow(random) >= WIDE.low).all()
    with pytest.raises(actq.Error, match="PPO: no value of action 0 is within your limits and those of the action space, -2.0 to 2.0"):
        actq.import_policy(sb3.PPO("MlpPolicy", Env(WIDE), seed=0, device="cpu"), low=3)
    with pytest.raises(actq.Error, match="PPO: the actions are scores, of which the largest is chosen; they take no low"):
        actq.import_policy(sb3.PPO("MlpPolicy", Env(spaces.Discrete(3)), seed=0, device="cpu"), low=-1)
    with pytest.raises(actq.Error, match="PPO: 2 limits for 3 actions; give one for each, or one for all"):
        actq.import_policy(sb3.PPO("MlpPolicy", Env(WIDE), seed=0, device="cpu"), low=[0, 1])


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


@pytest.mark.parametrize(("algorithm", "options", "last"), [("PPO", {}, "action_net"), ("DQN", {"buffer_size": 9}, "q_net.q_net.4")])
def test_an_image_does_not_learn_what_all_scores_have_in_common(algorithm, options, last):
    made = model(algorithm, spaces.Discrete(4), **options)
    layer = made.policy.get_submodule(last)
    with torch.no_grad():
        layer.weight.add_(10 * torch.randn(1, layer.in_features))
        layer.bias.add_(100)
    before, observations = layer.weight.clone(), np.random.default_rng(0).normal(size=(300, 17)).astype(np.float32)
    expected, _ = made.policy.predict(observations, deterministic=True)
    for policy in (actq.import_policy(made), actq.import_policy(made.policy, torch.zeros(1, 17))):
        assert np.abs(policy(observations).mean(axis=1)).max() < 1e-4 and len(set(expected)) > 1
        image = actq.quantize(policy, bits=8, method="rtn", activations=16, progress=False)
        assert (actq.Head(image)(observations).argmax(axis=1) == expected).mean() > 0.95
    assert torch.equal(layer.weight, before), "the model stays as it is"


def test_other_objects_are_refused_with_the_right_one(tmp_path):
    made = model("PPO", WIDE)
    with pytest.raises(actq.Error, match="the policy is of type object; pass a path, a torch.nn.Module or a trained model"):
        actq.import_policy(object(), torch.zeros(1, 17))
    with pytest.raises(actq.Error, match=r"output_0 \(64 values\), output_1 \(64 values\); choose one"):
        actq.import_policy(made.policy.mlp_extractor, torch.zeros(1, 17))
    made.save(tmp_path / "model.zip")
    with pytest.raises(actq.Error, match="load it with Stable-Baselines3 and its environment.*and pass the model"):
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


class Parts(gymnasium.Env):
    metadata = {}
    observation_space = spaces.Dict({"joints": spaces.Box(-9, 9, (4,)), "aim": spaces.Box(-9, 9, (3,))})
    action_space = WIDE


def vectorized(env, stacked, is_outside):
    from stable_baselines3.common import vec_env

    made = vec_env.DummyVecEnv([lambda: env])
    normalize = lambda env: vec_env.VecNormalize(env, clip_obs=1.5)  # noqa: E731
    stack = lambda env: vec_env.VecFrameStack(env, 3) if stacked else env  # noqa: E731
    return normalize(stack(made)) if is_outside else stack(normalize(made))


@pytest.mark.parametrize("algorithm", ["PPO", "SAC"])
@pytest.mark.parametrize(("stacked", "is_outside"), [(False, True), (True, True), (True, False)])
def test_a_model_has_its_normalization(algorithm, stacked, is_outside):
    env = vectorized(Env(WIDE), stacked, is_outside)
    options = {"buffer_size": 9} if algorithm == "SAC" else {}
    made = moved(getattr(sb3, algorithm)("MlpPolicy", env, seed=0, device="cpu", **options))
    statistics = made.get_vec_normalize_env().obs_rms
    random = np.random.default_rng(3)
    statistics.mean, statistics.var = random.normal(size=statistics.mean.shape), 0.1 + random.random(statistics.mean.shape)
    policy = actq.import_policy(made, name="walker")
    frames = (1 + 2 * random.normal(size=(50, policy.obs_len))).astype(np.float32)
    normalize = made.get_vec_normalize_env().normalize_obs
    of_frames = frames.reshape(50, -1, statistics.mean.shape[-1])
    expected, _ = made.predict(normalize(of_frames).reshape(50, -1), deterministic=True)
    np.testing.assert_allclose(policy(frames), expected, rtol=1e-4, atol=1e-4)
    assert policy.name == "walker" and np.ptp(expected) > 0.1
    assert (policy(100 * frames) <= WIDE.high).all()


def test_a_model_without_its_environment_says_so(caplog, tmp_path):
    model("PPO", WIDE).save(tmp_path / "walker.zip")
    actq.import_policy(sb3.PPO.load(tmp_path / "walker.zip", device="cpu"))
    assert "the model has no environment; if it was trained with VecNormalize, load it with env=VecNormalize.load" in caplog.text


def test_choices_are_normalized_too():
    env = vectorized(Env(spaces.Discrete(4)), True, False)
    made = moved(sb3.PPO("MlpPolicy", env, seed=0, device="cpu"))
    statistics, random = made.get_vec_normalize_env().obs_rms, np.random.default_rng(3)
    statistics.mean, statistics.var = random.normal(size=17), 0.1 + random.random(17)
    policy, frames = actq.import_policy(made), (1 + 2 * random.normal(size=(200, 51))).astype(np.float32)
    normalized = made.get_vec_normalize_env().normalize_obs(frames.reshape(600, 17)).reshape(200, 51)
    expected, _ = made.predict(normalized, deterministic=True)
    assert (policy(frames).argmax(axis=1) == expected).all() and len(set(expected)) > 1


def test_parts_of_an_observation_follow_the_keys_of_the_space():
    env = vectorized(Parts(), False, True)
    env.norm_obs_keys = ["joints"]
    made = moved(sb3.PPO("MultiInputPolicy", env, seed=0, device="cpu"))
    env.obs_rms["joints"].mean[:] = [1, 2, 3, 4]
    policy = actq.import_policy(made)
    rows = np.random.default_rng(1).normal(size=(20, 7)).astype(np.float32)
    ends = {"aim": rows[:, :3], "joints": rows[:, 3:]}
    assert list(made.observation_space.spaces) == ["aim", "joints"]
    expected, _ = made.predict(env.normalize_obs(ends), deterministic=True)
    np.testing.assert_allclose(policy(rows), expected, rtol=1e-4, atol=1e-4)


def test_new_models_are_imported():
    class Narrow(Env):
        observation_space = spaces.Box(-1, 1, (4,))

    for seed in range(4):
        for env in (Env(WIDE), Narrow(spaces.Box(-2, 2, (1,))), Narrow(spaces.Discrete(2))):
            made = sb3.PPO("MlpPolicy", env, seed=seed, device="cpu")
            assert actq.import_policy(made).obs_len == env.observation_space.shape[0]


@pytest.mark.parametrize("algorithm", ["PPO", "SAC", "TD3"])
@pytest.mark.parametrize("shape", [(2, 3), (2, 1)])
def test_actions_of_two_axes_are_flat(algorithm, shape):
    low, high = -1 - np.arange(np.prod(shape)).reshape(shape), 2 + np.ones(shape)
    actions = spaces.Box(low.astype(np.float32), high.astype(np.float32))
    made = model(algorithm, actions, **({} if algorithm == "PPO" else {"buffer_size": 9}))
    observations = np.random.default_rng(0).normal(size=(20, 17)).astype(np.float32)
    expected, _ = made.predict(observations, deterministic=True)
    np.testing.assert_allclose(actq.import_policy(made)(observations), expected.reshape(20, -1), rtol=1e-4, atol=1e-5)


def test_a_normalizer_within_another_is_refused():
    from stable_baselines3.common import vec_env

    class Doubled(vec_env.VecEnvWrapper):
        def reset(self):
            return 2 * self.venv.reset()

        def step_wait(self):
            return self.venv.step_wait()

    normalized = lambda **options: vec_env.VecNormalize(vec_env.DummyVecEnv([lambda: Env(WIDE)]), **options)  # noqa: E731
    of = lambda env: actq.import_policy(moved(sb3.PPO("MlpPolicy", env, seed=0, device="cpu")))  # noqa: E731
    with pytest.raises(actq.Error, match="PPO: the environment has one VecNormalize within another"):
        of(vec_env.VecNormalize(normalized()))
    with pytest.raises(actq.Error, match="PPO: Doubled changes observations after VecNormalize"):
        of(Doubled(normalized()))
    with pytest.raises(actq.Error, match="PPO: the environment stacks frames twice"):
        of(vec_env.VecFrameStack(vec_env.VecFrameStack(normalized(), 2), 2))
    # Only rewards outside, and wrappers that change no observation.
    env = vec_env.VecNormalize(vec_env.VecCheckNan(vec_env.VecMonitor(normalized(clip_obs=0.5))), norm_obs=False)
    policy, rows = of(env), 3 * np.random.default_rng(1).normal(size=(20, 17)).astype(np.float32)
    np.testing.assert_allclose(policy(rows), policy(np.clip(rows, -0.5, 0.5)), rtol=1e-4, atol=1e-4)


def test_parts_and_frames_of_an_observation_are_listed(caplog):
    from stable_baselines3.common import vec_env

    class Planes(Parts):
        observation_space = spaces.Dict(b=spaces.Box(-9, 9, (3,)), a=spaces.Box(-9, 9, (2, 2)))

    env = vec_env.VecFrameStack(vec_env.DummyVecEnv([Planes]), 3)
    policy = actq.import_policy(moved(sb3.PPO("MultiInputPolicy", env, seed=0, device="cpu")))
    assert policy.ports.splitlines()[:2] == ["input     obs[0:12] = a", "          obs[12:21] = b"]
    assert "PPO: an observation is the last 3 frames of each key along the axis that VecFrameStack stacks, the oldest first" in caplog.text
    alone = actq.import_policy(sb3.PPO("MultiInputPolicy", Planes(), seed=0, device="cpu").policy, torch.zeros(1, 7))
    assert alone.ports.splitlines()[:2] == ["input     obs[0:3] = b", "          obs[3:7] = a"], "VecFrameStack sorts the keys"
