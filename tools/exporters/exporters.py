"""Exports small policies by one package, imports them, and compares them with the package's own actions.

    python exporters.py NAME

in an environment with actq, torch 2.15.0, onnxruntime, onnxscript and the package. One function for each package has its cases;
each prints rows: kind | form | outcome | error of the actions. Releases that were read are in docs/records/2026-11-29-exporters.md;
expected.txt has the outcomes that `cargo xtask exporters` expects.
"""

import contextlib
import io
import logging
import os
import re
import shutil
import sys
import tempfile
import warnings
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

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


def row(kind, form, make, act=None, width=OBS, discrete=False, episode=None, tolerance=TOLERANCE, **options):
    """Exports by `make`, imports what it returns, and prints the outcome.

    act: the package's own actions at observations [step, value] of one episode; without it, onnxruntime runs the file.
    discrete: the policy gives scores, and the action is the largest.
    episode: gives the observations or raw values of a run of the package, and its actions, instead of `act`.
    """
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            source = make()
            rows, expected = episode() if episode else (None, None if act is None else act(observations(width)))
            expected = None if expected is None else np.asarray(expected, np.float64)
    except Exception as error:
        return outcome(kind, form, f"export fails: {short(error)}")
    import actq

    try:
        policy = actq.import_policy(source, **options)
    except actq.Error as error:
        asks = re.search(r" leaves \d+ questions? open; ", str(error))
        return outcome(kind, form, f"{'asks' if asks else 'refused'}: {one_line(str(error))}")
    rows = observations(policy.obs_len) if rows is None else np.asarray(rows, np.float32)
    try:
        expected = run_file(source, rows, policy) if expected is None else expected
    except Exception as error:
        return outcome(kind, form, f"onnxruntime fails: {short(error)}")
    found = policy(rows)
    expected = expected.reshape(len(expected), -1)
    found = found.argmax(axis=1)[:, None] if discrete else found
    # A choice is right or wrong; its number has no size.
    size = 1.0 if discrete else np.abs(expected).max()
    error = np.abs(found - expected).max() / size if found.shape == expected.shape else np.inf
    outcome(kind, form, "imports" if error <= tolerance else "WRONG", f"{error:.0e}")


def outcome(kind, form, text, error=""):
    print(f"{kind} | {form} | {text} | {error}", flush=True)


def short(error):
    """The first cause in one line."""
    while error.__cause__ is not None:
        error = error.__cause__
    return one_line(str(error) or type(error).__name__)


def one_line(text):
    """Text in one line, without what differs from run to run."""
    text = " ".join(text.split())
    for place in (tempfile.gettempdir(), os.getcwd(), sys.prefix):
        text = text.replace(place + "/", "")
    # Of an error of the tracing exporter, what follows are places.
    text = re.sub(r"\.tmp\w+/|\x1b\[\d*m|, scope: .*", "", re.sub(r"0x[0-9a-f]+", "0x..", text))
    return text if len(text) < 160 else text[:160] + " .."


