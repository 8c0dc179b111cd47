"""Trains an action-chunk head on recorded demonstrations and exports it: by L1 regression, or as a flow from noise to the chunk.

Usage: python train.py DEMONSTRATIONS.npz OUT_DIR [--head residual|flow] [--epochs N]
"""

import argparse
import json
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import save_file
from torch import nn
from torch.nn import functional as F

CHUNK, EXECUTE, ACT_DIM, CONTROL_HZ = 8, 4, 6, 50
BLOCKS, CLIP, EPS = 3, 5.0, 1e-5
WIDTH = {"residual": 320, "flow": 256}
# Flow: Euler steps, and the frequencies of the time code (cosine and sine alternate).
STEPS, FREQUENCIES = 5, [0.25, 0.5, 1.0, 2.0]
# The command limits of the simulated arm, rad/s.
LIMIT = [1.5, 1.5, 1.5, 2.0, 2.0, 2.0]


class Block(nn.Module):
    def __init__(self, width):
        super().__init__()
        self.ln = nn.LayerNorm(width, eps=EPS)
        self.fc = nn.Linear(width, width)

    def forward(self, x):
        return x + F.relu(self.fc(self.ln(x)))


class Trunk(nn.Module):
    """Normalised observation and further inputs of a head -> values of a normalised chunk, flattened step by step."""

    def __init__(self, obs_mean, obs_scale, width, others=0):
        super().__init__()
        self.obs_norm = nn.Module()
        self.obs_norm.register_buffer("mean", obs_mean)
        self.obs_norm.register_buffer("scale", obs_scale)
        self.inp = nn.Linear(len(obs_mean) + others, width)
        self.block = nn.Sequential(*[Block(width) for _ in range(BLOCKS)])
        self.ln = nn.LayerNorm(width, eps=EPS)
        self.out = nn.Linear(width, CHUNK * ACT_DIM)

    def forward(self, obs, *others):
        x = ((obs - self.obs_norm.mean) * self.obs_norm.scale).clamp(-CLIP, CLIP)
        return self.out(self.ln(self.block(F.relu(self.inp(torch.cat([x, *others], 1))))))


class Residual(Trunk):
    """Observation -> chunk."""

    def __init__(self, obs_mean, obs_scale):
        super().__init__(obs_mean, obs_scale, WIDTH["residual"])

    def loss(self, obs, target):
        return F.l1_loss(self(obs), target)

    def chunk(self, obs):
        return self(obs)


class Flow(Trunk):
    """Flow matching (Lipman et al., arXiv 2210.02747): the velocity on straight lines from noise at time 0 to the chunk at 1."""

    def __init__(self, obs_mean, obs_scale):
        super().__init__(obs_mean, obs_scale, WIDTH["flow"], 2 * len(FREQUENCIES) + CHUNK * ACT_DIM)
        self.time = nn.Module()
        self.time.register_buffer("freq", torch.tensor(FREQUENCIES))

    def velocity(self, obs, time, x):
        angle = 2 * torch.pi * time * self.time.freq
        return self(obs, angle.cos(), angle.sin(), x)

    def loss(self, obs, target):
        # Only the times of the Euler steps.
        time = torch.randint(STEPS, (len(obs), 1)) / STEPS
        noise = torch.randn_like(target)
        return F.mse_loss(self.velocity(obs, time, noise + time * (target - noise)), target - noise)

    def chunk(self, obs):
        x = torch.randn(len(obs), CHUNK * ACT_DIM)
        for step in range(STEPS):
            x = x + self.velocity(obs, torch.full((len(obs), 1), step / STEPS), x) / STEPS
        return x


def op_list(flow):
    """Returns the network as the list of operations in policy.json."""

    def linear(name):
        return {"op": "linear", "w": f"{name}.weight", "b": f"{name}.bias"}

    def layernorm(name):
        return {"op": "layernorm", "w_ln": f"{name}.weight", "b_ln": f"{name}.bias", "eps": EPS}

    # The observation of a flow is normalised before its ops.
    normalize = {"op": "normalize", "mean": "obs_norm.mean", "scale": "obs_norm.scale", "clip": CLIP}
    first = [linear("inp") | {"input": ["obs", "tfeat", "x"]}] if flow else [normalize, linear("inp")]
    ops = [*first, {"op": "relu", "save": "h0"}]
    for i in range(BLOCKS):
        ops += [
            layernorm(f"block.{i}.ln"),
            linear(f"block.{i}.fc"),
            {"op": "relu"},
            {"op": "add", "with": f"h{i}", "save": f"h{i + 1}"},
        ]
    # No operation reads the last block's saved output.
    del ops[-1]["save"]
    return ops + [layernorm("ln"), linear("out")]


def export(head, action_mean, action_std, out_dir):
    out_dir.mkdir(parents=True, exist_ok=True)
    save_file({k: v.contiguous() for k, v in head.state_dict().items()}, out_dir / "policy.safetensors")
    flow = isinstance(head, Flow)
    kind = {"kind": "flow", "steps": STEPS} if flow else {"kind": "chunk"}
    policy = {
        "name": "ur3_flow" if flow else "ur3_reach",
        **kind,
        "chunk": CHUNK,
        "execute": EXECUTE,
        "obs_dim": len(head.obs_norm.mean),
        "act_dim": ACT_DIM,
        "recurrent": False,
        "control_hz": CONTROL_HZ,
        "source": "behaviour cloning of the expert in examples/ur3",
        "license": "MIT OR Apache-2.0",
        "n_params": sum(p.numel() for p in head.parameters()),
        "action": {
            "scale": action_std.tolist(),
            "offset": action_mean.tolist(),
            "low": [-x for x in LIMIT],
            "high": LIMIT,
        },
        "ops": op_list(flow),
    }
    (out_dir / "policy.json").write_text(json.dumps(policy, indent=1) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("demonstrations", type=Path)
    parser.add_argument("out_dir", type=Path)
    parser.add_argument("--head", choices=["residual", "flow"], default="residual")
    parser.add_argument("--epochs", type=int, default=40)
    parser.add_argument("--batch", type=int, default=1024)
    parser.add_argument("--lr", type=float, default=1e-3)
    parser.add_argument("--threads", type=int, default=2)
    args = parser.parse_args()

    torch.manual_seed(0)
    torch.set_num_threads(args.threads)

    data = np.load(args.demonstrations)
    obs = torch.from_numpy(data["obs"])
    action = torch.from_numpy(data["action"])
    action_mean, action_std = action.mean((0, 1)), action.std((0, 1))
    target = ((action - action_mean) / action_std).flatten(1)

    # The last episodes are held out for validation.
    n_train = len(obs) * 19 // 20
    head = (Flow if args.head == "flow" else Residual)(obs[:n_train].mean(0), 1 / obs[:n_train].std(0))
    steps = args.epochs * (n_train // args.batch)
    optimizer = torch.optim.AdamW(head.parameters(), lr=args.lr, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, max_lr=args.lr, total_steps=steps)

    for epoch in range(args.epochs):
        total = 0.0
        batches = torch.randperm(n_train)[: n_train // args.batch * args.batch].view(-1, args.batch)
        for batch in batches:
            loss = head.loss(obs[batch], target[batch])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
            total += loss.item()
        with torch.no_grad():
            validation = F.l1_loss(head.chunk(obs[n_train:]), target[n_train:]).item()
        print(f"epoch {epoch + 1}: training loss {total / len(batches):.4f}, validation L1 {validation:.4f}", flush=True)

    export(head, action_mean, action_std, args.out_dir)


if __name__ == "__main__":
    main()
