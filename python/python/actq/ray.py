"""Run a sweep on Ray: python -m actq.ray SPEC.toml --store DIR [--address ADDRESS].

Every job of `actq plan` becomes a task with the job's cores and memory, which runs the command `actq job`. The command
has to be on all nodes, and so have the files of the spec, at the same paths. The store is a folder that all nodes share, or
a URL that fsspec knows. Jobs that have a result do not run again, so the same command resumes a sweep.
"""

from __future__ import annotations

import argparse
import heapq
import json
import os
import subprocess
import sys
import tempfile
import time
import uuid
from typing import Any

import ray

Job = dict[str, Any]
# Exit status of a job that may succeed later. Above 127, a signal has ended it.
AGAIN = 75
# Of an `actq job` that a signal or Ray itself has ended.
LOST = 255


class Remote:
    """A store behind a URL; a job reads and writes a local copy of what it needs."""

    def __init__(self, url: str) -> None:
        from fsspec.core import url_to_fs

        self.fs, self.root = url_to_fs(url)
        self.fs.makedirs(self.root, exist_ok=True)

    def names(self) -> set[str]:
        self.fs.invalidate_cache()
        try:
            return {path.rsplit("/", 1)[-1] for path in self.fs.ls(self.root, detail=False)}
        except FileNotFoundError:
            # Object stores have no empty folders.
            return set()

    def fetch(self, job: Job, folder: str) -> None:
        endings = [".json", ".actq"] if job["kind"] == "merge" else [".json", ".actq", ".npz"]
        wanted = ["store.json", *(address + ending for address in job["deps"] for ending in endings)]
        for name in self.names().intersection(wanted):
            self.fs.get_file(f"{self.root}/{name}", os.path.join(folder, name))

    def publish(self, job: Job, folder: str) -> None:
        # The result is last, as in a folder: who sees it finds the image.
        for name in ("store.json", *(job["address"] + ending for ending in (".actq", ".npz", ".json"))):
            if os.path.exists(os.path.join(folder, name)):
                part = f"{self.root}/.{name}.{uuid.uuid4().hex}"
                self.fs.put_file(os.path.join(folder, name), part)
                self.fs.mv(part, f"{self.root}/{name}")


def open_jobs(plan: list[Job], options: argparse.Namespace) -> set[str]:
    """Return the addresses of the jobs without a result; in a folder, of those with a damaged one, too."""
    if "://" not in options.store and os.path.isdir(options.store):
        command = [options.actq, "plan", options.spec, "--missing", options.store]
        lines = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
        return {json.loads(line)["address"] for line in lines}
    there = Remote(options.store).names() if "://" in options.store else set()
    return {job["address"] for job in plan if job["address"] + ".json" not in there}


def run_job(job: Job, store: str, actq: str) -> tuple[int, str, float]:
    """Run one job; return its exit status, its errors, and its seconds."""
    begun = time.monotonic()
    command = [actq, "job", "-", "--threads", str(job["cpus"]), "--store"]
    if "://" not in store:
        done = subprocess.run([*command, store], input=json.dumps(job), capture_output=True, text=True)
    else:
        remote = Remote(store)
        with tempfile.TemporaryDirectory(prefix="actq-") as folder:
            remote.fetch(job, folder)
            done = subprocess.run([*command, folder], input=json.dumps(job), capture_output=True, text=True)
            if done.returncode == 0:
                remote.publish(job, folder)
    return done.returncode if done.returncode >= 0 else LOST, done.stderr[-2000:], time.monotonic() - begun


