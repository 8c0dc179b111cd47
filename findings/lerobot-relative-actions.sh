#!/bin/sh
# lerobot 0.6.1 (read from its wheel): lerobot-eval of a policy with relative actions (pi0, pi0.5: use_relative_actions) commands other actions than the policy means from the second step of
# each chunk on. Actions of a chunk are relative to the state that the chunk was computed from; the evaluation adds the state of the step in which one is taken from the queue, so that
# each motion is added to those before it. There is no error: the success rate is that of another policy. lerobot-rollout knows it and refuses such a policy, the evaluation does not.
# Seen on 2026-11-29:  chunk +1, +2, +3 from state 0 means 1, 2, 3; commanded 1, 3, 6   with one action a chunk: 1, 2, 3
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q numpy==2.4.6
v/bin/pip download -q --no-deps --only-binary=:all: --python-version 3.12 lerobot==0.6.1
v/bin/python - <<'PY'
import __future__, ast, collections, contextlib, copy, dataclasses, enum, glob, types, zipfile

import numpy as np

wheel = zipfile.ZipFile(glob.glob("lerobot-*.whl")[0])
source = lambda path: wheel.read(f"lerobot/{path}.py").decode()


class Tensor(np.ndarray):
    """An array with what the package's functions below call of a tensor."""

    device = "cpu"
    clone = np.ndarray.copy
    to = lambda self, *_, **__: self
    numpy = lambda self: np.array(self)
    transpose = lambda self, a, b: np.swapaxes(self, a, b)
    unsqueeze = lambda self, axis: np.expand_dims(self, axis)


tensor = lambda values, dtype=None, device=None: np.array(values, dtype).view(Tensor)
torch = types.SimpleNamespace(
    Tensor=Tensor, tensor=tensor, from_numpy=tensor, inference_mode=contextlib.nullcontext, stack=lambda values, dim: np.stack(values, dim).view(Tensor), no_grad=lambda: lambda f: f
)


def take(path, *wanted, **names):
    """Functions and classes of a file of the package, as they are."""
    nodes = [node for node in ast.walk(ast.parse(source(path))) if getattr(node, "name", "") in wanted]
    names |= {"torch": torch, "Tensor": Tensor, "np": np}
    exec(compile(ast.Module(nodes, []), path, "exec", flags=__future__.annotations.compiler_flag), names)
    return [names[name] for name in wanted]


TransitionKey = enum.Enum("TransitionKey", "OBSERVATION ACTION")
step_names = dict(dataclass=dataclasses.dataclass, field=dataclasses.field, ProcessorStep=object, TransitionKey=TransitionKey, OBS_STATE="observation.state")
step_names["ProcessorStepRegistry"] = types.SimpleNamespace(register=lambda _: lambda step: step)
Relative, Absolute, *_ = take(
    "processor/relative_action_processor", "RelativeActionsProcessorStep", "AbsoluteActionsProcessorStep", "to_absolute_actions", "to_relative_actions", **step_names
)
[select_action] = take("policies/pi05/modeling_pi05", "select_action")
stub = lambda *_, **__: types.SimpleNamespace(set_postfix=stub, update=stub)
[rollout] = take(
    "scripts/lerobot_eval", "rollout", nn=types.SimpleNamespace(Module=object), deepcopy=copy.deepcopy, trange=stub, inside_slurm=stub, check_env_attributes_and_types=stub,
    preprocess_observation=dict, NEW_ROLLOUT_OPTION="new", ACTION="action", einops=types.SimpleNamespace(reduce=lambda *_: tensor([0.0])),
)


class Policy:
    """Wants the joint at 1, 2, 3 in the next three steps, as actions relative to the state."""

    def __init__(self, length):
        self.config, self._action_queue = types.SimpleNamespace(n_action_steps=length), collections.deque()

    eval = reset = _rtc_enabled = lambda self: False
    select_action = select_action

    def predict_action_chunk(self, observation):
        state = float(observation["observation.state"][0, 0])
        return tensor([[[target - state] for target in (state + 1, state + 2, state + 3)]])


class Joint:
    """A joint that is, after a step, where it was told to be."""

    num_envs = 1

    def reset(self, **_):
        self.told = []
        return {"observation.state": tensor([[0.0]])}, {}

    def call(self, name):
        return [3 if name == "_max_episode_steps" else name]

    def step(self, action):
        self.told.append(float(action[0, 0]))
        no = np.array([False])
        return {"observation.state": tensor(action)}, np.array([0.0]), no, no, {}


def commanded(length):
    relative, joint = Relative(enabled=True), Joint()
    absolute = Absolute(enabled=True, relative_step=relative)

    def preprocessor(observation):
        return relative({TransitionKey.OBSERVATION: observation})[TransitionKey.OBSERVATION]

    def postprocessor(action):
        return absolute({TransitionKey.ACTION: action})[TransitionKey.ACTION]

    same = lambda value: value
    rollout(joint, Policy(length), same, same, preprocessor, postprocessor)
    print(f"{length} actions of a chunk are used: commanded {joint.told}")
    return joint.told


assert commanded(1) == [1, 2, 3]
assert commanded(3) == [1, 3, 6]
assert "does not support policies with relative actions" in source("rollout/context")
assert "elative_actions" not in source("scripts/lerobot_eval") and "RelativeActions" not in source("scripts/lerobot_eval")
PY
