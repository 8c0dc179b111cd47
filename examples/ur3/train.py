"""Trains an action-chunk head by L1 regression on recorded demonstrations and exports it.

Usage: python train.py DEMONSTRATIONS.npz OUT_DIR [--epochs N]
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
WIDTH, BLOCKS, CLIP, EPS = 320, 3, 5.0, 1e-5
# The command limits of the simulated arm, rad/s.
LIMIT = [1.5, 1.5, 1.5, 2.0, 2.0, 2.0]


class Block(nn.Module):
    def __init__(self):
        super().__init__()
        self.ln = nn.LayerNorm(WIDTH, eps=EPS)
        self.fc = nn.Linear(WIDTH, WIDTH)

    def forward(self, x):
        return x + F.relu(self.fc(self.ln(x)))


class Head(nn.Module):
    """Observation -> normalised chunk of actions, flattened step by step."""

    def __init__(self, obs_mean, obs_scale):
        super().__init__()
        self.obs_norm = nn.Module()
        self.obs_norm.register_buffer("mean", obs_mean)
        self.obs_norm.register_buffer("scale", obs_scale)
        self.inp = nn.Linear(len(obs_mean), WIDTH)
        self.block = nn.Sequential(*[Block() for _ in range(BLOCKS)])
        self.ln = nn.LayerNorm(WIDTH, eps=EPS)
        self.out = nn.Linear(WIDTH, CHUNK * ACT_DIM)

    def forward(self, obs):
        x = ((obs - self.obs_norm.mean) * self.obs_norm.scale).clamp(-CLIP, CLIP)
        return self.out(self.ln(self.block(F.relu(self.inp(x)))))


def op_list():
    """The network as the list of operations in policy.json."""

    def linear(name):
        return {"op": "linear", "w": f"{name}.weight", "b": f"{name}.bias"}

    def layernorm(name):
        return {"op": "layernorm", "w_ln": f"{name}.weight", "b_ln": f"{name}.bias", "eps": EPS}

    ops = [
        {"op": "normalize", "mean": "obs_norm.mean", "scale": "obs_norm.scale", "clip": CLIP},
        linear("inp"),
        {"op": "relu", "save": "h0"},
    ]
    for i in range(BLOCKS):
        ops += [
            layernorm(f"block.{i}.ln"),
            linear(f"block.{i}.fc"),
            {"op": "relu"},
            {"op": "add", "with": f"h{i}", "save": f"h{i + 1}"},
        ]
    # Nothing adds the last block's output again.
    del ops[-1]["save"]
    return ops + [layernorm("ln"), linear("out")]


def export(head, action_mean, action_std, out_dir):
    out_dir.mkdir(parents=True, exist_ok=True)
    save_file({k: v.contiguous() for k, v in head.state_dict().items()}, out_dir / "policy.safetensors")
    policy = {
        "name": "ur3_reach",
        "kind": "chunk",
        "chunk": CHUNK,
        "execute": EXECUTE,
        "obs_dim": head.inp.in_features,
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
        "ops": op_list(),
    }
    (out_dir / "policy.json").write_text(json.dumps(policy, indent=1) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("demonstrations", type=Path)
    parser.add_argument("out_dir", type=Path)
    parser.add_argument("--epochs", type=int, default=40)
    parser.add_argument("--batch", type=int, default=1024)
    parser.add_argument("--lr", type=float, default=1e-3)
    args = parser.parse_args()

    torch.manual_seed(0)
    torch.set_num_threads(2)

    data = np.load(args.demonstrations)
    obs = torch.from_numpy(data["obs"])
    action = torch.from_numpy(data["action"])
    action_mean, action_std = action.mean((0, 1)), action.std((0, 1))
    target = ((action - action_mean) / action_std).flatten(1)

    # The last episodes are kept for validation.
    n_train = len(obs) * 19 // 20
    head = Head(obs[:n_train].mean(0), 1 / obs[:n_train].std(0))
    steps = args.epochs * (n_train // args.batch)
    optimizer = torch.optim.AdamW(head.parameters(), lr=args.lr, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, max_lr=args.lr, total_steps=steps)

    for epoch in range(args.epochs):
        total = 0.0
        batches = torch.randperm(n_train)[: n_train // args.batch * args.batch].view(-1, args.batch)
        for batch in batches:
            loss = F.l1_loss(head(obs[batch]), target[batch])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
            total += loss.item()
        with torch.no_grad():
            validation = F.l1_loss(head(obs[n_train:]), target[n_train:]).item()
        print(f"epoch {epoch + 1}: training L1 {total / len(batches):.4f}, validation L1 {validation:.4f}", flush=True)

    export(head, action_mean, action_std, args.out_dir)


if __name__ == "__main__":
    main()
