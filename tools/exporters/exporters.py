"""Exports small policies by one package, imports them, and compares them with the package's own actions.

    python exporters.py NAME

in an environment with actq, torch 2.15.0, onnxruntime, onnxscript and the package. One function for each package has its cases;
each prints a row: kind | form | outcome. Releases that were read are in docs/records/2026-11-28-exporters.md.
"""

import contextlib
import copy
import io
import logging
import os
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

warnings.filterwarnings("ignore")
logging.disable(logging.WARNING)

#: Steps of an episode of random observations, and the largest error of a correct import, of the largest action.
STEPS, TOLERANCE = 40, 1e-4
OBS, ACT = 12, 4

CASES = {}


def package(function):
    CASES[function.__name__] = function
    return function


def observations(length=OBS):
    return (np.random.default_rng(1).normal(size=(STEPS, length)) * 2 + 0.3).astype(np.float32)


def row(kind, form, make, act=None, width=OBS, discrete=False, **options):
    """Exports by `make`, imports what it returns, and prints the outcome.

    act: the package's own actions at observations [step, value] of one episode; without it, onnxruntime runs the file.
    discrete: the policy gives scores, and the action is the largest.
    """
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            source = make()
            expected = None if act is None else np.asarray(act(observations(width)), np.float64)
    except Exception as error:
        return print(f"{kind} | {form} | export fails: {short(error)}", flush=True)
    import actq

    try:
        policy = actq.import_policy(source, **options)
    except actq.Error as error:
        return print(f"{kind} | {form} | refused: {short(error)}", flush=True)
    rows = observations(policy.obs_len)
    try:
        expected = run_file(source, rows, policy) if expected is None else expected
    except Exception as error:
        return print(f"{kind} | {form} | onnxruntime fails: {short(error)}", flush=True)
    found = policy(rows)
    expected = expected.reshape(len(expected), -1)
    found = found.argmax(axis=1)[:, None] if discrete else found
    # A choice is right or wrong; its number has no size.
    size = 1.0 if discrete else np.abs(expected).max()
    error = np.abs(found - expected).max() / size if found.shape == expected.shape else np.inf
    outcome = f"imports, off by {error:.0e}" if error <= TOLERANCE else f"WRONG: off by {error:.0e} of the largest action"
    print(f"{kind} | {form} | {outcome}", flush=True)


def short(error):
    text = " ".join(str(error).split()) or type(error).__name__
    for folder in (tempfile.gettempdir(), os.getcwd(), sys.prefix):
        text = text.replace(folder + "/", "")
    return text if len(text) < 240 else text[:240] + " .."


def run_file(path, rows, policy):
    """Runs an ONNX file over an episode: outputs that are no action go back into the inputs that the policy does not read."""
    import onnxruntime

    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    inputs = session.get_inputs()
    sizes = {i.name: [n if isinstance(n, int) else 1 for n in i.shape] for i in inputs}
    observed, states, total = [], [], 0
    for i in inputs:
        length = int(np.prod(sizes[i.name]))
        (observed if total + length <= policy.obs_len else states).append(i.name)
        total += length if total + length <= policy.obs_len else 0
    values = {name: np.zeros(sizes[name], np.float32) for name in sizes}
    names, actions = [o.name for o in session.get_outputs()], []
    for obs in rows:
        at = 0
        for name in observed:
            length = int(np.prod(sizes[name]))
            values[name] = obs[at : at + length].reshape(sizes[name])
            at += length
        outputs = session.run(None, values)
        actions.append(outputs[0].reshape(-1))
        for name, value in zip(states, outputs[1:]):
            values[name] = value.reshape(sizes[name])
    return np.stack(actions)


def file(name):
    return str(Path(tempfile.gettempdir(), f"{name}.onnx"))


def by_torch(module, name, dynamo, example=None, **options):
    import torch

    def make():
        path = file(name + "_dynamo" * dynamo)
        inputs = (torch.zeros(1, OBS),) if example is None else example
        torch.onnx.export(module.eval(), inputs, path, dynamo=dynamo, verbose=False, **options)
        return path

    return make


