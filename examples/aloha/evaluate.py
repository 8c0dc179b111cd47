"""Drives the task: 100 episodes with the f32 network, or with images.

Usage: python evaluate.py [--late PERIODS] [--episodes N] [--bits-of IMAGE.actq] POLICY.onnx|IMAGE.actq|PORT ...

PORT is that of a controller that runs an image, as tcp:127.0.0.1:5331; with --bits-of, its actions must have the bits of
that image on this machine.
"""

import argparse
import json
import subprocess

import numpy as np
import onnxruntime
from task import ACTIONS, DONE, STEPS, Task

FIRST_SEED = 1000


class Served:
    """`actq serve`, whose network takes some control periods, or `actq link serve`."""

    def __init__(self, name, late):
        is_image = name.endswith(".actq")
        command = ["actq", "serve", name, "--late", str(late)] if is_image else ["actq", "link", "serve", name]
        self.served = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def reset(self):
        self.served.stdin.write(b"R")

    def __call__(self, frame):
        self.served.stdin.write(b"S" + frame.tobytes())
        self.served.stdin.flush()
        return np.frombuffer(self.served.stdout.read(4 * ACTIONS), np.float32)


class Network:
    """The f32 network with the steps of sampler.json, played as an image is."""

    def __init__(self, path, late):
        self.session, self.late = onnxruntime.InferenceSession(path), late
        with open("sampler.json") as file:
            self.sampler = json.load(file)
        self.random = np.random.default_rng(0)
        self.reset()

    def reset(self):
        self.chunk, self.age, self.wait = np.zeros((0, ACTIONS)), 0, None

    def run(self, frame):
        steps, action = self.sampler["steps"], self.sampler["action"]
        chunk = self.random.normal(size=self.session.get_inputs()[0].shape).astype(np.float32)
        for step in range(steps):
            time = np.full((1, 1), step / steps, np.float32)
            (velocity,) = self.session.run(None, {"chunk": chunk, "time": time, "frame": frame[None]})
            chunk = chunk + velocity / np.float32(steps)
        return np.clip(chunk[0] * action["std"] + action["mean"], action["low"], action["high"])

    def __call__(self, frame):
        if self.wait is None and self.age >= min(self.sampler["execute"], len(self.chunk)):
            self.next, self.wait = self.run(frame), self.late
        if self.wait == 0:
            old, new = self.chunk[self.age :], self.next[self.late :]
            fading = min(self.sampler["overlap"], len(old), len(new))
            for k in range(fading):
                share = (k + 1) / (fading + 1)
                new[k] = old[k] * (1 - share) + new[k] * share
            self.chunk, self.age, self.wait = self.next, self.late, None
        elif self.wait:
            self.wait -= 1
        self.age += 1
        played = self.chunk[self.age - 1 : self.age]
        return played[0] if len(played) else np.full(ACTIONS, np.nan)


def main():
    parser = argparse.ArgumentParser(usage=__doc__.partition("Usage: python ")[2])
    parser.add_argument("--late", type=int, default=0)
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--bits-of")
    parser.add_argument("policies", nargs="+")
    args = parser.parse_args()
    host = Served(args.bits_of, args.late) if args.bits_of else None
    task = Task()
    for name in args.policies:
        policy = (Network if name.endswith(".onnx") else Served)(name, args.late)
        successes = actions = 0
        for seed in range(FIRST_SEED, FIRST_SEED + args.episodes):
            frame = task.reset(seed)
            policy.reset()
            if host:
                host.reset()
            # Before the first chunk the arms stay where they are.
            action = frame[:ACTIONS]
            for _ in range(STEPS):
                answer = policy(np.float32(frame))
                actions += 1
                if host and host(np.float32(frame)).tobytes() != answer.tobytes():
                    raise SystemExit(f"{name}: action {actions} has other bits than {args.bits_of}")
                action = action if np.isnan(answer).any() else answer
                frame, reward = task.step(action)
                if reward == DONE:
                    successes += 1
                    break
        print(f"{name}, {args.late} periods late: {successes} of {args.episodes} episodes, {actions} actions", flush=True)


if __name__ == "__main__":
    main()
