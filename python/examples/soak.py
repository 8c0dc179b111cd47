"""Steps a batch of robots for a long time, and fails if memory grows.

    python soak.py walker.actq --robots 4096 --steps 10000000
"""

from __future__ import annotations

import argparse
import os
import time

import numpy as np

import actq


def resident() -> int:
    """Returns the bytes of this process in memory."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def step(image: actq.Image, robots: int, steps: int, most_growth: int) -> float:
    """Makes about `steps` steps of all robots together; returns steps per second."""
    head = actq.Head(image, robots)
    random = np.random.default_rng(0)
    observations = random.normal(size=(robots, image.obs_len)).astype(np.float32)
    rounds = -(-steps // robots)
    # What is allocated once is there after a tenth.
    warm, begun = max(1, rounds // 10), time.perf_counter()
    before = 0
    for i in range(rounds):
        if i == warm:
            before = resident()
        head(observations, random.random(robots) < 0.01)
    growth = resident() - before
    if growth > most_growth:
        raise SystemExit(f"memory grew by {growth} bytes in {rounds - warm} calls")
    return robots * rounds / (time.perf_counter() - begun)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("image")
    parser.add_argument("--robots", type=int, default=4096)
    parser.add_argument("--steps", type=int, default=10_000_000)
    parser.add_argument("--most-growth", type=int, default=4 << 20, help="bytes")
    args = parser.parse_args()
    rate = step(actq.Image.load(args.image), args.robots, args.steps, args.most_growth)
    print(f"{args.steps} steps, {rate:.0f} a second, flat memory")


if __name__ == "__main__":
    main()