def both(kind, module, act=None, example=None, width=OBS, **options):
    """The rows of a module: itself, and the files of both exporters of torch."""
    import torch

    inputs = (torch.zeros(1, width),) if example is None else example
    own = options.pop("own", options)
    row(kind, "module", lambda: module, act, width, example=inputs if len(inputs) > 1 else inputs[0], **own)
    names = {key: options.pop(key) for key in ("input_names", "output_names") if key in options}
    for dynamo in (False, True):
        make = by_torch(module, kind.replace(" ", "_").replace(",", ""), dynamo, inputs, **names)
        row(kind, "torch.onnx, " + ("dynamo" if dynamo else "tracing"), make, act, width, **options)


def acts(function, states=()):
    """Actions of a function of one observation [1, value] in torch, and of its states if it has any."""
    import torch

    def run(rows):
        with torch.no_grad():
            if states:
                return episode(rows, function, states)
            return [function(torch.from_numpy(obs[None])).reshape(-1).numpy() for obs in rows]

    return run


def episode(rows, function, states):
    import torch

    actions = []
    for obs in rows:
        action, *states = function(torch.from_numpy(obs[None]), *states)
        actions.append(action.reshape(-1).numpy())
    return actions


def recurrent(kind, module, count):
    """The rows of a module (obs, states ..) -> (action, states ..) with states [1, 1, 16]."""
    import torch

    zeros = [torch.zeros(1, 1, 16) for _ in range(count)]
    pairs = {f"h{i}": f"h{i}_next" for i in range(count)}
    ports = {"input_names": ["obs", *pairs], "output_names": ["action", *pairs.values()]}
    both(kind, module, acts(module, zeros), (torch.zeros(1, OBS), *zeros), states=pairs, own={"states": pairs, **ports}, **ports)


@package
def torch():
    import torch
    from torch import nn

    def mlp(*middle, out=ACT):
        return nn.Sequential(nn.Linear(OBS, 24), *middle, nn.Linear(24, out))

    class Residual(nn.Module):
        def __init__(self):
            super().__init__()
            self.a, self.b, self.c = nn.Linear(OBS, 24), nn.Linear(24, 24), nn.Linear(24, ACT)

        def forward(self, x):
            x = nn.functional.silu(self.a(x))
            return self.c(x + nn.functional.gelu(self.b(x)))

    class Recurrent(nn.Module):
        def __init__(self, cell):
            super().__init__()
            self.cell, self.out = cell(OBS, 16), nn.Linear(16, ACT)

        def forward(self, x, *state):
            y, state = self.cell(x[None], state if len(state) > 1 else state[0])
            return (self.out(y[0]), *(state if isinstance(state, tuple) else (state,)))

    class Chunk(nn.Module):
        def __init__(self):
            super().__init__()
            self.net = mlp(nn.ReLU(), out=8 * ACT)

        def forward(self, x):
            return self.net(x).reshape(1, 8, ACT)

    class Flow(nn.Module):
        def __init__(self):
            super().__init__()
            self.net = nn.Sequential(nn.Linear(OBS + ACT + 1, 24), nn.SiLU(), nn.Linear(24, ACT))

        def forward(self, x, noise):
            for step in range(4):
                time = torch.full((1, 1), step / 4)
                noise = noise + self.net(torch.cat([x, noise, time], 1)) / 4
            return noise

    class Convolution(nn.Module):
        def __init__(self):
            super().__init__()
            self.conv, self.out = nn.Conv1d(1, 4, 3), nn.Linear(4 * (OBS - 2), ACT)

        def forward(self, x):
            return self.out(torch.relu(self.conv(x[:, None])).flatten(1))

    def action(module, x):
        return module.eval()(x)

    for kind, module in [
        ("MLP, ELU", mlp(nn.ELU())),
        ("MLP, tanh action", nn.Sequential(mlp(nn.ReLU()), nn.Tanh())),
        ("layer norm, SiLU", mlp(nn.LayerNorm(24), nn.SiLU())),
        ("RMS norm, mish", mlp(nn.RMSNorm(24), nn.Mish())),
        ("batch norm, GELU", mlp(nn.BatchNorm1d(24), nn.GELU())),
        ("residual", Residual()),
        ("chunk", Chunk()),
        ("convolution", Convolution()),
    ]:
        both(kind, module, acts(lambda x, m=module: action(m, x)))
    for kind, cell, count in (("LSTM", nn.LSTM, 2), ("GRU", nn.GRU, 1)):
        recurrent(kind, Recurrent(cell), count)
    module = Flow().eval()
    names = {"input_names": ["obs", "noise"], "output_names": ["action"]}
    example = (torch.zeros(1, OBS), torch.zeros(1, ACT))
    both("flow, noise as input", module, acts(lambda x: module(x[:, :OBS], x[:, OBS:])), example, OBS + ACT, **names, own=names)