def run_file(path, rows, policy):
    """Runs an ONNX file over an episode: outputs that are no action go back into the inputs that the policy does not read."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    # Its optimizer rounds the observation of a layer with quantized weights to 8 bits.
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_DISABLE_ALL
    session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    inputs = session.get_inputs()
    sizes = {i.name: [n if isinstance(n, int) else 1 for n in i.shape] for i in inputs}
    observed, states, total = [], [], 0
    for i in inputs:
        length = int(np.prod(sizes[i.name]))
        (observed if total + length <= policy.obs_len else states).append(i.name)
        total += length if total + length <= policy.obs_len else 0
    values = {name: np.zeros(sizes[name], np.float32) for name in sizes}
    actions = []
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
    from sb3_contrib import QRDQN, TQC, TRPO, CrossQ, RecurrentPPO
    from stable_baselines3 import A2C, DDPG, DQN, PPO, SAC, TD3
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

    short_ppo = {"n_steps": 16, "batch_size": 16}
    small = {"buffer_size": 10}

    def policy_kwargs():
        # SAC writes into the dict that it is given.
        return {"net_arch": [16, 16]}

    for kind, algorithm, env, more in [
        ("PPO", PPO, Env, short_ppo),
        ("PPO, VecNormalize", PPO, vec, short_ppo),
        ("PPO, Dict", PPO, lambda: Env(observed=parts), short_ppo),
        ("PPO, Discrete", PPO, lambda: Env(discrete=True), short_ppo),
        ("PPO, state-dependent noise", PPO, Env, {**short_ppo, "use_sde": True}),
        ("A2C", A2C, Env, {}),
        ("SAC, squashed", SAC, Env, small),
        ("TD3, squashed", TD3, Env, small),
        ("DDPG, squashed", DDPG, Env, small),
        ("DQN, Discrete", DQN, lambda: Env(discrete=True), small),
        ("TQC, squashed", TQC, Env, small),
        ("CrossQ, batch renormalization", CrossQ, Env, small),
        ("TRPO", TRPO, Env, short_ppo),
        ("QR-DQN, Discrete", QRDQN, lambda: Env(discrete=True), small),
        ("RecurrentPPO", RecurrentPPO, Env, {"n_steps": 16, "batch_size": 16}),
    ]:
        kind_of = "MultiInputPolicy" if "Dict" in kind else "MlpLstmPolicy" if "Recurrent" in kind else "MlpPolicy"

        def make(algorithm=algorithm, env=env, more=more, kind_of=kind_of):
            made = algorithm(kind_of, env(), policy_kwargs=policy_kwargs(), device="cpu", **more)
            return made.learn(64) if env is vec or algorithm is CrossQ else made

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

        def script(own=own):
            own().export_policy_to_jit(tempfile.gettempdir(), "rsl_rl.pt")
            return str(Path(tempfile.gettempdir(), "rsl_rl.pt"))

        width = sum(int(np.prod(shape)) for shape in groups.values())
        example = tuple(torch.zeros(1, *shape) for shape in groups.values())
        if actor.get("class_name") != "CNNModel":
            example = (torch.cat([part.flatten(1) for part in example], 1),)
        row(kind, "runner", own, act, width)
        for form, export, options in [
            ("export_policy_to_onnx", onnx, {}),
            ("export_policy_to_jit", script, {"example": example if len(example) > 1 else example[0]}),
        ]:
            made.clear()
            row(kind, form, export, act, width, **options)


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

    class Cell(GaussianMixin, Model):
        def __init__(self, cell):
            Model.__init__(self, observation_space=space, action_space=actions, device="cpu")
            GaussianMixin.__init__(self)
            self.cell, self.net = cell(OBS, 16, batch_first=True), nn.Linear(16, ACT)
            self.log_std_parameter = nn.Parameter(torch.zeros(ACT))

        def compute(self, inputs, role=""):
            states = inputs["rnn"]
            y, states = self.cell(inputs["observations"][:, None], states if len(states) > 1 else states[0])
            states = states if isinstance(states, tuple) else (states,)
            return self.net(y[:, 0]), {"log_std": self.log_std_parameter, "rnn": list(states)}

    class Recurrent(nn.Module):
        def __init__(self, model):
            super().__init__()
            self.model = model

        def forward(self, obs, *states):
            _, outputs = self.model.act({"observations": obs, "rnn": states}, role="policy")
            return (outputs["mean_actions"], *outputs["rnn"])

    for name, cell, count in (("LSTM", nn.LSTM, 2), ("GRU", nn.GRU, 1)):
        recurrent(name, Recurrent(Cell(cell)), count)
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
    from torchao.quantization import Int8DynamicActivationInt8WeightConfig, Int8WeightOnlyConfig, IntxWeightOnlyConfig, quantize_
    from torchao.quantization.granularity import PerGroup
    from torchao.quantization.qat import IntxFakeQuantizeConfig, QATConfig

    def quantized(*steps):
        torch.manual_seed(0)
        module = nn.Sequential(nn.Linear(OBS, 64), nn.ELU(), nn.Linear(64, ACT)).eval()
        for config in steps:
            quantize_(module, config)
        return module

    four = IntxWeightOnlyConfig(weight_dtype=torch.int4, granularity=PerGroup(4))
    weights = IntxFakeQuantizeConfig(torch.int4, group_size=4)
    for kind, *config in [
        ("int8 weights", Int8WeightOnlyConfig()),
        ("int4 weights, groups of 4", four),
        ("int8 weights and activations", Int8DynamicActivationInt8WeightConfig()),
        ("quantization-aware, int4 weights", QATConfig(weight_config=weights, step="prepare")),
        ("quantization-aware, converted", QATConfig(four, step="prepare"), QATConfig(four, step="convert")),
    ]:
        made = []

        def module(made=made, config=config):
            made[:] = made or [quantized(*config)]
            return made[0]

        act = acts(lambda x, module=module: module()(x))
        row(kind, "module", module, act, example=torch.zeros(1, OBS))
        for dynamo in (False, True):
            form = "torch.onnx, " + ("dynamo" if dynamo else "tracing")
            row(kind, form, lambda module=module, dynamo=dynamo: by_torch(module(), "torchao", dynamo)(), act)


@package
def onnxruntime():
    import torch
    from onnxruntime import quantization as q
    from onnxruntime.quantization import matmul_nbits_quantizer as nbits
    from torch import nn

    import onnxruntime

    torch.manual_seed(0)
    module = nn.Sequential(nn.Linear(OBS, 32), nn.ELU(), nn.Linear(32, 32), nn.ELU(), nn.Linear(32, ACT))
    # The quantizers do not know Gemm.
    base = by_torch(module, "ort", False, (torch.zeros(1, 1, OBS),), input_names=["input"])()

    class Reader(q.CalibrationDataReader):
        def __init__(self):
            self.rows = iter(observations())

        def get_next(self):
            row = next(self.rows, None)
            return None if row is None else {"input": row[None, None]}

    def made(write):
        def make():
            path = file("ort_quantized")
            write(path)
            return path

        return make

    def blocks(bits, form, symmetric):
        def write(path):
            config = nbits.DefaultWeightOnlyQuantConfig(
                block_size=16, is_symmetric=symmetric, bits=bits, quant_format=form, op_types_to_quantize=("MatMul",)
            )
            import onnx

            quantizer = nbits.MatMulNBitsQuantizer(onnx.load(base), algo_config=config)
            quantizer.process()
            quantizer.model.save_model_to_file(path, False)

        return write

    def optimized(level):
        def write(path):
            options = onnxruntime.SessionOptions()
            options.graph_optimization_level, options.optimized_model_filepath = level, path
            onnxruntime.InferenceSession(base, options, providers=["CPUExecutionProvider"])

        return write

    qdq, operator = q.QuantFormat.QDQ, q.QuantFormat.QOperator
    levels = onnxruntime.GraphOptimizationLevel
    for kind, form, write in [
        ("int8 weights", "quantize_dynamic", lambda path: q.quantize_dynamic(base, path)),
        ("int8 weights and activations", "quantize_static, QDQ", lambda path: q.quantize_static(base, path, Reader(), quant_format=qdq)),
        ("int8 weights and activations", "quantize_static, QOperator", lambda path: q.quantize_static(base, path, Reader(), quant_format=operator)),
        ("int4 blocks, symmetric", "MatMulNBits, QDQ", blocks(4, qdq, True)),
        ("int4 blocks, zero points", "MatMulNBits, QDQ", blocks(4, qdq, False)),
        ("int8 blocks: stays float32", "MatMulNBits, QDQ", blocks(8, qdq, False)),
        ("int4 blocks, symmetric", "MatMulNBits, QOperator", blocks(4, operator, True)),
        ("MLP", "optimized file, BASIC", optimized(levels.ORT_ENABLE_BASIC)),
        ("MLP", "optimized file, EXTENDED", optimized(levels.ORT_ENABLE_EXTENDED)),
    ]:  # fmt: skip
        row(kind, form, made(write))


@package
def optimizers():
    import onnx
    import onnxoptimizer
    import onnxsim
    import onnxslim
    import torch
    from torch import nn

    class Recurrent(nn.Module):
        def __init__(self):
            super().__init__()
            self.cell, self.out = nn.LSTM(OBS, 16), nn.Linear(16, ACT)

        def forward(self, x, h, c):
            y, (h, c) = self.cell(x[None], (h, c))
            return self.out(y[0]), h, c

    torch.manual_seed(0)
    mean, deviation = torch.linspace(-1, 1, OBS), torch.linspace(0.5, 2, OBS)

    class Normalized(nn.Module):
        def __init__(self):
            super().__init__()
            self.net = nn.Sequential(nn.Linear(OBS, 24), nn.LayerNorm(24), nn.SiLU(), nn.Linear(24, ACT))

        def forward(self, x):
            return torch.tanh(self.net(((x - mean) / deviation).clamp(-5, 5)))

    zeros = [torch.zeros(1, 1, 16)] * 2
    names = {"input_names": ["obs", "h", "c"], "output_names": ["action", "h_next", "c_next"]}
    for kind, module, inputs, options in [
        ("normalizer, layer norm, SiLU, tanh", Normalized(), (torch.zeros(1, OBS),), {}),
        ("LSTM, one tensor for h and c", Recurrent(), (torch.zeros(1, OBS), *zeros), names),
    ]:
        for dynamo in (False, True):
            base = by_torch(module, "optimized", dynamo, inputs, **options)()
            for tool, run in [
                ("onnxslim", onnxslim.slim),
                ("onnxsim", lambda model: onnxsim.simplify(model)[0]),
                ("onnxoptimizer", onnxoptimizer.optimize),
            ]:

                def make(run=run, base=base):
                    onnx.save(run(onnx.load(base)), file("optimized_after"))
                    return file("optimized_after")

                zero = [torch.zeros(1, 1, 16)] * 2
                act = acts(module.eval(), zero if options else ())
                row(kind, f"{tool}, " + ("dynamo" if dynamo else "tracing"), make, act)


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


def folder(name):
    """An empty folder."""
    path = Path(tempfile.gettempdir(), name)
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir()
    return path


@package
def lerobot():
    import torch
    from lerobot.configs.types import FeatureType, NormalizationMode, PolicyFeature
    from lerobot.policies.factory import make_pre_post_processors
    from lerobot.policies.gaussian_actor import GaussianActorConfig, GaussianActorPolicy

    random = np.random.default_rng(3)

    def statistics(length):
        center = random.normal(size=length).astype(np.float32)
        width = random.uniform(0.5, 2, length).astype(np.float32)
        return {"mean": center, "std": width, "min": center - 2 * width, "max": center + 2 * width,
                "q01": center - width, "q99": center + width}  # fmt: skip

    stats = {"observation.state": statistics(OBS), "action": statistics(ACT)}
    stats = {key: {name: torch.from_numpy(value) for name, value in part.items()} for key, part in stats.items()}

    class Network(torch.nn.Module):
        def __init__(self, policy):
            super().__init__()
            self.policy = policy

        def forward(self, state):
            actor = self.policy.actor
            return torch.tanh(actor.mean_layer(actor.network(actor.encoder({"observation.state": state}))))

    for mode in ("MEAN_STD", "MIN_MAX", "QUANTILES"):
        config = GaussianActorConfig(
            input_features={"observation.state": PolicyFeature(FeatureType.STATE, (OBS,))},
            output_features={"action": PolicyFeature(FeatureType.ACTION, (ACT,))},
            normalization_mapping={"STATE": NormalizationMode[mode], "ACTION": NormalizationMode[mode], "ENV": NormalizationMode[mode]},
            device="cpu", push_to_hub=False,
        )  # fmt: skip
        torch.manual_seed(0)
        policy = GaussianActorPolicy(config).eval()
        before, after = make_pre_post_processors(config, dataset_stats=stats)

        def make(policy=policy, before=before, after=after):
            path = folder("lerobot")
            policy.save_pretrained(path)
            before.save_pretrained(path)
            after.save_pretrained(path)
            names = {"input_names": ["observation.state"], "output_names": ["action"]}
            torch.onnx.export(Network(policy).eval(), (torch.zeros(1, OBS),), str(path / "policy.onnx"), dynamo=False, **names)
            return str(path)

        def act(rows, policy=policy, before=before, after=after):
            with torch.no_grad():
                return [after(Network(policy)(before({"observation.state": torch.from_numpy(obs)})["observation.state"])) for obs in rows]

        kind = f"gaussian_actor, {mode}"
        row(kind, "pretrained model and ONNX", make, act)
        answers = {"graph.complete": True, "rate_hz": 30}
        row(kind, "with answers", make, act, accept_profile=True, answers=answers)
    transformers_of_lerobot()


def transformers_of_lerobot():
    """Its transformers without cameras: the chunk that ACT decodes, and the steps of a diffusion transformer from noise."""
    import torch
    from lerobot.configs.types import FeatureType, PolicyFeature
    from lerobot.policies.act.configuration_act import ACTConfig
    from lerobot.policies.act.modeling_act import ACT as Act
    from lerobot.policies.multi_task_dit.modeling_multi_task_dit import DiffusionTransformer, FlowMatchingObjective

    def exported(module, example, inputs, output, dynamo):
        path = folder("lerobot") / "policy.onnx"
        names = {"input_names": inputs, "output_names": [output]}
        torch.onnx.export(module.eval(), example, str(path), dynamo=dynamo, **names)
        return str(path)

    class Chunk(torch.nn.Module):
        def __init__(self, model):
            super().__init__()
            self.model = model

        def forward(self, obs):
            return self.model({"observation.state": obs[:, :OBS], "observation.environment_state": obs[:, OBS:]})[0]

    features = {"observation.state": (FeatureType.STATE, OBS), "observation.environment_state": (FeatureType.ENV, 5)}
    config = ACTConfig(
        input_features={name: PolicyFeature(kind, (n,)) for name, (kind, n) in features.items()},
        output_features={"action": PolicyFeature(FeatureType.ACTION, (ACT,))},
        chunk_size=8, n_action_steps=8, dim_model=32, n_heads=4, dim_feedforward=64, n_encoder_layers=2, n_vae_encoder_layers=1,
        latent_dim=8, device="cpu", push_to_hub=False,
    )  # fmt: skip
    torch.manual_seed(0)
    model = Chunk(Act(config)).eval()
    for dynamo in (False, True):

        def make(dynamo=dynamo):
            return exported(model, (torch.zeros(1, OBS + 5),), ["obs"], "action", dynamo)

        row("ACT, encoder and decoder", "dynamo" if dynamo else "traced", make, lambda rows: model(torch.from_numpy(rows)).detach().numpy(), width=OBS + 5)

    for rope in (True, False):
        config = SimpleNamespace(
            action_feature=SimpleNamespace(shape=(ACT,)), horizon=8, hidden_dim=32, num_layers=2, num_heads=4, dropout=0.1, use_rope=rope,
            rope_base=10000.0, use_positional_encoding=not rope, timestep_embed_dim=16, num_integration_steps=10, integration_method="euler",
        )  # fmt: skip
        torch.manual_seed(0)
        network = DiffusionTransformer(config, OBS).eval()
        for block in network.transformer_blocks:
            # Untrained, these are zero, and the blocks do nothing.
            torch.nn.init.normal_(block.adaLN_modulation[-1].weight, std=0.1)

        def episode(network=network, config=config):
            rows = observations(OBS + config.horizon * ACT)
            objective = FlowMatchingObjective(config, ACT, config.horizon)

            def act(obs):
                noise = obs[:, OBS:].reshape(1, config.horizon, ACT)
                with mock.patch("torch.randn", lambda *_, **__: noise):
                    return objective.conditional_sample(network, 1, obs[:, :OBS]).detach().numpy()

            return rows, [act(torch.from_numpy(one[None])) for one in rows]

        for dynamo in (False, True):

            def make(network=network, config=config, dynamo=dynamo):
                example = (torch.zeros(1, config.horizon, ACT), torch.zeros(1), torch.zeros(1, OBS))
                return exported(network, example, ["x", "timestep", "conditioning"], "velocity", dynamo)

            kind = f"multi_task_dit, flow matching, {'rotary' if rope else 'learned'} positions"
            sampler = {"kind": "flow", "steps": config.num_integration_steps, "time": {"from": 0, "to": 1}}
            row(kind, "dynamo" if dynamo else "traced", make, episode=episode, sampler=sampler)


@package
def kinfer():
    import onnx
    import torch
    from kinfer.export.serialize import pack
    from kinfer.rust_bindings import PyModelMetadata

    joints, commands = [f"joint_{i}" for i in range(ACT)], ["x", "y", "turn"]
    torch.manual_seed(0)
    for kind, size in (("MLP", 1), ("GRU", 16)):
        metadata = PyModelMetadata(joint_names=joints, command_names=commands, carry_size=[size])

        class Step(torch.nn.Module):
            def __init__(self, size=size):
                super().__init__()
                width = 2 * ACT + len(commands)
                self.cell, self.out = torch.nn.GRUCell(width, 16), torch.nn.Linear(16 if size > 1 else width, ACT)
                self.is_cell = size > 1

            def forward(self, joint_angles, joint_angular_velocities, command, carry):
                x = torch.cat([joint_angles, joint_angular_velocities, command])
                if self.is_cell:
                    carry = self.cell(x[None], carry[None])[0]
                    return self.out(carry), carry
                return self.out(x), carry

        step = Step().eval()
        width = 2 * ACT + len(commands)

        class Start(torch.nn.Module):
            def forward(self, size=size):
                return torch.zeros(size)

        def exported(module, given, names, outputs):
            # export_fn takes a ScriptFunction, which torch 2.15's default exporter refuses.
            content = io.BytesIO()
            torch.onnx.export(module, given, content, dynamo=False, input_names=names, output_names=outputs)
            return onnx.load_from_string(content.getvalue())

        def make(step=step, size=size, metadata=metadata):
            given = (torch.zeros(ACT), torch.zeros(ACT), torch.zeros(len(commands)), torch.zeros(size))
            names = ["joint_angles", "joint_angular_velocities", "command", "carry"]
            path = folder("kinfer") / "policy.kinfer"
            step_fn = exported(step, given, names, ["action", "carry_out"])
            path.write_bytes(pack(exported(Start(), (), [], ["carry"]), step_fn, metadata))
            return str(path)

        def act(rows, step=step, size=size):
            carry, actions = torch.zeros(size), []
            for obs in torch.from_numpy(rows):
                with torch.no_grad():
                    action, carry = step(*obs.split([ACT, ACT, len(commands)]), carry)
                actions.append(action.numpy())
            return actions

        row(kind, "kinfer archive", make, act, width, accept_profile=True, answers={"packed.rate_hz": 50, "packed.target": "position"})


@package
def mjlab():
    from dataclasses import asdict

    import torch
    from mjlab.envs import ManagerBasedRlEnv
    from mjlab.rl import RslRlVecEnvWrapper
    from mjlab.tasks.registry import load_env_cfg, load_rl_cfg, load_runner_cls

    import mjlab.tasks

    def still(frames=60):
        """A motion file of the tracking task: a G1 that sways on the spot."""
        from mjlab.asset_zoo.robots import get_g1_robot_cfg
        from mjlab.entity import Entity

        robot = Entity(get_g1_robot_cfg())
        joints, bodies = len(robot.joint_names), len(robot.body_names)
        phase = np.arange(frames)[:, None] / 50 + np.arange(joints)
        upright = np.zeros((frames, bodies, 4))
        upright[:, :, 0] = 1
        zeros = np.zeros((frames, bodies, 3))
        np.savez(
            Path(tempfile.gettempdir(), "motion.npz"), joint_pos=0.1 * np.sin(phase), joint_vel=0.1 * np.cos(phase),
            body_pos_w=zeros + [0, 0, 0.8], body_quat_w=upright, body_lin_vel_w=zeros, body_ang_vel_w=zeros,
        )  # fmt: skip
        return str(Path(tempfile.gettempdir(), "motion.npz"))

    def scaled(cfg):
        terms = cfg.observations["actor"].terms
        terms["base_ang_vel"].scale, terms["joint_vel"].scale, terms["joint_vel"].clip = 0.25, 0.05, (-10.0, 10.0)
        terms["command"].scale = (2.0, 2.0, 0.25)

    def history(cfg):
        cfg.observations["actor"].history_length = 3

    def lstm(actor):
        actor.class_name, actor.rnn_type, actor.rnn_hidden_dim, actor.rnn_num_layers = "RNNModel", "lstm", 16, 1

    flat, rough = "Mjlab-Velocity-Flat-Unitree-Go1", "Mjlab-Velocity-Rough-Unitree-Go1"
    for kind, task, change, network in [
        ("Go1 flat", flat, None, None),
        ("Go1 flat, scales and clips", flat, scaled, None),
        ("Go1 flat, history of 3", flat, history, None),
        ("Go1 flat, LSTM", flat, None, lstm),
        ("Go1 rough, height scan", rough, None, None),
        ("G1 tracking", "Mjlab-Tracking-Flat-Unitree-G1", None, None),
    ]:
        made, path = [], folder("mjlab")

        def make(task=task, change=change, network=network, made=made, path=path):
            cfg, agent = load_env_cfg(task), load_rl_cfg(task)
            cfg.scene.num_envs, cfg.seed, cfg.terminations = 1, 0, {}
            for term in cfg.observations["actor"].terms.values():
                term.noise = None
            if "Tracking" in task:
                cfg.commands["motion"].motion_file = still()
            change and change(cfg)
            agent.logger, agent.upload_model = "tensorboard", False
            agent.actor.hidden_dims, agent.critic.hidden_dims = (32, 16), (16,)
            network and network(agent.actor)
            torch.manual_seed(0)
            env = RslRlVecEnvWrapper(ManagerBasedRlEnv(cfg=cfg, device="cpu"), clip_actions=agent.clip_actions)
            runner = load_runner_cls(task)(env, asdict(agent), str(path), "cpu")
            runner.alg.train_mode()
            for _ in range(3):
                runner.alg.get_policy().update_normalization(env.get_observations())
            runner.alg.eval_mode()
            with torch.no_grad():
                # The action is fed back: a large one grows from step to step.
                for weights in list(runner.alg.get_policy().mlp.parameters())[-2:]:
                    weights.mul_(0.02)
            runner.save(str(path / "model_0.pt"))
            made[:] = [env, runner]
            return str(path)

        def episode(made=made):
            env, runner = made
            inner, act = env.unwrapped, runner.get_inference_policy("cpu")
            robot, manager = inner.scene["robot"], inner.observation_manager
            runner.alg.get_policy().reset() if runner.alg.get_policy().is_recurrent else None
            obs, _ = env.reset()
            rows, targets = [], []
            for _ in range(12):
                raw = [robot.data.joint_pos_biased, robot.data.joint_vel]
                for name in manager.active_terms["actor"]:
                    term = manager.get_term_cfg("actor", name)
                    if name not in ("joint_pos", "joint_vel", "actions"):
                        raw.append(term.func(inner, **term.params))
                rows.append(torch.cat([part.reshape(-1) for part in raw]).numpy().copy())
                with torch.inference_mode():
                    obs, *_ = env.step(act(obs))
                targets.append(inner.action_manager.get_term("joint_pos")._processed_actions[0].numpy().copy())
            return rows, targets

        answers = {"rate_hz": 50, **({"raw.height_scan": 187} if task == rough else {})}
        # The metadata have three decimals.
        row(kind, "runner.save", make, episode=episode, tolerance=1e-3, accept_profile=True, answers=answers)


@package
def holosoma():
    import dataclasses
    from types import SimpleNamespace as Stub

    from holosoma.config_values.loco.g1.observation import g1_29dof_loco_single_wolinvel as preset
    from holosoma.config_types.experiment import ExperimentConfig
    from holosoma.config_values.robot import g1_29dof as robot
    from holosoma.managers.observation.manager import ObservationManager
    from holosoma.utils.inference_helpers import (
        attach_onnx_metadata, export_policy_as_onnx, get_control_gains_from_config, get_urdf_text_from_robot_config,
    )  # fmt: skip
    from holosoma.utils.safe_torch_import import torch

    names = list(robot.dof_names)
    default = torch.tensor([[robot.init_state.default_joint_angles[name] for name in names]])
    scale, limit = float(robot.control.action_scale), robot.control.action_clip_value
    # The simulator needs a GPU: the observation manager reads drawn values.
    gait = Stub()
    env = Stub(
        num_envs=1, device="cpu", simulator=Stub(), base_quat=torch.tensor([[0.0, 0.0, 0.0, 1.0]]), default_dof_pos=default,
        action_manager=Stub(), command_manager=Stub(get_state=lambda name: gait),
    )  # fmt: skip

    def draw(random, action, phase):
        simulator = env.simulator
        simulator.dof_pos = default + 0.1 * torch.randn(default.shape, generator=random)
        simulator.dof_vel = torch.randn(default.shape, generator=random)
        simulator.robot_root_states = torch.randn((1, 13), generator=random)
        env.command_manager.commands = torch.randn((1, 3), generator=random)
        env.action_manager.action, gait.phase = action, phase.float()
        turn, command = simulator.robot_root_states[0, 10:13], env.command_manager.commands[0]
        return {
            "base_ang_vel": turn, "command_lin_vel": command[:2], "command_ang_vel": command[2:], "dof_pos": simulator.dof_pos[0],
            "dof_vel": simulator.dof_vel[0], "projected_gravity": torch.tensor([0.0, 0.0, -1.0]),
        }  # fmt: skip

    for kind, frames in (("G1 walking preset", 1), ("G1 walking preset, history of 3", 3)):
        group = dataclasses.replace(preset.groups["actor_obs"], enable_noise=False, history_length=frames)
        cfg, made = dataclasses.replace(preset, groups={"actor_obs": group}), []

        def make(cfg=cfg, made=made):
            draw(torch.Generator(), torch.zeros_like(default), torch.zeros(1, 2))
            manager = ObservationManager(cfg, env, device="cpu")
            layout = manager.get_observation_layout(["actor_obs"])
            length = sum(term["dim"] * term["history_length"] for term in layout)
            torch.manual_seed(0)
            network = torch.nn.Sequential(torch.nn.Linear(length, 16), torch.nn.ELU(), torch.nn.Linear(16, len(names))).eval()
            path = str(folder("holosoma") / "policy.onnx")
            export_policy_as_onnx(network, path, {"actor_obs": torch.zeros(1, length)})
            stiffness, damping = get_control_gains_from_config(robot)
            urdf, text = get_urdf_text_from_robot_config(robot)
            # As its PPO and its checkpoints do (agents/ppo/ppo.py:744-756, agents/base_algo).
            attach_onnx_metadata(path, {
                "dof_names": names, "kp": stiffness, "kd": damping, "action_scale": scale, "command_ranges": {"lin_vel_x": [-1, 1]},
                "robot_urdf": text, "robot_urdf_path": urdf, "observation_layout": layout, "observation_clip": cfg.clip_observations,
                "experiment_config": ExperimentConfig(robot=robot).to_serializable_dict(), "iteration": 7,
            })  # fmt: skip
            made[:] = [manager, network, layout]
            return path

        def episode(made=made):
            manager, network, layout = made
            random, action = torch.Generator().manual_seed(1), torch.zeros_like(default)
            rows, targets, phase = [], [], torch.tensor([[0.0, np.pi]], dtype=torch.float64)
            for _ in range(STEPS):
                # A gait of one second, at 50 Hz.
                phase = (phase + 2 * np.pi / 50 + np.pi) % (2 * np.pi) - np.pi
                raw = draw(random, action, phase)
                with torch.no_grad():
                    action = network(manager.compute()["actor_obs"]).clamp(-limit, limit)
                rows.append(torch.cat([raw[term["name"]] for term in layout if term["name"] in raw]).numpy())
                targets.append((action * scale + default)[0].numpy())
            return rows, targets

        answers = {"rate_hz": 50, "gait_period": 1.0, "gravity": "vector", "default": default[0].tolist()}
        row(kind, "attach_onnx_metadata", make, episode=episode, accept_profile=True, answers=answers)


@package
def isaaclab():
    from types import SimpleNamespace as Stub

    import isaaclab.envs.mdp as mdp
    import torch
    import yaml
    from isaaclab.envs.utils.io_descriptors import export_articulations_data, export_scene_data
    from isaaclab.managers import ActionManager, ObservationGroupCfg, ObservationManager, ObservationTermCfg
    from isaaclab.utils import configclass
    from isaaclab.utils.string import resolve_matching_names

    names = [f"{leg}_{part}_joint" for part in ("hip", "thigh", "calf") for leg in ("FL", "FR", "RL", "RR")]
    default = torch.tensor([[0.1, -0.1, 0.1, -0.1, 0.8, 0.8, 1.0, 1.0, -1.5, -1.5, -1.5, -1.5]])

    class Data:
        """The measurements of a robot: the simulator needs a GPU."""

        def __getattr__(self, name):
            # Tensors are read through a property.
            return Stub(torch=torch.as_tensor(vars(self)["values"][name]))

    class Found(list):
        @property
        def torch(self):
            return torch.tensor(self)

    class Robot:
        joint_names, num_joints = names, len(names)

        def __init__(self):
            ones = torch.ones(1, len(names))
            self.data = Data()
            self.data.values = {
                "default_joint_pos": default, "default_joint_vel": 0 * ones, "joint_damping": 0.5 * ones, "joint_stiffness": 25 * ones,
                "joint_friction_coeff": 0 * ones, "joint_armature": 0 * ones,
                "default_joint_pos_limits": torch.tensor([[[-3.0, 3.0]] * len(names)]),
            }  # fmt: skip
            self.draw(torch.Generator())

        def find_joints(self, patterns, preserve_order=False, as_proxy=False):
            found, matched = resolve_matching_names(patterns, names, preserve_order)
            return Found(found) if as_proxy else found, matched

        def draw(self, random):
            def normal(length):
                return torch.randn((1, length), generator=random)

            self.data.values.update(
                joint_pos=default + 0.1 * normal(len(names)), joint_vel=normal(len(names)), root_lin_vel_b=normal(3), root_ang_vel_b=normal(3),
                projected_gravity_b=normal(3),
            )  # fmt: skip

    class Scene(dict):
        @property
        def articulations(self):
            return {"robot": self["robot"]}

    def term(function, **options):
        return ObservationTermCfg(func=function, **options)

    for kind, frames, order in (("Go2's terms", 0, "term"), ("Go2's terms, history of 3", 3, "term"), ("Go2's terms, history of 3, by time", 3, "time")):

        @configclass
        class Group(ObservationGroupCfg):
            base_lin_vel = term(mdp.base_lin_vel, scale=2.0)
            base_ang_vel = term(mdp.base_ang_vel, scale=0.25)
            projected_gravity = term(mdp.projected_gravity)
            velocity_commands = term(mdp.generated_commands, params={"command_name": "base_velocity"})
            joint_pos = term(mdp.joint_pos_rel)
            joint_vel = term(mdp.joint_vel_rel, scale=0.05, clip=(-20.0, 20.0))
            actions = term(mdp.last_action)

            def __post_init__(self, frames=frames, order=order):
                self.history_length, self.history_order = frames, order

        @configclass
        class Observations:
            policy: Group = Group()

        @configclass
        class Actions:
            joint_pos = mdp.JointPositionActionCfg(asset_name="robot", joint_names=[".*"], scale=0.25, use_default_offset=True)

        made = []

        def make(Observations=Observations, Actions=Actions, made=made):
            robot = Robot()
            env = Stub(
                num_envs=1, device="cpu", scene=Scene(robot=robot), sim=Stub(is_playing=lambda: True), physics_dt=0.005, step_dt=0.02, extras={},
                cfg=Stub(decimation=4),
            )  # fmt: skip
            env.command = torch.zeros(1, 3)
            env.command_manager = Stub(get_command=lambda name: env.command)
            env.action_manager = ActionManager(Actions(), env)
            env.observation_manager = ObservationManager(Observations(), env)
            length = env.observation_manager.group_obs_dim["policy"][0]
            torch.manual_seed(0)
            network = torch.nn.Sequential(torch.nn.Linear(length, 16), torch.nn.ELU(), torch.nn.Linear(16, len(names))).eval()
            path = folder("isaaclab")
            torch.onnx.export(
                network, (torch.zeros(1, length),), str(path / "policy.onnx"), input_names=["obs"], output_names=["actions"], dynamo=False
            )
            # As ManagerBasedEnv.export_IO_descriptors writes it.
            described = {
                "observations": env.observation_manager._collect_io_descriptors(),
                "actions": env.action_manager._collect_io_descriptors(),
                "articulations": export_articulations_data(env),
                "scene": export_scene_data(env),
            }
            (path / "IO_descriptors.yaml").write_text(yaml.safe_dump(described))
            made[:] = [env, robot, network]
            return str(path)

        def episode(made=made):
            env, robot, network = made
            random, rows, targets = torch.Generator().manual_seed(1), [], []
            for _ in range(STEPS):
                robot.draw(random)
                env.command = torch.randn((1, 3), generator=random)
                values = robot.data.values
                read = ("joint_pos", "joint_vel", "root_lin_vel_b", "root_ang_vel_b", "projected_gravity_b")
                rows.append(torch.cat([*(values[name][0] for name in read), env.command[0]]).numpy())
                with torch.no_grad():
                    action = network(env.observation_manager.compute(update_history=True)["policy"])
                env.action_manager.process_action(action)
                targets.append(env.action_manager.get_term("joint_pos").processed_actions[0].numpy().copy())
            return rows, targets

        form = "IO_descriptors.yaml"
        row(kind, form, make, episode=episode, accept_profile=True)
        if order == "time":
            row(kind, "with answers", make, episode=episode, accept_profile=True, answers={"history.layout": "frame"})


@package
def leapp():
    import torch
    from leapp import annotate
    from leapp.inference_manager import InferenceManager

    import leapp

    torch.manual_seed(0)
    body = torch.nn.Sequential(torch.nn.Linear(OBS + ACT, 24), torch.nn.ELU(), torch.nn.Linear(24, ACT))
    gru, lstm, out = torch.nn.GRU(OBS, 16), torch.nn.LSTM(OBS, 16), torch.nn.Linear(16, ACT)
    history = torch.nn.Sequential(torch.nn.Linear(3 * OBS, 24), torch.nn.ELU(), torch.nn.Linear(24, ACT))

    def fed_back(obs, last):
        action = body(torch.cat([obs, last], 1))
        return action, [action]

    def frames(obs, before):
        now = torch.cat([before[:, OBS:], obs], 1)
        return history(now), [now]

    def by_gru(obs, h):
        y, h = gru(obs[None], h)
        return out(y[0]), [h]

    def by_lstm(obs, h, c):
        y, (h, c) = lstm(obs[None], (h, c))
        return out(y[0]), [h, c]

    for kind, function, states in [
        ("last action fed back", fed_back, [(1, ACT)]),
        ("history of 3 frames", frames, [(1, 3 * OBS)]),
        ("GRU", by_gru, [(1, 1, 16)]),
        ("LSTM", by_lstm, [(1, 1, 16)] * 2),
    ]:
        for export in ("onnx-dynamo", "onnx-torchscript"):

            def make(function=function, states=states, export=export):
                path = folder("leapp")
                leapp.start("policy", save_path=str(path))
                with torch.no_grad():
                    obs = annotate.input_tensors("actor", {"obs": torch.zeros(1, OBS)})
                    held = annotate.state_tensors("actor", {f"s{i}": torch.zeros(shape) for i, shape in enumerate(states)})
                    action, after = function(obs, *(held if isinstance(held, tuple) else (held,)))
                    annotate.update_state("actor", {f"s{i}": state for i, state in enumerate(after)})
                    annotate.output_tensors("actor", {"action": action}, export_with=export)
                leapp.stop()
                leapp.compile_graph(visualize=False)
                return str(path / "policy")

            def act(rows):
                manager = InferenceManager(str(next(Path(tempfile.gettempdir(), "leapp", "policy").glob("*.yaml"))))
                (key,) = manager.inputs
                return [next(iter(manager({key: torch.from_numpy(obs[None])}).values())).reshape(-1).numpy().copy() for obs in rows]

            answers = {"rate_hz": 50, "target.action": "position"}
            row(kind, export, make, act, accept_profile=True, answers=answers)


if __name__ == "__main__":
    CASES[sys.argv[1]]()