class Sweep:
    """The jobs of a plan, and the tasks that run now."""

    def __init__(self, plan: list[Job], options: argparse.Namespace) -> None:
        self.options = options
        without_result = open_jobs(plan, options)
        missing = [job for job in plan if job["address"] in without_result]
        self.open = {job["address"]: job for job in missing}
        self.waiting = {job["address"]: sum(dep in self.open for dep in job["deps"]) for job in missing}
        self.dependents: dict[str, list[str]] = {address: [] for address in self.open}
        for job in missing:
            for dep in self.open.keys() & set(job["deps"]):
                self.dependents[dep].append(job["address"])
        # Ready jobs, those with the longest estimate first.
        self.ready = [(-job["seconds"], job["address"]) for job in missing if not self.waiting[job["address"]]]
        heapq.heapify(self.ready)
        self.tries = dict.fromkeys(self.open, 0)
        self.running: dict[Any, tuple[Job, float]] = {}
        self.failed: list[str] = []
        self.count = len(plan)
        self.task = ray.remote(max_retries=0)(run_job)

    def start(self, most: int) -> None:
        """Start ready jobs, until `most` are in Ray's queue."""
        while self.ready and len(self.running) < most:
            job = self.open[heapq.heappop(self.ready)[1]]
            task = self.task.options(num_cpus=job["cpus"], memory=job["memory_mib"] << 20, name=job["title"])
            self.running[task.remote(job, self.options.store, self.options.actq)] = (job, time.time())

    def end(self, task: Any) -> None:
        """Take the end of a task."""
        job, begun = self.running.pop(task)
        address = job["address"]
        try:
            status, errors, seconds = ray.get(task)
        except ray.exceptions.RayError as error:
            # A worker or its node has ended, or the node's memory.
            lost = isinstance(error, (ray.exceptions.RayTaskError, ray.exceptions.RuntimeEnvSetupError))
            status, errors, seconds = (AGAIN if lost else LOST), str(error).strip()[-2000:], 0.0
        self.tries[address] += 1
        self.log(job, status, seconds, begun)
        if status == 0:
            del self.open[address]
            for dependent in self.dependents[address]:
                self.waiting[dependent] -= 1
                if self.waiting[dependent] == 0:
                    heapq.heappush(self.ready, (-self.open[dependent]["seconds"], dependent))
        elif (status == AGAIN or status > 127) and self.tries[address] < self.options.tries:
            print(f"{job['title']}: status {status}, it is tried again: {errors.strip()}", file=sys.stderr)
            heapq.heappush(self.ready, (-job["seconds"], address))
        else:
            print(f"{job['title']}: failed with status {status}: {errors.strip()}", file=sys.stderr)
            self.failed.append(address)

    def log(self, job: Job, status: int, seconds: float, begun: float) -> None:
        if self.options.log:
            keys = {key: job[key] for key in ("address", "title", "kind")}
            times = {"estimated": job["seconds"], "seconds": seconds, "begun": begun, "ended": time.time()}
            with open(self.options.log, "a") as log:
                log.write(json.dumps({**keys, **times, "status": status}) + "\n")

    def run(self) -> bool:
        """Run all jobs that can run; return whether all have a result."""
        shown, most = 0.0, 0
        while self.running or self.ready:
            if time.monotonic() - shown >= 10:
                shown = time.monotonic()
                # Nodes come and go. The queue is short, so that long jobs that become ready are not last.
                cpus = ray.cluster_resources().get("CPU", 1)  # type: ignore[no-untyped-call]
                most = 2 * int(cpus) + 2
                done = self.count - len(self.open)
                print(f"progress: {done} of {self.count} jobs, {len(self.running)} running", file=sys.stderr)
            self.start(most)
            ended, _ = ray.wait(list(self.running), num_returns=1, timeout=10)
            for task in ended:
                self.end(task)
        return not self.open


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m actq.ray", description=(__doc__ or "").split("\n\n")[1])
    parser.add_argument("spec", help="the spec (SPEC.toml), or a plan")
    parser.add_argument("--store", required=True, help="the folder of the results, or a URL that fsspec knows")
    parser.add_argument("--address", help="address of an existing cluster [default: RAY_ADDRESS, or a new one]")
    parser.add_argument("--actq", default="actq", help="the command actq on the nodes [default: actq]")
    parser.add_argument("--tries", type=int, default=5, help="most tries of a job that may succeed later [default: 5]")
    parser.add_argument("--log", help="append a line of JSON for each task to this file")
    options = parser.parse_args()
    planned = subprocess.run([options.actq, "plan", options.spec], stdout=subprocess.PIPE, text=True)
    if planned.returncode != 0:
        return planned.returncode
    if "://" not in options.store:
        options.store = os.path.abspath(options.store)
    ray.init(address=options.address, log_to_driver=False)
    sweep = Sweep([json.loads(line) for line in planned.stdout.splitlines()], options)
    if sweep.run():
        print(f"all {sweep.count} jobs have their results in {options.store}", file=sys.stderr)
        return 0
    skipped = len(sweep.open) - len(sweep.failed)
    print(f"{len(sweep.failed)} jobs failed, {skipped} that need them did not run; run again to retry", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
