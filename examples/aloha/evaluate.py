"""Drives the task: 100 episodes with the f32 network, or with images.

Usage: python evaluate.py POLICY.onnx|IMAGE.actq ...
"""

import json
import sys

import actq
import numpy as np
import onnxruntime
from task import DONE, STEPS, Task

EPISODES, FIRST_SEED = 100, 1000


class Network:
    """The f32 network, with the steps of sampler.json."""

    def __init__(self, path):
        self.session = onnxruntime.InferenceSession(path)
        with open("sampler.json") as file:
            sampler = json.load(file)
        self.steps, self.execute, self.action = sampler["steps"], sampler["execute"], sampler["action"]
        self.random = np.random.default_rng(0)

    def reset(self):
        self.left = []

    def __call__(self, frame):
        if not self.left:
            shape = self.session.get_inputs()[0].shape
            chunk = self.random.normal(size=shape).astype(np.float32)
            for step in range(self.steps):
                time = np.full((1, 1), step / self.steps, np.float32)
                (velocity,) = self.session.run(None, {"chunk": chunk, "time": time, "frame": frame[None]})
                chunk = chunk + velocity / np.float32(self.steps)
            actions = chunk[0] * self.action["std"] + self.action["mean"]
            self.left = list(np.clip(actions, self.action["low"], self.action["high"])[: self.execute])
        return self.left.pop(0)


def main():
    task = Task()
    for name in sys.argv[1:]:
        policy = actq.Head(actq.Image.load(name)) if name.endswith(".actq") else Network(name)
        successes = 0
        for seed in range(FIRST_SEED, FIRST_SEED + EPISODES):
            frame = task.reset(seed)
            policy.reset()
            for _ in range(STEPS):
                frame, reward = task.step(np.squeeze(policy(np.float32(frame))))
                if reward == DONE:
                    successes += 1
                    break
        print(f"{name}: {successes} of {EPISODES} episodes", flush=True)


if __name__ == "__main__":
    main()
