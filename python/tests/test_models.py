"""Trained models as they are: their own prediction is that of the policy, limits are the caller's."""

import numpy as np
import pytest

import actq

torch = pytest.importorskip("torch", reason="torch is not installed (requirements-optional.txt)")


def linear(values=3, actions=2):
    torch.manual_seed(1)
    return torch.nn.Sequential(torch.nn.Linear(values, 8), torch.nn.ReLU(), torch.nn.Linear(8, actions))


def test_a_policy_runs_in_f32():
    module, observations = linear(), np.random.default_rng(1).normal(size=(5, 3)).astype(np.float32)
    policy = actq.import_policy(module, torch.zeros(1, 3))
    expected = module(torch.from_numpy(observations)).detach().numpy()
    np.testing.assert_allclose(policy(observations), expected, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(policy(observations[0]), expected[0], rtol=1e-5, atol=1e-6)
    with pytest.raises(actq.Error, match=r"the observations have the shape \[5, 2\]; use \[3\] for one, or \[steps, 3\]"):
        policy(observations[:, :2])


def test_a_policy_refuses_what_is_not_finite():
    policy = actq.import_policy(linear(), torch.zeros(1, 3), low=-1, high=1)
    rows = np.zeros((4, 3), np.float32)
    rows[2, 1] = np.nan
    with pytest.raises(actq.Error, match="observation value 1 of step 2 is not finite"):
        policy(rows)
    with pytest.raises(actq.Error, match="observation value 0 of step 0 is not finite"):
        policy([np.inf, 0, 0])
    # A value that is infinite inside, less another one: a limit would hide it.
    opposite = torch.nn.Linear(2, 1)
    with torch.no_grad():
        opposite.weight.copy_(torch.tensor([[1.0, -1.0]]))
    network = torch.nn.Sequential(torch.nn.Linear(1, 2), torch.nn.ReLU(), opposite)
    with torch.no_grad():
        network[0].weight.copy_(torch.tensor([[3.0], [2.0]]))
    policy = actq.import_policy(network, torch.zeros(1, 1), low=-1, high=1)
    with pytest.raises(actq.Error, match="step 1: a value inside the network exceeds float32"):
        policy([[1.0], [3e38]])


def test_limits_and_rate_become_the_policys():
    module, observations = linear(), 5 * np.random.default_rng(1).normal(size=(50, 3)).astype(np.float32)
    free = actq.import_policy(module, torch.zeros(1, 3))
    policy = actq.import_policy(module, torch.zeros(1, 3), low=[-0.5, -0.1], high=0.25, max_step=0.01, rate_hz=200)
    assert policy.rate_hz == 200 and policy.digest != free.digest
    np.testing.assert_array_equal(policy(observations), np.clip(free(observations), np.float32([-0.5, -0.1]), np.float32(0.25)))
    assert np.ptp(free(observations)) > 1, "limits change the actions"
    image = actq.quantize(policy, bits=8, method="rtn", progress=False)
    assert image.rate_hz == 200
    actions = np.stack([head(row) for head in [actq.Head(image)] for row in observations])
    assert np.abs(np.diff(actions, axis=0)).max() <= 0.01 + 1e-6
    # Of two limits, the stricter one.
    bounded = actq.import_policy(torch.nn.Sequential(linear(), torch.nn.Tanh()), torch.zeros(1, 3), low=-2, high=0.5)
    head = actq.Head(actq.quantize(bounded, bits=8, method="rtn", progress=False))
    found = np.stack([head(row) for row in 100 * observations])
    assert found.min() >= -1 and found.max() == 0.5


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"low": [1, 2, 3]}, "low has 3 values for 2 actions; give one for each, or one for all"),
        ({"low": 1, "high": 0}, "low of action 0 is 1.0, above its high, 0.0"),
        ({"high": float("nan")}, r"high\[0\] is NaN"),
        ({"max_step": [1, 0]}, r"max_step\[1\] is 0.0; it must be above 0"),
        ({"rate_hz": 0}, "rate_hz is 0; pass a number above 0"),
        ({"low": "a"}, "low: could not convert string to float"),
    ],
)
def test_bad_limits_are_refused(given, why):
    with pytest.raises(actq.Error, match=why):
        actq.import_policy(linear(), torch.zeros(1, 3), **given)


def test_limits_without_a_common_value_are_refused():
    with pytest.raises(actq.Error, match="no value of action 0 is within 2.0 to 3.0, as you state, and within -1.0 to 1.0"):
        actq.import_policy(torch.nn.Sequential(linear(), torch.nn.Tanh()), torch.zeros(1, 3), low=2, high=3)


