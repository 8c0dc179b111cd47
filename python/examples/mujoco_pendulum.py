"""Trains a policy by Stable-Baselines3 in MuJoCo, and drives it by an image of 2 bits.

    pip install "stable-baselines3" "gymnasium[mujoco]" torch
    python mujoco_pendulum.py --steps 40000
"""

from __future__ import annotations

import argparse
from typing import Any, Tuple

import gymnasium
import numpy as np
import numpy.typing as npt
import torch
from stable_baselines3 import PPO

import actq

ENVIRONMENT = "InvertedPendulum-v5"


def train(steps: int) -> torch.nn.Module:
    """Returns the mean of the trained policy's actions as a module."""
    model = PPO("MlpPolicy", ENVIRONMENT, seed=0, device="cpu", n_steps=1024, learning_rate=1e-3).learn(steps)
    return torch.nn.Sequential(model.policy.mlp_extractor.policy_net, model.policy.action_net)


def compare(steps: int, frames: int, bpw: float, learning: int | None = None) -> Tuple[float, float, actq.Image]:
    """Returns the mean returns of the f32 policy and of an image, and the image."""
    actor = train(steps)
    env = gymnasium.make_vec(ENVIRONMENT, num_envs=8)
    example = torch.zeros(1, *(env.single_observation_space.shape or ()))
    policy = actq.import_policy(actor, example, name=ENVIRONMENT)

    def f32(observations: npt.NDArray[np.float32], reset: Any) -> npt.NDArray[Any]:
        with torch.no_grad():
            return np.asarray(actor(torch.from_numpy(observations)))

    trained = actq.rollout(f32, env, frames=frames)
    image = actq.quantize(policy, trained.recording, bpw=bpw, steps=learning)
    driven = actq.rollout(actq.Head(image), env, frames=frames, seed=2)
    env.close()
    return trained.mean_return or 0.0, driven.mean_return or 0.0, image


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=40_000, help="of training")
    parser.add_argument("--frames", type=int, default=20_000, help="of each rollout")
    parser.add_argument("--bpw", type=float, default=2.0, help="bits per weight")
    parser.add_argument("--out", default="pendulum.actq")
    args = parser.parse_args()
    trained, driven, image = compare(args.steps, args.frames, args.bpw)
    image.save(args.out)
    print(f"mean return: {trained:.0f} in float32, {driven:.0f} at {image.bits_per_weight:.2f} bits per weight")


if __name__ == "__main__":
    main()