@package
def stable_baselines3():
    import gymnasium
    import torch
    from gymnasium import spaces
    from stable_baselines3 import DQN, PPO, SAC, TD3
    from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

    box = spaces.Box(-np.inf, np.inf, (OBS,), np.float32)
    parts = spaces.Dict({"goal": spaces.Box(-9, 9, (2,)), "joints": spaces.Box(-9, 9, (OBS - 2,))})

    class Env(gymnasium.Env):
        def __init__(self, discrete=False, observed=box):
            self.observation_space = observed
            self.action_space = spaces.Discrete(3) if discrete else spaces.Box(-2.0, 3.0, (ACT,), np.float32)

        def reset(self, seed=None, options=None):
            return self.observation_space.sample(), {}

        def step(self, action):
            return self.observation_space.sample(), 0.0, False, False, {}

    def vec(**options):
        return VecNormalize(DummyVecEnv([lambda: Env(**options)]))

    # SAC writes into its policy_kwargs.
    short_ppo = {"n_steps": 16, "batch_size": 16, "policy_kwargs": {"net_arch": [16, 16]}}
    small = {"buffer_size": 10, "policy_kwargs": {"net_arch": [16, 16]}}
    for kind, make in [
        ("PPO", lambda: PPO("MlpPolicy", Env(), **short_ppo)),
        ("PPO, VecNormalize", lambda: PPO("MlpPolicy", vec(), **short_ppo).learn(64)),
        ("PPO, Dict", lambda: PPO("MultiInputPolicy", Env(observed=parts), **short_ppo)),
        ("PPO, Discrete", lambda: PPO("MlpPolicy", Env(discrete=True), **short_ppo)),
        ("SAC, squashed", lambda: SAC("MlpPolicy", Env(), **copy.deepcopy(small))),
        ("TD3, squashed", lambda: TD3("MlpPolicy", Env(), **small)),
        ("DQN, Discrete", lambda: DQN("MlpPolicy", Env(discrete=True), **small)),
    ]:
        made = []

        def model(make=make, made=made):
            torch.manual_seed(0)
            made[:] = made or [make()]
            return made[0]

        def predict(rows, model=model):
            m = model()
            scale = m.get_vec_normalize_env()
            out = []
            for obs in rows:
                obs = {"goal": obs[:2], "joints": obs[2:]} if isinstance(m.observation_space, spaces.Dict) else obs
                obs = obs if scale is None else scale.normalize_obs(obs)
                out.append(m.predict(obs, deterministic=True)[0])
            return out

        row(kind, "model", model, predict, discrete="Discrete" in kind)
        if kind == "PPO":
            policy = model().policy

            class Deterministic(torch.nn.Module):
                def __init__(self, policy):
                    super().__init__()
                    self.policy = policy

                def forward(self, obs):
                    return self.policy._predict(obs, deterministic=True)

            both("PPO, its _predict", Deterministic(policy), acts(lambda x: policy._predict(x, deterministic=True)))
            row("PPO, as its docs export", "torch.onnx, tracing", by_torch(policy, "sb3_ppo", False))