class Agent(torch.nn.Module):
    """As CleanRL writes it."""

    def __init__(self):
        super().__init__()
        self.critic, self.actor_mean = linear(3, 1), linear()
        self.actor_logstd = torch.nn.Parameter(torch.zeros(1, 2))

    def get_action_and_value(self, x):
        mean = self.actor_mean(x)
        return torch.distributions.Normal(mean, self.actor_logstd.exp()).sample(), self.critic(x)


class SacActor(torch.nn.Module):
    """As CleanRL writes it."""

    def __init__(self):
        super().__init__()
        self.fc1, self.fc_mean, self.fc_logstd = linear(3, 8), torch.nn.Linear(8, 2), torch.nn.Linear(8, 2)
        self.register_buffer("action_scale", torch.tensor([2.0, 3.0]))
        self.register_buffer("action_bias", torch.tensor([0.0, 1.0]))

    def get_action(self, x):
        x = torch.relu(self.fc1(x))
        mean = self.fc_mean(x)
        drawn = torch.distributions.Normal(mean, self.fc_logstd(x).exp()).rsample()
        scaled = [torch.tanh(value) * self.action_scale + self.action_bias for value in (drawn, mean)]
        return scaled[0], drawn, scaled[1]


def test_agents_of_cleanrl_give_their_mean():
    observations = np.random.default_rng(1).normal(size=(20, 3)).astype(np.float32)
    agent, actor = Agent(), SacActor()
    with torch.no_grad():
        for policy, expected in [
            (actq.import_policy(agent), agent.actor_mean(torch.from_numpy(observations))),
            (actq.import_policy(actor), actor.get_action(torch.from_numpy(observations))[2]),
        ]:
            np.testing.assert_allclose(policy(observations), expected.numpy(), rtol=1e-5, atol=1e-5)


def test_agents_that_choose_give_centred_scores():
    class Chooser(torch.nn.Module):
        def __init__(self):
            super().__init__()
            self.critic, self.actor = linear(3, 1), linear(3, 4)

        def get_action_and_value(self, x):
            return torch.distributions.Categorical(logits=self.actor(x)).sample(), self.critic(x)

    agent, observations = Chooser(), np.random.default_rng(1).normal(size=(20, 3)).astype(np.float32)
    with torch.no_grad():
        agent.actor[-1].bias.add_(50)
    scores = agent.actor(torch.from_numpy(observations)).detach().numpy()
    expected = scores - scores.mean(axis=1, keepdims=True)
    np.testing.assert_allclose(actq.import_policy(agent)(observations), expected, rtol=1e-4, atol=1e-4)


def test_agents_with_more_than_an_actor_are_refused():
    class Trunk(Agent):
        def __init__(self):
            super().__init__()
            self.network = torch.nn.Linear(3, 3)

        def get_action_and_value(self, x):
            return super().get_action_and_value(self.network(x))

    with pytest.raises(actq.Error, match="Trunk: the agent computes before its actor; pass a module that returns the mean action"):
        actq.import_policy(Trunk())

    class Wide(Agent):
        def __init__(self):
            super().__init__()
            self.network = torch.nn.Linear(6, 3)

        def get_action_and_value(self, x):
            return super().get_action_and_value(self.network(x))

    class Recurrent(Agent):
        def get_action_and_value(self, x, lstm_state, done):
            return super().get_action_and_value(x)

    for agent, why in [(Wide, "mat1 and mat2"), (Recurrent, "missing 2 required positional arguments")]:
        with pytest.raises(actq.Error, match=f"the agent computes before its actor .*{why}.*; pass a module that returns the mean"):
            actq.import_policy(agent())

    class Whole(Agent):
        def forward(self, x):
            return 2 * self.actor_mean(x)

    agent, observations = Whole(), np.ones((2, 3), np.float32)
    expected = 2 * agent.actor_mean(torch.ones(2, 3)).detach().numpy()
    np.testing.assert_allclose(actq.import_policy(agent, torch.zeros(1, 3))(observations), expected, rtol=1e-5)


def test_agents_stay_as_they_are():
    agent = Agent()
    agent.actor_mean.append(torch.nn.BatchNorm1d(2))
    before = {key: value.clone() for key, value in agent.state_dict().items()}
    actq.import_policy(agent)
    assert agent.training and all(torch.equal(value, before[key]) for key, value in agent.state_dict().items())


