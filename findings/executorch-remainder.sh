#!/bin/sh
# executorch 1.5.1, torch 2.15.0: the remainder of whole numbers has the sign of the dividend in a program of ExecuTorch, and that of the divisor in torch: -1 % 8 is 7, and -1 in the program.
# There is no error. A policy that steps back through a ring buffer ((step - 1) % 8), or wraps an index, reads another place from step 0 on. Floating-point remainders are torch's, and so is //.
# Seen on 2026-11-29:  -7 -1 7 % 3: torch 2 2 1, program -1 -1 1 (int32 and int64, also with XNNPACK)   float: 2 2 1   // 3: -3 -1 2 in both
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q executorch==1.5.1 torch==2.15.0 torchao==0.18.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import torch
from executorch.backends.xnnpack.partition.xnnpack_partitioner import XnnpackPartitioner
from executorch.exir import to_edge_transform_and_lower
from executorch.runtime import Runtime


class Remainder(torch.nn.Module):
    def forward(self, x):
        return x % 3


class Quotient(torch.nn.Module):
    def forward(self, x):
        return x // 3


class Tensors(torch.nn.Module):
    def forward(self, x):
        return x % torch.full_like(x, 3)


def program(module, x, partitioner):
    edge = to_edge_transform_and_lower(torch.export.export(module, (x,)), partitioner=partitioner)
    return Runtime.get().load_program(edge.to_executorch().buffer).load_method("forward").execute([x])[0]


for module in (Remainder(), Quotient(), Tensors()):
    for kind in (torch.int32, torch.int64, torch.float32):
        x = torch.tensor([-7, -1, 7], dtype=kind)
        expected = module(x).tolist()
        for partitioner in (None, [XnnpackPartitioner()]):
            found = program(module, x, partitioner).tolist()
            print("SEEN", type(module).__name__, kind, "XNNPACK" if partitioner else "portable", "torch", expected, "program", found)
            whole = kind != torch.float32 and not isinstance(module, Quotient)
            assert found == ([-1, -1, 1] if whole else expected)
PY
grep SEEN out.txt