@package
def rsl_rl():
    import torch
    from rsl_rl.env import VecEnv
    from rsl_rl.runners import OnPolicyRunner
    from tensordict import TensorDict

    class Env(VecEnv):
        num_envs, num_actions, max_episode_length, device, cfg = 4, ACT, 100, "cpu", {}

        def __init__(self, groups):
            self.groups, self.episode_length_buf = groups, torch.zeros(4, dtype=torch.long)

        def get_observations(self):
            groups = {name: torch.randn(4, *shape) * 2 + 0.5 for name, shape in self.groups.items()}
            return TensorDict(groups, batch_size=[4])

        def step(self, actions):
            return self.get_observations(), torch.randn(4), torch.zeros(4), {}

    algorithm = {
        "class_name": "PPO", "num_learning_epochs": 1, "num_mini_batches": 1, "clip_param": 0.2, "gamma": 0.99, "lam": 0.95,
        "value_loss_coef": 1.0, "entropy_coef": 0.0, "learning_rate": 1e-3, "max_grad_norm": 1.0,
        "use_clipped_value_loss": True, "schedule": "fixed", "desired_kl": 0.01, "rnd_cfg": None, "symmetry_cfg": None,
    }  # fmt: skip
    normal = {"class_name": "GaussianDistribution", "init_std": 1.0}

    def runner(groups, **actor):
        actor = {"class_name": "MLPModel", "hidden_dims": [24, 16], "activation": "elu", "distribution_cfg": normal, **actor}
        critic = {"class_name": "MLPModel", "hidden_dims": [16], "activation": "elu"}
        observed = {"actor": list(groups), "critic": ["policy"]}
        cfg = {
            "num_steps_per_env": 4, "save_interval": 50, "obs_groups": observed, "actor": actor, "critic": critic,
            "algorithm": algorithm,
        }  # fmt: skip
        made = OnPolicyRunner(Env(groups), cfg, None, "cpu")
        made.alg.train_mode()
        for _ in range(3):
            made.alg.get_policy().update_normalization(made.env.get_observations())
        made.alg.eval_mode()
        return made

    flat, norm = {"policy": (OBS,)}, {"obs_normalization": True}
    rnn = {"class_name": "RNNModel", "rnn_hidden_dim": 16, **norm}
    cnn = {"output_channels": [4, 8], "kernel_size": [3, 3], "stride": [2, 2], "activation": "elu"}
    for kind, groups, actor in [
        ("MLP", flat, {}),
        ("MLP, normalizer", flat, norm),
        ("MLP, two groups", {"policy": (8,), "goal": (4,)}, norm),
        ("MLP, state-dependent deviation", flat, {"distribution_cfg": {**normal, "class_name": "HeteroscedasticGaussianDistribution"}}),
        ("MLP, Beta", flat, {"distribution_cfg": {"class_name": "BetaDistribution"}}),
        ("LSTM", flat, {**rnn, "rnn_type": "lstm", "rnn_num_layers": 1}),
        ("LSTM, two layers", flat, {**rnn, "rnn_type": "lstm", "rnn_num_layers": 2}),
        ("GRU", flat, {**rnn, "rnn_type": "gru", "rnn_num_layers": 1}),
        ("CNN with proprioception", {"policy": (OBS,), "height": (1, 9, 9)}, {"class_name": "CNNModel", "cnn_cfg": cnn, **norm}),
    ]:
        made = []

        def own(groups=groups, actor=actor, made=made):
            torch.manual_seed(0)
            made[:] = made or [runner(groups, **actor)]
            return made[0]

        def act(rows, own=own, groups=groups):
            policy = own().get_inference_policy("cpu")
            policy.reset(torch.ones(1, dtype=torch.bool)) if hasattr(policy, "reset") else None
            actions, sizes = [], [int(np.prod(shape)) for shape in groups.values()]
            for obs in torch.from_numpy(rows):
                parts = zip(groups, obs[None].split(sizes, dim=1), groups.values())
                given = TensorDict({name: part.reshape(1, *shape) for name, part, shape in parts}, batch_size=[1])
                with torch.no_grad():
                    actions.append(policy(given).reshape(-1).numpy())
            return actions

        def onnx(own=own, kind=kind):
            path = Path(file(f"rsl_rl_{kind.replace(' ', '_').replace(',', '')}"))
            own().export_policy_to_onnx(str(path.parent), path.name)
            return str(path)

        width = sum(int(np.prod(shape)) for shape in groups.values())
        row(kind, "runner", own, act, width)
        made.clear()
        row(kind, "export_policy_to_onnx", onnx, act, width)