def test_runners_of_rsl_rl_give_their_policy(caplog):
    runners = pytest.importorskip("rsl_rl.runners", reason="rsl-rl-lib is not installed")
    tensordict = pytest.importorskip("tensordict")

    class Env:
        num_envs, num_actions, max_episode_length, device, cfg = 2, 2, 10, "cpu", {}
        episode_length_buf = torch.zeros(2)

        def __init__(self, height):
            self.height = height

        def get_observations(self):
            return tensordict.TensorDict({"policy": torch.randn(2, 3), "height": torch.randn(2, *self.height)}, batch_size=[2])

    cnn = {"output_channels": [2], "kernel_size": [3], "stride": [2], "activation": "elu"}
    cell = {"rnn_hidden_dim": 6, "rnn_num_layers": 1}

    gaussian = {"class_name": "GaussianDistribution", "init_std": 1.0, "std_type": "scalar"}

    def runner(name, env, more, distribution=gaussian, groups=("policy", "height")):
        torch.manual_seed(2)
        network = {"hidden_dims": [8], "activation": "elu", "obs_normalization": True}
        made = runners.OnPolicyRunner(
            env,
            {
                "algorithm": {"class_name": "PPO", "rnd_cfg": None, "symmetry_cfg": None},
                "actor": {"class_name": name, "distribution_cfg": distribution, **network, **more},
                "critic": {"class_name": "MLPModel", **network},
                "obs_groups": {"actor": list(groups), "critic": ["policy"]},
                "num_steps_per_env": 4,
                "save_interval": 10,
            },
            log_dir=None,
        )
        for _ in range(5):
            made.alg.get_policy().update_normalization(env.get_observations() * 3 + 2)
        return made

    for name, height, more in [
        ("MLPModel", (4,), {}),
        ("RNNModel", (4,), {"rnn_type": "lstm", **cell}),
        ("RNNModel", (4,), {"rnn_type": "gru", **cell}),
        ("CNNModel", (1, 5, 5), {"cnn_cfg": cnn}),
    ]:
        env, values = Env(height), 3 + int(np.prod(height))
        made = runner(name, env, more)
        # As after training.
        made.alg.get_policy()(env.get_observations(), stochastic_output=True)
        policy = actq.import_policy(made)
        assert (policy.obs_len, policy.act_len) == (values, 2)
        own = made.get_inference_policy(device="cpu")
        own.reset()
        rows = np.random.default_rng(1).normal(size=(9, values)).astype(np.float32)
        with torch.no_grad():
            steps = [(x[:, :3], x[:, 3:].reshape(1, *height)) for x in torch.from_numpy(rows)[:, None]]
            given = [tensordict.TensorDict({"policy": proprioception, "height": scan}, [1]) for proprioception, scan in steps]
            expected = np.concatenate([own(x).numpy() for x in given])
        np.testing.assert_allclose(policy(rows), expected, rtol=1e-4, atol=1e-5)

    caplog.clear()
    env = Env((1, 5, 5))
    policy = actq.import_policy(runner("CNNModel", env, {"cnn_cfg": cnn}, groups=("height", "policy")))
    assert "OnPolicyRunner: an observation is the groups policy, height [1, 5, 5]: those of images are last" in caplog.text
    assert policy.obs_len == 28

    # As the wrapper of Isaac Lab has it.
    env = Env((4,))
    env.clip_actions = 0.5
    made, rows = runner("MLPModel", env, {}), 100 * np.random.default_rng(1).normal(size=(50, 7)).astype(np.float32)
    free = runner("MLPModel", Env((4,)), {})
    assert np.abs(actq.import_policy(free)(rows)).max() > 0.5, "the limits change actions"
    limited = actq.import_policy(made, low=[-2, -0.1], high=0.25)(rows)
    assert (limited.min(axis=0) == np.float32([-0.5, -0.1])).all() and (limited.max(axis=0) == 0.25).all()
    with pytest.raises(actq.Error, match="no value of action 1 is within your limits and those of the action space, -0.5 to 0.5"):
        actq.import_policy(made, low=[-1, 0.75])
    with pytest.raises(actq.Error, match="the action of BetaDistribution is alpha / .*, a quotient of values, which no kernel computes"):
        actq.import_policy(runner("MLPModel", Env((4,)), {}, {"class_name": "BetaDistribution"}))


def test_what_a_policy_has_of_a_module_is_said(caplog):
    class Parts(torch.nn.Module):
        def __init__(self):
            super().__init__()
            self.actor, self.force = linear(), linear()

        def forward(self, x, y):
            return self.force(x), self.actor(x + 2 * y)

    with caplog.at_level("INFO", "actq"):
        given, outputs = (torch.zeros(1, 3), torch.zeros(1, 3)), ["reaction_force", "action"]
        policy = actq.import_policy(Parts(), given, input_names=["b", "a"], output_names=outputs)
    assert policy.ports.splitlines() == [
        "input     obs[0:3] = b",
        "          obs[3:6] = a",
        "output    action, 2 values",
        "cut       outputs reaction_force: only the action is kept",
    ]
    assert policy.ports.rstrip() in caplog.text and policy.refused == []
