"""Trains a causal transformer for the balancer on the expert's demonstrations, and exports a step of it as ONNX.

Usage: python transformer.py DEMONSTRATIONS.npz transformer/policy.onnx

A step has one token, and attends to the keys and values of the last ones, which are inputs and outputs of the step; so does
training, by a mask over whole episodes. `valid` is 1 for a token that there was.
"""

import sys

import numpy as np
import torch
from torch import nn
from train import TORQUE, observations

CONTEXT, LAYERS, HEADS, WIDTH, INNER = 16, 2, 4, 48, 96
STEPS, BATCH, TOKENS, RATE = 1200, 16, 96, 2e-3


class Layer(nn.Module):
    def __init__(self):
        super().__init__()
        self.norms = nn.ModuleList([nn.LayerNorm(WIDTH), nn.LayerNorm(WIDTH)])
        self.project, self.out = nn.Linear(WIDTH, 3 * WIDTH), nn.Linear(WIDTH, WIDTH)
        self.inner = nn.Sequential(nn.Linear(WIDTH, INNER), nn.GELU(approximate="tanh"), nn.Linear(INNER, WIDTH))

    def forward(self, x, mask, past=None):
        """Returns the outputs of tokens [batch, token, element], and keys and values for the next ones."""
        parts = self.project(self.norms[0](x)).unflatten(-1, (3, HEADS, WIDTH // HEADS)).permute(2, 0, 3, 1, 4)
        queries, keys, values = parts.unbind()
        if past is not None:
            keys, values = torch.cat([past[0], keys], 2), torch.cat([past[1], values], 2)
        scores = queries @ keys.transpose(2, 3) / (WIDTH // HEADS) ** 0.5 + mask
        heads = scores.softmax(-1) @ values
        x = x + self.out(heads.transpose(1, 2).flatten(2))
        return x + self.inner(self.norms[1](x)), (keys[:, :, 1:], values[:, :, 1:])


class Policy(nn.Module):
    def __init__(self, inputs, outputs):
        super().__init__()
        self.first, self.last = nn.Linear(inputs, WIDTH), nn.Linear(WIDTH, outputs)
        self.layers = nn.ModuleList([Layer() for _ in range(LAYERS)])
        self.norm = nn.LayerNorm(WIDTH)

    def forward(self, frames):
        ages = torch.arange(frames.shape[1])[:, None] - torch.arange(frames.shape[1])
        mask = torch.where((ages >= 0) & (ages < CONTEXT), 0.0, -1e9)
        x = self.first(frames)
        for layer in self.layers:
            x, _ = layer(x, mask)
        return self.last(self.norm(x))


class Step(nn.Module):
    def __init__(self, policy):
        super().__init__()
        self.policy = policy

    def forward(self, frame, valid, *past):
        valid = torch.cat([valid, torch.ones(1, 1)], 1)
        mask = (valid - 1) * 1e9
        x, present = self.policy.first(frame[:, None]), []
        for i, layer in enumerate(self.policy.layers):
            x, kept = layer(x, mask, past[2 * i : 2 * i + 2])
            present += kept
        return self.policy.last(self.policy.norm(x))[:, 0], valid[:, 1:], *present


def episodes(data):
    """Returns frames and actions [episode, step, element]; all episodes have equal lengths."""
    frames = observations(data, history=1)
    actions = torch.from_numpy(data["torque"][:, ::-1] / TORQUE)
    count = int(data["first"].sum())
    return frames.unflatten(0, (count, -1)), actions.unflatten(0, (count, -1))


def export(policy, path):
    """Exports a step, after comparing steps with the whole."""
    past = [torch.zeros(1, HEADS, CONTEXT - 1, WIDTH // HEADS) for _ in range(2 * LAYERS)]
    step, state = Step(policy).eval(), [torch.zeros(1, CONTEXT - 1), *past]
    frames = torch.randn(1, 3 * CONTEXT, policy.first.in_features)
    with torch.no_grad():
        for frame, expected in zip(frames[0], policy(frames)[0]):
            action, *state = step(frame[None], *state)
            assert torch.allclose(action[0], expected, atol=1e-4)
    kept = ["valid"] + [f"{name}{i}" for i in range(LAYERS) for name in ("keys", "values")]
    torch.onnx.export(
        step,
        (frames[:, 0], torch.zeros(1, CONTEXT - 1), *past),
        path,
        input_names=["observation", *kept],
        output_names=["action", *(f"next_{name}" for name in kept)],
        dynamo=False,
        opset_version=17,
    )


def main():
    demonstrations, out = sys.argv[1:]
    torch.manual_seed(0)
    torch.set_num_threads(1)
    frames, actions = episodes(np.load(demonstrations))
    count, steps = frames.shape[:2]
    # The last episodes are held out for validation.
    n_train = count * 19 // 20
    policy = Policy(frames.shape[2], actions.shape[2])
    print(f"{sum(p.numel() for p in policy.parameters())} parameters")
    optimizer = torch.optim.AdamW(policy.parameters(), lr=RATE, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, max_lr=RATE, total_steps=STEPS)
    # Before it, a token of a part sees less than it does in the episode.
    settled = LAYERS * (CONTEXT - 1)
    for step in range(STEPS):
        episode, begin = torch.randint(n_train, (BATCH,)), torch.randint(-settled, steps - TOKENS, (BATCH,)).clamp(min=0)
        at = (episode[:, None], begin[:, None] + torch.arange(TOKENS))
        is_settled = (begin == 0)[:, None] | (torch.arange(TOKENS) >= settled)
        error = ((policy(frames[at]) - actions[at]) ** 2).mean(-1)
        loss = error[is_settled].mean()
        optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
        optimizer.step()
        schedule.step()
        if step % 100 == 99:
            with torch.no_grad():
                held, of = frames[n_train:, :200], actions[n_train:, :200]
                nmse = nn.functional.mse_loss(policy(held), of) / of.var()
            print(f"step {step + 1}: validation NMSE {nmse.item():.5f}", flush=True)
    export(policy, out)


if __name__ == "__main__":
    main()