@package
def skrl():
    import torch
    from gymnasium import spaces
    from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
    from skrl.resources.preprocessors.torch import RunningStandardScaler
    from torch import nn

    space, actions = spaces.Box(-np.inf, np.inf, (OBS,)), spaces.Box(-1.0, 1.0, (ACT,))

    class Gaussian(GaussianMixin, Model):
        def __init__(self, **options):
            Model.__init__(self, observation_space=space, action_space=actions, device="cpu")
            GaussianMixin.__init__(self, **options)
            self.net = nn.Sequential(nn.Linear(OBS, 24), nn.ELU(), nn.Linear(24, ACT))
            self.log_std_parameter = nn.Parameter(torch.zeros(ACT))

        def compute(self, inputs, role=""):
            return self.net(inputs["observations"]), {"log_std": self.log_std_parameter}

    class Deterministic(DeterministicMixin, Model):
        def __init__(self):
            Model.__init__(self, observation_space=space, action_space=actions, device="cpu")
            DeterministicMixin.__init__(self)
            self.net = nn.Sequential(nn.Linear(OBS, 24), nn.ReLU(), nn.Linear(24, ACT), nn.Tanh())

        def compute(self, inputs, role=""):
            return self.net(inputs["observations"]), {}

    class Step(nn.Module):
        """The mean action of a model after its preprocessor, as skrl's agents evaluate it."""

        def __init__(self, model, scaler=None):
            super().__init__()
            self.model, self.scaler = model, scaler

        def forward(self, obs):
            obs = obs if self.scaler is None else self.scaler(obs)
            action, outputs = self.model.act({"observations": obs}, role="policy")
            return outputs.get("mean_actions", action)

    scaler = RunningStandardScaler(size=OBS, device="cpu")
    scaler(torch.randn(200, OBS) * 3 + 1, train=True)
    for kind, module in [
        ("Gaussian", Step(Gaussian())),
        ("Gaussian, clipped mean", Step(Gaussian(clip_mean_actions=True))),
        ("Gaussian, RunningStandardScaler", Step(Gaussian(), scaler)),
        ("deterministic, tanh", Step(Deterministic())),
    ]:
        both(kind, module, acts(lambda x, m=module: m(x)))


@package
def rl_games():
    import torch
    from rl_games.algos_torch.model_builder import ModelBuilder

    def model(**more):
        zeros, default = {"name": "const_initializer", "val": 0}, {"name": "default"}
        continuous = {
            "mu_activation": "None", "sigma_activation": "None", "mu_init": default, "sigma_init": zeros, "fixed_sigma": True,
        }  # fmt: skip
        network = {
            "name": "actor_critic", "separate": False, "space": {"continuous": continuous},
            "mlp": {"units": [24, 16], "activation": "elu", "d2rl": False, "initializer": default}, **more,
        }  # fmt: skip
        made = ModelBuilder().load({"model": {"name": "continuous_a2c_logstd"}, "network": network}).build({
            "actions_num": ACT, "input_shape": (OBS,), "num_seqs": 1, "value_size": 1, "normalize_value": True,
            "normalize_input": True,
        })  # fmt: skip
        made.train()
        made.norm_obs(torch.randn(200, OBS) * 3 + 1)
        return made.eval()

    class Step(torch.nn.Module):
        def __init__(self, model):
            super().__init__()
            self.model = model

        def forward(self, obs, *states):
            given = {"is_train": False, "prev_actions": None, "obs": obs, "rnn_states": states or None}
            result = self.model(given)
            return (result["mus"], *result["rnn_states"]) if states else result["mus"]

    torch.manual_seed(0)
    module = Step(model())
    both("MLP, normalizer", module, acts(lambda x: module(x)))
    for name, count in (("lstm", 2), ("gru", 1)):
        recurrent(name.upper(), Step(model(rnn={"name": name, "units": 16, "layers": 1, "before_mlp": True})), count)


