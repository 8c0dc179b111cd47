"""Trains the balancer's policy on the expert's demonstrations and exports it as ONNX.

Usage: python train.py DEMONSTRATIONS.npz bundle/policy.onnx
"""

import sys

import numpy as np
import torch
from torch import nn

HISTORY, WIDTH, EPOCHS, BATCH, RATE, TORQUE = 4, 128, 12, 2048, 2e-3, 0.6


def gravity(q):
    """Returns the direction of gravity in the body's frame for orientations w, x, y, z."""
    w, x, y, z = q.T
    return np.stack([2 * (w * y - x * z), -2 * (y * z + w * x), -1 + 2 * (x * x + y * y)], 1)


def observations(data, history=HISTORY):
    """Returns what bundle/deploy.toml makes of the recorded raw values."""
    raw, first = data["raw"], data["first"][:, 0] > 0
    last = np.roll(data["applied"][:, ::-1] / TORQUE, 1, axis=0)
    last[first] = 0
    # Raw values: gyro, orientation, wheel velocities (right, left), command.
    frame = np.concatenate([0.25 * raw[:, :3], gravity(raw[:, 3:7]), raw[:, 9:], 0.05 * raw[:, 8:6:-1], last], 1)
    begin = np.maximum.accumulate(np.where(first, np.arange(len(frame)), 0))
    frames = [frame[np.maximum(np.arange(len(frame)) - age, begin)] for age in reversed(range(history))]
    return torch.from_numpy(np.concatenate(frames, 1).astype(np.float32))


def main():
    demonstrations, out = sys.argv[1:]
    torch.manual_seed(0)
    torch.set_num_threads(2)
    data = np.load(demonstrations)
    obs, action = observations(data), torch.from_numpy(data["torque"][:, ::-1] / TORQUE)
    policy = nn.Sequential(
        nn.Linear(obs.shape[1], WIDTH), nn.ELU(), nn.Linear(WIDTH, WIDTH), nn.ELU(), nn.Linear(WIDTH, action.shape[1])
    )
    # The last episodes are held out for validation.
    n_train = len(obs) * 19 // 20
    steps = EPOCHS * (n_train // BATCH)
    optimizer = torch.optim.AdamW(policy.parameters(), lr=RATE, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, max_lr=RATE, total_steps=steps)
    for epoch in range(EPOCHS):
        for batch in torch.randperm(n_train)[: n_train // BATCH * BATCH].view(-1, BATCH):
            loss = nn.functional.mse_loss(policy(obs[batch]), action[batch])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
        with torch.no_grad():
            error = nn.functional.mse_loss(policy(obs[n_train:]), action[n_train:]) / action[n_train:].var()
        print(f"epoch {epoch + 1}: validation NMSE {error.item():.5f}", flush=True)
    torch.onnx.export(
        policy, obs[:1], out, input_names=["observation"], output_names=["action"], dynamo=False, opset_version=17
    )


if __name__ == "__main__":
    main()
