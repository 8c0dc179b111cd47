"""The link to the motor controller in QEMU."""

import os
import socket
import subprocess
import time

import numpy as np
import pytest

import actq
from conftest import UR3, listings


@pytest.fixture
def port(tmp_path):
    """Runs the controller with its serial port at a socket."""
    command = os.environ.get("ACTQ_CONTROLLER")
    if command is None:
        pytest.skip("ACTQ_CONTROLLER names no controller; `cargo xtask python` builds one if QEMU is installed")
    path = str(tmp_path / "serial")
    words = [word.replace("{socket}", path) for word in command.split("\n")]
    process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    # The socket appears in its folder a moment before QEMU listens.
    while not listens(path):
        assert process.poll() is None, "QEMU has ended"
        time.sleep(0.01)
    yield f"unix:{path}"
    process.terminate()
    process.wait()


def listens(path):
    with socket.socket(socket.AF_UNIX) as probe:
        return probe.connect_ex(path) == 0


def step(link, row):
    """Steps. The controller refuses an observation that a busy machine delivers too late, and sends no action."""
    while True:
        refused = link.status()["refused"]
        try:
            return link.step(row)
        except actq.Error:
            if link.status()["refused"] == refused:
                raise


def arm(link, row):
    """Arms. A busy machine may deliver the request when the last observation is too old, and it is refused."""
    for _ in range(100):
        step(link, row)
        try:
            return link.arm()
        except actq.Error as error:
            refused = error
    raise refused


def test_a_controller_runs_an_image_with_its_bits(port):
    image = actq.quantize(actq.import_policy(UR3), bits=2, method="rtn", progress=False)
    rows = np.random.default_rng(1).normal(size=(5, image.obs_len)).astype(np.float32)
    with actq.Link(port, timeout=60) as link:
        before = link.status()
        assert (before["obs_len"], before["act_len"], before["state"]) == (18, 6, "disarmed")
        shares = []
        link.push(image, version=7, progress=lambda work, share: shares.append(share))
        assert shares and max(shares) <= 1.0
        assert link.status()["image"] == image.crc32 != before["image"]
        head = actq.Head(image)
        expected = [head(row).tobytes() for row in rows]
        for _ in range(100):
            # A disarm gives the head a new state. So do 1000 ticks without a frame, on a busy machine: then again.
            link.disarm()
            begun = link.status()["ticks"]
            actions = [step(link, row).tobytes() for row in rows]
            if actions == expected or link.status()["ticks"] - begun < 1000:
                break
        assert actions == expected
        # QEMU's clock decides how long a head takes, and this machine if the next observation comes in time.
        assert link.timing()["worst_head_us"] >= 0
        arm(link, rows[0])
        assert link.status()["state"] != "disarmed"
        link.disarm()
        with pytest.raises(actq.Error, match="version"):
            link.push(image, version=6)
    with pytest.raises(actq.Error, match="the link is closed; open another"):
        link.status()


def test_the_listing_of_the_document_runs(port):
    image = actq.quantize(actq.import_policy(UR3), bits=2, method="rtn", progress=False)
    observation = np.ones(image.obs_len, dtype=np.float32)
    names = {"actq": actq, "image": image, "observation": observation}
    listing = listings("PYTHON")[-1].replace('"/dev/ttyACM0"', f'"{port}", timeout=60')
    for _ in range(10):
        try:
            exec(compile(listing, "PYTHON", "exec"), names)
            break
        except actq.Error as error:
            # On a machine so busy that the observation came too late, and was refused.
            if "no action" not in str(error):
                raise
    assert names["action"].tobytes() == actq.Head(image)(observation).tobytes()


def test_a_port_that_cannot_be_opened_is_named(tmp_path):
    with pytest.raises(actq.Error, match=r"unix:.*none: the port cannot be opened: No such file"):
        actq.Link(f"unix:{tmp_path}/none")
    with pytest.raises(actq.Error, match="tcp:here: the form is tcp:HOST:PORT"):
        actq.Link("tcp:here")
    with pytest.raises(actq.Error, match="timeout is 0; use a number above 0"):
        actq.Link("unix:x", timeout=0)