@package
def torchrl():
    import torch
    from tensordict.nn import InteractionType, TensorDictModule, set_interaction_type
    from torch import nn
    from torchrl.modules import MLP, GRUModule, LSTMModule, NormalParamExtractor, ProbabilisticActor, TanhNormal

    class Step(nn.Module):
        def __init__(self, actor):
            super().__init__()
            self.actor = actor

        def forward(self, obs):
            with set_interaction_type(InteractionType.DETERMINISTIC):
                return self.actor(observation=obs)[2]

    def actor(distribution):
        module = nn.Sequential(
            MLP(in_features=OBS, out_features=2 * ACT, num_cells=[24, 16], activation_class=nn.SiLU), NormalParamExtractor()
        )
        module = TensorDictModule(module, in_keys=["observation"], out_keys=["loc", "scale"])
        return ProbabilisticActor(module, in_keys=["loc", "scale"], distribution_class=distribution, spec=None)

    torch.manual_seed(0)
    plain = MLP(in_features=OBS, out_features=ACT, num_cells=[24, 16], activation_class=nn.Tanh)
    both("MLP", plain, acts(lambda x: plain(x)))
    tanh = Step(actor(TanhNormal)).eval()
    both("ProbabilisticActor, TanhNormal", tanh, acts(lambda x: tanh(x)))

    class Recurrent(nn.Module):
        def __init__(self, cls, **options):
            super().__init__()
            self.cell, self.out = cls(input_size=OBS, hidden_size=16, in_key="x", out_key="y", **options), nn.Linear(16, ACT)

        def forward(self, obs, *states):
            y, states = self.cell.lstm(obs[None], states) if len(states) > 1 else self.cell.gru(obs[None], *states)
            return (self.out(y[0]), *(states if isinstance(states, tuple) else (states,)))

    for name, cls, count in (("LSTM", LSTMModule, 2), ("GRU", GRUModule, 1)):
        recurrent(name, Recurrent(cls), count)


@package
def tianshou():
    import torch
    from tianshou.utils.net.common import Net
    from tianshou.utils.net.continuous import ContinuousActorDeterministic, ContinuousActorProbabilistic

    class Step(torch.nn.Module):
        def __init__(self, actor, pick, squash=False):
            super().__init__()
            self.actor, self.pick, self.squash = actor, pick, squash

        def forward(self, obs):
            action = self.pick(self.actor(obs))
            return torch.tanh(action) if self.squash else action

    def body(**options):
        return Net(state_shape=(OBS,), hidden_sizes=[24, 16], **options)

    torch.manual_seed(0)
    for kind, module in [
        ("deterministic", Step(ContinuousActorDeterministic(preprocess_net=body(), action_shape=(ACT,), max_action=2.0), lambda o: o[0])),
        ("Gaussian", Step(ContinuousActorProbabilistic(preprocess_net=body(), action_shape=(ACT,), unbounded=True), lambda o: o[0][0])),
        ("Gaussian, layer norm, squashed", Step(
            ContinuousActorProbabilistic(preprocess_net=body(norm_layer=torch.nn.LayerNorm), action_shape=(ACT,), unbounded=True),
            lambda o: o[0][0], squash=True)),
    ]:  # fmt: skip
        module.eval()
        both(kind, module, acts(lambda x, m=module: m(x)))


@package
def torchao():
    import torch
    from torch import nn
    from torchao.quantization import Int4WeightOnlyConfig, Int8DynamicActivationInt8WeightConfig, Int8WeightOnlyConfig, quantize_
    from torchao.quantization.qat import QATConfig

    def quantized(config):
        torch.manual_seed(0)
        module = nn.Sequential(nn.Linear(OBS, 64), nn.ELU(), nn.Linear(64, ACT)).eval()
        quantize_(module, config())
        return module

    for kind, config in [
        ("int8 weights", Int8WeightOnlyConfig),
        ("int8 weights and activations", Int8DynamicActivationInt8WeightConfig),
        ("int4 weights", lambda: Int4WeightOnlyConfig(group_size=32)),
        ("quantization-aware, int8 activations", lambda: QATConfig(Int8DynamicActivationInt8WeightConfig(), step="prepare")),
    ]:
        made = []

        def module(made=made, config=config):
            made[:] = made or [quantized(config)]
            return made[0]

        act = acts(lambda x, module=module: module()(x))
        row(kind, "module", module, act, example=torch.zeros(1, OBS))
        for dynamo in (False, True):
            form = "torch.onnx, " + ("dynamo" if dynamo else "tracing")
            row(kind, form, lambda module=module, dynamo=dynamo: by_torch(module(), "torchao", dynamo)(), act)


