"""Trains a flow transformer on demonstrations, and exports its network as ONNX.

Usage: python train.py DEMONSTRATIONS.npz policy.onnx

The network takes a chunk between noise (time 0) and actions (time 1), that time, and the observation, and gives the chunk's
velocity. A token is a patch of actions. Tokens attend to each other, and to tokens of the observation, whose keys and values
do not depend on the time, so that a controller computes them once a chunk.
"""

import json
import sys

import numpy as np
import torch
from torch import nn


CHUNK, PATCH, OBSERVED = 16, 4, 2
LAYERS, HEADS, WIDTH, INNER = 4, 5, 160, 640
STEPS, BATCH, RATE = 6000, 192, 1e-3


class Layer(nn.Module):
    def __init__(self):
        super().__init__()
        self.norms = nn.ModuleList([nn.LayerNorm(WIDTH), nn.LayerNorm(WIDTH)])
        self.query, self.keys, self.out = nn.Linear(WIDTH, WIDTH), nn.Linear(WIDTH, 2 * WIDTH), nn.Linear(WIDTH, WIDTH)
        self.inner = nn.Sequential(nn.Linear(WIDTH, INNER), nn.GELU(approximate="tanh"), nn.Linear(INNER, WIDTH))

    def heads(self, x):
        return x.unflatten(-1, (HEADS, -1)).transpose(1, 2)

    def forward(self, x, observed):
        tokens = self.norms[0](torch.cat([observed, x], 1))
        keys, values = self.keys(tokens).chunk(2, -1)
        queries, keys, values = map(self.heads, (self.query(tokens[:, OBSERVED:]), keys, values))
        scores = queries @ keys.transpose(2, 3) * (WIDTH // HEADS) ** -0.5
        x = x + self.out((scores.softmax(-1) @ values).transpose(1, 2).flatten(2))
        return x + self.inner(self.norms[1](x))


class Network(nn.Module):
    def __init__(self, frames, actions):
        super().__init__()
        for name, array in [("frame", frames), ("action", actions)]:
            self.register_buffer(f"{name}_mean", array.mean(0))
            self.register_buffer(f"{name}_deviation", array.std(0).clamp(min=1e-2))
        observed, self.joints = frames.shape[1], actions.shape[1]
        self.register_buffer("frequencies", torch.pi * 2.0 ** torch.arange(4))
        self.observe = nn.Sequential(
            nn.Linear(observed, 2 * WIDTH),
            nn.GELU(approximate="tanh"),
            nn.Linear(2 * WIDTH, OBSERVED * WIDTH),
            nn.Unflatten(1, (OBSERVED, WIDTH)),
        )
        self.time = nn.Sequential(nn.Linear(8, WIDTH), nn.GELU(approximate="tanh"), nn.Linear(WIDTH, WIDTH))
        self.first, self.last = nn.Linear(PATCH * self.joints, WIDTH), nn.Linear(WIDTH, PATCH * self.joints)
        self.places = nn.Parameter(0.02 * torch.randn(CHUNK // PATCH, WIDTH))
        self.layers = nn.ModuleList([Layer() for _ in range(LAYERS)])
        self.norm = nn.LayerNorm(WIDTH)

    def forward(self, chunk, time, frame):
        observed = self.observe((frame - self.frame_mean) / self.frame_deviation)
        angles = time * self.frequencies
        x = self.first(chunk.unflatten(1, (-1, PATCH)).flatten(2)) + self.places
        x = x + self.time(torch.cat([angles.cos(), angles.sin()], 1))[:, None]
        for layer in self.layers:
            x = layer(x, observed)
        return self.last(self.norm(x)).unflatten(2, (PATCH, -1)).flatten(1, 2)


def export(network, path):
    example = [torch.randn(1, CHUNK, network.joints), torch.zeros(1, 1), torch.randn(1, len(network.frame_mean))]
    torch.onnx.export(
        network.eval(),
        tuple(example),
        path,
        input_names=["chunk", "time", "frame"],
        output_names=["velocity"],
        dynamo=False,
        opset_version=17,
    )


def main():
    demonstrations, out = sys.argv[1:]
    torch.manual_seed(0)
    torch.set_num_threads(1)
    data = np.load(demonstrations)
    frames, actions = (torch.from_numpy(data[name]) for name in ("obs", "target"))
    network = Network(frames.flatten(0, 1), actions.flatten(0, 1))
    print(f"{sum(p.numel() for p in network.parameters())} parameters")
    targets = (actions - network.action_mean) / network.action_deviation
    # A chunk past an episode's end repeats its last action.
    targets = torch.cat([targets, targets[:, -1:].expand(-1, CHUNK, -1)], 1)
    optimizer = torch.optim.AdamW(network.parameters(), lr=RATE, weight_decay=1e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, max_lr=RATE, total_steps=STEPS)
    mean = 0.0
    for step in range(1, STEPS + 1):
        episode, at = torch.randint(len(frames), (BATCH,)), torch.randint(frames.shape[1], (BATCH,))
        chunk = targets[episode[:, None], at[:, None] + torch.arange(CHUNK)]
        noise, time = torch.randn_like(chunk), torch.rand(BATCH, 1)
        velocity = network(noise + time[:, None] * (chunk - noise), time, frames[episode, at])
        loss = nn.functional.mse_loss(velocity, chunk - noise)
        optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        schedule.step()
        mean += (loss.item() - mean) / min(step, 100)
        if step % 500 == 0:
            print(f"step {step} of {STEPS}: loss {mean:.4f}", flush=True)
    export(network, out)
    ends = [actions.flatten(0, 1).min(0).values, actions.flatten(0, 1).max(0).values]
    action = {"mean": network.action_mean, "std": network.action_deviation, "low": ends[0], "high": ends[1]}
    sampler = {"kind": "flow", "steps": 4, "execute": 8, "overlap": 8, "time": {"from": 0, "to": 1}}
    with open("sampler.json", "w") as file:
        json.dump({**sampler, "action": {key: values.tolist() for key, values in action.items()}}, file)


if __name__ == "__main__":
    main()
