"""On-policy rounds in Gymnasium's vector environments."""

import sys

import numpy as np
import pytest

import actq

gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed")
from gymnasium.vector import AutoresetMode, SyncVectorEnv  # noqa: E402


class Reach(gymnasium.Env):
    """A point is moved to a goal: [x, goal] of 6 dimensions each; the policy's first 4 actions move it."""

    def __init__(self, length=30):
        self.observation_space = gymnasium.spaces.Box(-10, 10, (12,), np.float32)
        self.action_space = gymnasium.spaces.Box(-1, 1, (4,), np.float32)
        self.length = length

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.steps, self.at = 0, self.np_random.normal(size=12).astype(np.float32)
        return self.at.copy(), {}

    def step(self, action):
        self.steps += 1
        self.at[:4] += 0.1 * action
        ended = self.steps >= self.length
        seen = np.full(12, np.nan, np.float32) if ended else self.at.copy()
        return seen, -float(np.abs(action).sum()), ended, False, {"is_success": bool(self.at[0] > 0)} if ended else {}


def envs(mode, n=3):
    return SyncVectorEnv([Reach] * n, autoreset_mode=mode)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_rollouts_record_what_the_policy_acted_on(mlp, mode):
    policy, env = actq.import_policy(mlp), envs(mode)
    image = actq.quantize(policy, bits=8, method="rtn", progress=False)
    driven = actq.rollout(actq.Head(image, 3), env, frames=400, seed=5)
    observations, starts = driven.recording
    assert observations.shape[1] == 12 and 400 <= len(observations) < 403
    # The last observation of an episode, here not a number, is not among them.
    assert np.isfinite(observations).all() and len(starts) == len(observations)
    lengths = np.diff(np.flatnonzero(np.append(starts, True)))
    assert set(lengths[lengths < 30]) <= {len(observations) // 3 % 30, -(-len(observations) // 3) % 30}
    assert len(driven.episodes) == (lengths == 30).sum() == 12
    assert driven.mean_return < 0 and 0 <= driven.success <= 1
    # The first observation of the first robot is that of its seed.
    assert np.array_equal(observations[0], Reach().reset(seed=5)[0])


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_every_robot_drives_as_many_whole_episodes(mlp, mode):
    image = actq.quantize(actq.import_policy(mlp), bits=8, method="rtn", progress=False)
    env = SyncVectorEnv([lambda length=length: Reach(length) for length in (5, 20, 40)], autoreset_mode=mode)
    shares = []
    driven = actq.rollout(actq.Head(image, 3), env, episodes=7, progress=lambda work, share: shares.append(share))
    assert sorted(episode.length for episode in driven.episodes) == [5, 5, 5, 20, 20, 40, 40]
    observations, starts = driven.recording
    assert starts.sum() == 7 and len(observations) == 135 and np.isfinite(observations).all()
    assert shares[-1] == 1 and repr(driven).startswith("Rollout(7 episodes, 135 frames, mean return -")
    with pytest.raises(actq.Error, match="frames and episodes are given; pass one of them"):
        actq.rollout(actq.Head(image, 3), env, episodes=7, frames=100)


@pytest.mark.parametrize("is_terminal", [False, True])
def test_rollouts_show_progress_on_a_terminal(monkeypatch, capsys, is_terminal):
    from actq import _progress

    monkeypatch.setitem(sys.modules, "IPython", None)
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    monkeypatch.setattr(_progress, "INTERVAL", 0.0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_terminal)
    act = lambda x, reset: x[:, :4]  # noqa: E731
    actq.rollout(act, envs(AutoresetMode.NEXT_STEP), frames=30)
    shown = capsys.readouterr().err
    assert shown.endswith("100%: driving\n") if is_terminal else shown == ""
    actq.rollout(act, envs(AutoresetMode.NEXT_STEP), frames=30, progress=False)
    assert capsys.readouterr().err == ""


def test_rounds_learn_from_their_rollouts(mlp):
    policy = actq.import_policy(mlp)
    tuned = [
        actq.tune(policy, envs(AutoresetMode.NEXT_STEP), bpw=2.5, rounds=2, frames=300, steps=20, progress=False)
        for _ in range(2)
    ]
    first, second = tuned
    assert first.image == second.image, "the same seed gives the same image"
    assert first.image == first.rounds[-1].image and len(first.rounds) == 3
    frames = [row.frames for row in first.rounds]
    # About a tenth of the f32 policy's frames is held out for the error.
    assert 240 <= frames[0] < 300 and [n - frames[0] for n in frames] == [0, 300, 600]
    assert first.image.bits_per_weight <= 2.5
    assert all(row.own_nmse < 1 and len(row.rollout.episodes) == 9 for row in first.rounds)
    assert "own path" in str(first)


def test_rounds_keep_the_budgets_of_quantize(mlp, observations):
    policy, env = actq.import_policy(mlp), envs(AutoresetMode.SAME_STEP)
    given = {"flash": "3K", "ms": 0.2, "clock": 100e6, "steps": 5, "frames": 100, "progress": False}
    tuned = actq.tune(policy, env, observations, **given)
    assert len(tuned.image) <= 3 * 1024 and tuned.image.cost(clock=100e6)["milliseconds"] <= 0.2
    with pytest.raises(actq.Error, match="more than one budget is given"):
        actq.tune(policy, env, observations, bpw=2, flash=3000, progress=False)
    with pytest.raises(actq.Error, match='effort is "slow"'):
        actq.tune(policy, env, observations, effort="slow", progress=False)


def test_recordings_and_functions_of_the_caller(mlp, observations):
    told = []

    def success(episode):
        told.append(episode)
        return episode.length == 30

    tuned = actq.tune(
        actq.import_policy(mlp),
        envs(AutoresetMode.SAME_STEP),
        observations,
        bits=4,
        frames=100,
        observe=lambda seen: np.nan_to_num(seen),
        act=lambda actions: np.tanh(actions),
        success=success,
        steps=5,
        progress=False,
    )
    assert tuned.rounds[0].frames == 450 and tuned.rounds[1].frames >= 550
    assert told and all(episode.terminated and "is_success" in episode.info for episode in told)
    assert tuned.rounds[0].rollout.success == 1.0


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_infos_may_be_nested_or_of_all_robots(mode):
    class Logging(SyncVectorEnv):
        def step(self, actions):
            *rest, infos = super().step(actions)
            return (*rest, {**infos, "reconfigure": False, "log": {"loss": np.float32(1.5)}, "weights": np.zeros(7)})

    make = lambda: gymnasium.wrappers.RecordEpisodeStatistics(Reach())  # noqa: E731
    driven = actq.rollout(
        lambda x, reset: x[:, :4], Logging([make] * 3, autoreset_mode=mode), frames=300, success=lambda e: e.total < 0
    )
    for episode in driven.episodes:
        assert episode.info["episode"]["l"] == 30 and episode.info["episode"]["r"] == pytest.approx(episode.total)
    if mode is not AutoresetMode.SAME_STEP:
        assert all(e.info["reconfigure"] is False and e.info["log"]["loss"] == 1.5 and len(e.info["weights"]) == 7 for e in driven.episodes)


def test_arguments_of_rollouts_are_named(mlp):
    env = envs(AutoresetMode.NEXT_STEP)
    act = lambda x, reset: x[:, :4]  # noqa: E731
    for arguments, text in [
        ({"frames": 0}, "frames is 0; use a whole number from 1 on"),
        ({"frames": None, "episodes": 0}, "episodes is 0; use a whole number from 1 on"),
        ({"frames": float("nan")}, "frames is nan; use a whole number"),
        ({"every": 1.5}, "every is 1.5; use a whole number"),
        ({"every": 0}, "every is 0"),
        ({"policy": 3}, "the policy is of type int; pass actq.Head"),
        ({"env": Reach()}, "env is one environment; pass a vector environment"),
        ({"policy": actq.import_policy(mlp)}, "the policy is of type Policy; pass actq.Head"),
        ({"policy": lambda x, reset: x[:, :3]}, r"the policy's actions are \(3, 3\); the environment takes \(3, 4\)"),
        ({"policy": lambda x, reset: np.zeros((6, 2))}, r"the policy's actions are \(6, 2\)"),
    ]:
        with pytest.raises(actq.Error, match=text):
            actq.rollout(**{"policy": act, "env": env, "frames": 10, **arguments})
    box = gymnasium.spaces.Box(-1, 1, (2,))

    class Parts(Reach):
        def __init__(self, space):
            super().__init__()
            self.observation_space = space

        def reset(self, *, seed=None, options=None):
            parts = [np.full(2, i, np.float32) for i in range(2)]
            return (dict(zip("ba", parts)) if isinstance(self.observation_space, gymnasium.spaces.Dict) else tuple(parts)), {}

    with pytest.raises(actq.Error, match="the environment's observations are Tuple.*; pass observe"):
        actq.rollout(act, SyncVectorEnv([lambda: Parts(gymnasium.spaces.Tuple([box, box]))]), frames=10)
    # The order of the space, as import_policy takes it.
    seen = []
    with pytest.raises(actq.Error, match=r"the policy's actions are \(1, 3\)"):
        dictionary = gymnasium.spaces.Dict({"b": box, "a": box})
        env = SyncVectorEnv([lambda: Parts(dictionary)])
        actq.rollout(lambda x, reset: seen.append(x) or x[:, :3], env, frames=10)
    assert list(dictionary.spaces) == ["a", "b"] and seen[0].tolist() == [[1, 1, 0, 0]]


def test_discrete_actions_are_the_largest(mlp):
    from actq._rollout import _actions

    class Env:
        num_envs, single_action_space = 2, gymnasium.spaces.Discrete(4, start=1)

    assert _actions(Env)(np.array([[0, 3, 1, 2], [9, 3, 1, 2]])).tolist() == [2, 1]


def test_exceptions_of_the_environment_end_the_rounds(mlp):
    class Broken(Reach):
        def step(self, action):
            raise RuntimeError("broken")

    with pytest.raises(RuntimeError, match="broken"):
        actq.tune(actq.import_policy(mlp), SyncVectorEnv([Broken]), bpw=3, steps=5, frames=10, progress=False)
    with pytest.raises(actq.Error, match=r"the observations have the shape \[1, 4\]; use \[12\] for one"):
        env = gymnasium.make_vec("CartPole-v1", num_envs=1)
        actq.tune(actq.import_policy(mlp), env, bpw=3, steps=5, frames=10, progress=False)
    with pytest.raises(actq.Error, match="rounds is 0; use 1 to 100 rounds"):
        env = envs(AutoresetMode.NEXT_STEP)
        actq.tune(actq.import_policy(mlp), env, np.zeros((1, 12)), bpw=3, rounds=0, frames=10, progress=False)