@package
def keras():
    os.environ["KERAS_BACKEND"] = "torch"
    import keras
    from keras import layers

    def model(*middle):
        given = keras.Input((OBS,))
        x = given
        for layer in middle:
            x = layer(x)
        return keras.Model(given, x)

    def normalized():
        norm = layers.Normalization()
        norm.adapt(np.random.default_rng(2).normal(size=(200, OBS)) * 3 + 1)
        return norm

    keras.utils.set_random_seed(0)
    for kind, build in [
        ("Dense, elu", lambda: model(layers.Dense(24, "elu"), layers.Dense(ACT))),
        ("Normalization, tanh action", lambda: model(normalized(), layers.Dense(24, "relu"), layers.Dense(ACT, "tanh"))),
        ("LayerNormalization, gelu", lambda: model(layers.Dense(24), layers.LayerNormalization(), layers.Activation("gelu"), layers.Dense(ACT))),
        ("BatchNormalization, silu", lambda: model(layers.Dense(24), layers.BatchNormalization(), layers.Activation("silu"), layers.Dense(ACT))),
        ("chunk", lambda: model(layers.Dense(24, "relu"), layers.Dense(8 * ACT), layers.Reshape((8, ACT)))),
        ("GRU over a history of 4", lambda: model(layers.Reshape((4, OBS // 4)), layers.GRU(8), layers.Dense(ACT))),
        ("Conv1D", lambda: model(layers.Reshape((OBS, 1)), layers.Conv1D(4, 3, activation="relu"), layers.Flatten(), layers.Dense(ACT))),
    ]:
        made = []

        def own(made=made, build=build):
            made[:] = made or [build()]
            # The exporter reads the shapes of a call.
            made[0](np.zeros((1, OBS), np.float32))
            return made[0]

        def export(own=own):
            own().export(file("keras"), format="onnx", verbose=False)
            return file("keras")

        row(kind, 'export(format="onnx")', export, lambda rows, own=own: own().predict(rows, verbose=0))


@package
def jax2onnx():
    import jax
    import jax.numpy as jnp
    from flax import nnx
    from jax2onnx import to_onnx

    class Mlp(nnx.Module):
        def __init__(self, middle, rngs):
            self.a, self.b, self.middle = nnx.Linear(OBS, 24, rngs=rngs), nnx.Linear(24, ACT, rngs=rngs), middle

        def __call__(self, x):
            return self.b(self.middle(self.a(x)))

    def norm(rngs):
        layer = nnx.LayerNorm(24, rngs=rngs)
        return lambda x: nnx.gelu(layer(x))

    mean, deviation = np.linspace(-1, 1, OBS, dtype=np.float32), np.linspace(0.5, 2, OBS, dtype=np.float32)
    rngs = nnx.Rngs(0)
    plain = Mlp(nnx.silu, rngs)
    for kind, function in [
        ("MLP, swish (Brax)", plain),
        ("MLP, tanh action", lambda x, m=Mlp(nnx.relu, rngs): jnp.tanh(m(x))),
        ("layer norm, gelu", Mlp(norm(rngs), rngs)),
        ("normalizer, clipped", lambda x: plain(jnp.clip((x - mean) / deviation, -5, 5))),
        ("residual", lambda x, m=Mlp(lambda h: h + nnx.elu(h), rngs): m(x)),
        ("chunk", lambda x, m=nnx.Linear(OBS, 8 * ACT, rngs=rngs): m(x).reshape(-1, 8, ACT)),
    ]:

        def export(function=function):
            to_onnx(function, [jax.ShapeDtypeStruct((1, OBS), jnp.float32)], return_mode="file", output_path=file("jax"))
            return file("jax")

        row(kind, "to_onnx", export, lambda rows, f=function: [np.asarray(f(obs[None])).reshape(-1) for obs in rows])


if __name__ == "__main__":
    CASES[sys.argv[1]]()
