"""Sweeps on Ray: workers, a node and the head are killed, and the store is that of a serial run."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

ray = pytest.importorskip("ray", reason="ray is not installed")

SPEC = """
policies = ["policy"]
methods = ["rtn", "gptq", "distill"]
bpw = [2.5, 3, 4]
steps = 200

[evaluate]
per_job = 2

[drive]
command = PYTHON
files = ["simulator.py"]
episodes = 4
first_seed = 100
per_job = 2

[learn]
rounds = 1
episodes = 2
first_seed = 10
""".replace("PYTHON", json.dumps(sys.executable + " simulator.py"))

SIMULATOR = """
import os, random, struct, subprocess
policy = subprocess.Popen(["sh", "-c", os.environ["POLICY_CMD"]], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
first, count = int(os.environ["ACTQ_SEED"]), int(os.environ["ACTQ_EPISODES"])
for seed in range(first, first + count):
    draw = random.Random(seed)
    policy.stdin.write(b"R")
    for step in range(50):
        values = [draw.uniform(-1, 1) for value in range(INPUTS)]
        policy.stdin.write(b"S" + struct.pack("<%df" % len(values), *values))
        policy.stdin.flush()
        policy.stdout.read(4 * OUTPUTS)
policy.stdin.close()
policy.wait()
print('{"episodes": %d, "success": 0.5}' % count)
"""


SIZES = [12, 64, 64, 4]


def write_policy(folder):
    """Writes a policy of random weights, and its recordings."""
    folder.mkdir()
    draw = np.random.default_rng(1)
    ops, tensors, data = [], {}, b""
    for i, (cols, rows) in enumerate(zip(SIZES, SIZES[1:])):
        weight = (draw.normal(size=(rows, cols)) / np.sqrt(cols)).astype("<f4").tobytes()
        tensors[f"w{i}"] = {"dtype": "F32", "shape": [rows, cols], "data_offsets": [len(data), len(data) + len(weight)]}
        data += weight
        ops += [{"op": "linear", "w": f"w{i}"}, {"op": "tanh"}]
    header = json.dumps(tensors).encode()
    (folder / "policy.safetensors").write_bytes(len(header).to_bytes(8, "little") + header + data)
    policy = {"name": "tiny", "obs_dim": SIZES[0], "act_dim": SIZES[-1], "ops": ops[:-1]}
    (folder / "policy.json").write_text(json.dumps(policy))
    for name in ("calib", "heldout"):
        np.savez(folder / f"{name}.npz", obs=draw.normal(size=(8, 100, SIZES[0])).astype(np.float32))


@pytest.fixture
def sweep(command, tmp_path, monkeypatch):
    """A folder with a spec, and the store `serial` of a run without Ray."""
    monkeypatch.setenv("RAY_AUTH_MODE", "disabled")
    monkeypatch.chdir(tmp_path)
    write_policy(tmp_path / "policy")
    simulator = SIMULATOR.replace("INPUTS", str(SIZES[0])).replace("OUTPUTS", str(SIZES[-1]))
    Path("simulator.py").write_text(simulator)
    Path("spec.toml").write_text(SPEC)
    command("sweep", "spec.toml", "--store", "serial", "--threads", "1", "--quiet")
    return tmp_path


def start(store, *options):
    """Starts `python -m actq.ray`."""
    words = [sys.executable, "-m", "actq.ray", "spec.toml", "--store", store, "--actq", os.environ["ACTQ"]]
    return subprocess.Popen([*words, "--tries", "100", *options])


def content(store):
    """The visible files of a store; a hidden one is of a process that was killed while it wrote."""
    files = [path for path in Path(store).iterdir() if not path.name.startswith(".")]
    return {path.name: path.read_bytes() for path in files}


def results(store):
    return len(list(Path(store).glob("*.json"))) if Path(store).is_dir() else 0


def tasks(node):
    """Processes of a node that run a task now."""
    raylets = {info.process.pid for info in node.all_processes["raylet"]}
    for folder in Path("/proc").iterdir():
        try:
            words = (folder / "cmdline").read_bytes()
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
        except (OSError, ValueError, IndexError):
            continue
        # Other processes of a node have no job's title.
        if words.startswith(b"ray::") and b", seed " in words and parent in raylets:
            yield int(folder.name)


def kill_tasks(nodes, count, running):
    """Kills `count` random workers, each after two results more; returns how many."""
    killed, wanted, draw = 0, results("store") + 2, random.Random(1)
    while killed < count and running.poll() is None:
        found = [pid for node in nodes for pid in tasks(node)] if results("store") >= wanted else []
        if found:
            os.kill(draw.choice(found), signal.SIGKILL)
            killed, wanted = killed + 1, results("store") + 2
        time.sleep(0.05)
    return killed


def test_killed_workers_nodes_and_heads_lose_nothing(sweep):
    from ray.cluster_utils import Cluster

    plan = results("serial") - 1
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        node = cluster.add_node(num_cpus=1)
        running = start("store", "--address", cluster.address, "--log", "log.jsonl")
        killed = kill_tasks([cluster.head_node, node], 5, running)
        before = results("store")
        cluster.remove_node(node, allow_graceful=False)
        node = cluster.add_node(num_cpus=1)
        killed += kill_tasks([cluster.head_node, node], 5, running)
        assert running.poll() is None and before < results("store") < plan, "the sweep is too short for this test"
        cluster.remove_node(cluster.head_node, allow_graceful=False)
        done = results("store")
        time.sleep(5)
        running.kill()
        running.wait()
    finally:
        cluster.shutdown()
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        cluster.add_node(num_cpus=1)
        assert start("store", "--address", cluster.address, "--log", "log.jsonl").wait() == 0
    finally:
        cluster.shutdown()
    log = [json.loads(line) for line in Path("log.jsonl").read_text().splitlines()]
    lost = sum(entry["status"] != 0 for entry in log)
    print(f"{plan} jobs, {killed} workers killed, {lost} tasks lost, {done} results before the head was killed")
    assert killed == 10 and lost >= 5 and plan >= 40
    assert content("store") == content("serial")


def test_a_store_may_be_behind_a_url(sweep):
    pytest.importorskip("fsspec", reason="fsspec is not installed")
    Path("spec.toml").write_text(SPEC.replace("[2.5, 3, 4]", "[3]").replace('"rtn", ', ""))
    subprocess.run([os.environ["ACTQ"], "sweep", "spec.toml", "--store", "few", "--threads", "1", "--quiet"], check=True)
    assert start(f"file://{sweep}/url").wait() == 0
    assert content("url") == content("few")


def test_failed_jobs_are_reported(sweep, capfd):
    Path("spec.toml").write_text(SPEC.replace(json.dumps(sys.executable + " simulator.py"), '"exit 3"'))
    assert start("broken").wait() == 1
    assert "failed with status 1" in capfd.readouterr().err
    Path("spec.toml").write_text("bit = 3\n")
    assert start("broken").wait() == 1
    assert "unknown field `bit`" in capfd.readouterr().err
