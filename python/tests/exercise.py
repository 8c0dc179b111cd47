"""Calls every part of the extension with small inputs, right and wrong ones: the program for valgrind.

    PYTHONMALLOC=malloc valgrind --error-exitcode=9 --num-callers=30 python tests/exercise.py
"""

import pickle
import sys
import tempfile
from pathlib import Path

import numpy as np

import actq
from conftest import UR3, write_mlp


def refused(call, *arguments, **options):
    try:
        call(*arguments, **options)
    except (actq.Error, TypeError):
        return
    raise SystemExit(f"{call} accepted {arguments} {options}")


def main():
    policy = actq.import_policy(UR3)
    random = np.random.default_rng(0)
    rows = random.normal(size=(300, policy.obs_len)).astype(np.float32)
    image = actq.quantize(policy, bits=2, method="rtn", progress=False)
    actq.evaluate(image, rows[:20], policy)
    with tempfile.TemporaryDirectory() as folder:
        layers = [(random.normal(size=(6, 8)), np.zeros(8)), (random.normal(size=(8, 2)), np.zeros(2))]
        small = actq.import_policy(write_mlp(Path(folder, "small.onnx"), layers))
    actq.quantize(small, rows[:, :6], bits=4, steps=20, progress=lambda work, share: None)
    refused(actq.quantize, policy, rows[:, :3], progress=False)
    refused(actq.quantize, policy, [rows, {"obs": rows, "length": np.array([400])}], progress=False)
    refused(actq.quantize, policy, (rows, np.zeros(7, dtype=bool)), progress=False)
    for n in (1, 7, 64):
        head = actq.Head(image, n)
        for step in range(10):
            head(rows[:n], random.random(n) < 0.2)
        refused(head, rows[: n + 1])
        refused(head, np.full((n, policy.obs_len), np.nan))
        refused(head, rows[:n], np.zeros(n + 1, dtype=bool))
        head.reset()
    actq.Head(image)(np.asfortranarray(rows)[::3, :])
    assert pickle.loads(pickle.dumps(image)) == image
    refused(actq.Image, image.bytes[:-4])
    for at in range(0, len(image.bytes), len(image.bytes) // 50):
        damaged = bytearray(image.bytes)
        damaged[at] ^= 1
        refused(actq.Image, bytes(damaged))
    with tempfile.TemporaryDirectory() as folder:
        image.save(Path(folder, "i.actq"))
        actq.Image.load(Path(folder, "i.actq")).export_c(Path(folder, "c"))
        image.to_onnx(Path(folder, "i.onnx"))
    image.network(), image.inspect(), image.cost(), image.ports, repr(image), repr(head), repr(policy)
    refused(actq.Link, "unix:/none")
    try:
        actq.quantize(small, rows[:, :6], bits=4, progress=lambda work, share: sys.exit(0))
    except SystemExit:
        print("done")


if __name__ == "__main__":
    main()
