"""Errors have the text of the command; Ctrl-C ends the work at once."""

import copy
import os
import pickle
import re
import signal
import subprocess
import sys
import time
import threading
from types import SimpleNamespace

import numpy as np
import pytest

import actq
from actq._report import Page
from conftest import UR3, write_mlp


def test_errors_are_those_of_the_command(command, mlp, observations, tmp_path):
    np.save(tmp_path / "narrow.npy", observations[:, :5])
    cases = [
        (lambda: actq.import_policy(tmp_path / "no.onnx"), ["quantize", tmp_path / "no.onnx"]),
        (lambda: actq.import_policy(tmp_path / "none"), ["quantize", tmp_path / "none"]),
        (
            lambda: actq.quantize(actq.import_policy(mlp), tmp_path / "narrow.npy", progress=False),
            ["quantize", mlp, "--calib", tmp_path / "narrow.npy"],
        ),
        (
            lambda: actq.quantize(actq.import_policy(mlp), observations, bpw=0.01, progress=False),
            ["quantize", mlp, "--calib", tmp_path / "narrow.npy", "--bpw", "0.01"],
        ),
        (
            lambda: actq.quantize(actq.import_policy(mlp), observations, relative=True, steps=0, progress=False),
            ["quantize", mlp, "--calib", tmp_path / "narrow.npy", "--relative", "--steps", "0"],
        ),
    ]
    for python, arguments in cases:
        text = command(*arguments, "--out", tmp_path / "out.actq", "--quiet", fails=True).removeprefix("actq: ")
        with pytest.raises(actq.Error) as raised:
            python()
        assert str(raised.value) == text.splitlines()[-1].removeprefix("actq: ")
    assert issubclass(actq.Error, ValueError)


def test_arguments_are_named(mlp, observations):
    policy = actq.import_policy(mlp)
    wrong = [
        ({"bits": 5}, "bits is 5; use 2, 3, 4 or 8 bits"),
        ({"bpw": 0}, "bpw is 0; use a number above 0"),
        ({"bpw": 2, "flash": 90_000}, "more than one budget is given; pass one of bits, bpw, flash, ms and max_nmse, or flash and ms"),
        ({"method": "best"}, 'method is "best"; use "rtn", "gptq" or "distill"'),
        ({"activations": 4}, "activations is 4; use 8 or 16 bits"),
        ({"group": 5}, "group is 5; it must be 0 or one of [32, 64, 128]"),
        ({"steps": -1}, "steps is -1; use a whole number from 0 on"),
        ({"seed": np.int64(-3)}, "seed is -3; use a whole number from 0 on"),
        ({"seed": None}, "seed is None; use a whole number"),
        ({"bits": 3.0}, "bits is 3.0; use a whole number"),
        ({"flash": 10**30}, f"flash is {10**30}; use a smaller number"),
        ({"activations": 2**40}, f"activations is {2**40}; use a smaller number"),
        ({"bpw": "2"}, "bpw is '2'; use a number"),
        ({"method": 3}, 'method is 3; use "rtn", "gptq" or "distill"'),
        ({"relative": 1}, "relative is 1; use True or False"),
        ({"widths": {"w": 3.5}}, "widths['w'] is 3.5; use a whole number"),
        ({"effort": "much"}, 'effort is "much"; use "quick", "default" or "thorough"'),
        ({"effort": 1}, 'effort is 1; use "quick", "default" or "thorough"'),
        ({"widths": 3}, "widths is of type int; pass a mapping of matrices to bits"),
        ({"minutes": 20_000}, "minutes is 20000; use at most 10080, a week"),
    ]
    for options, text in wrong:
        with pytest.raises(actq.Error) as raised:
            actq.quantize(policy, observations, progress=False, **options)
        assert str(raised.value) == text
    recordings = [
        (3, "recordings is a int; pass a path, an array"),
        ([], "recordings is an empty list; pass a recording"),
        ((observations,), "recordings is a tuple of 1 items; pass (observations, starts)"),
        ((observations, np.zeros(3, dtype=bool)), "recordings[1] has 3 values for 500 frames; pass one for each frame"),
        ((observations, np.zeros(500)), "recordings[1] is no array of bool [frame]"),
        (observations.astype(np.int32), 'recordings: array "obs" is of type int32; use float32 or float64'),
        ([observations, observations[:, :3]], 'recordings[1]: array "obs" has 3 values per step'),
        ({"observation": observations}, 'recordings: array "obs" is missing; the file holds observation'),
    ]
    for recording, text in recordings:
        with pytest.raises(actq.Error) as raised:
            actq.quantize(policy, recording, progress=False)
        assert str(raised.value).startswith(text)
    with pytest.raises(actq.Error, match="no calibration recording; pass one by --calib FILE"):
        actq.quantize(policy, progress=False)
    with pytest.raises(actq.Error, match="image: not an actq image"):
        actq.Image(b"no image")


def test_wrong_types_are_errors_of_actq(mlp, observations):
    policy = actq.import_policy(mlp)
    image = actq.quantize(policy, observations, method="rtn", progress=False)
    head, ragged = actq.Head(image), [[1.0], [1.0, 2.0]]
    calls = {
        "quantize": lambda: actq.quantize(object(), observations, progress=False),
        "evaluate": lambda: actq.evaluate(object(), observations),
        "evaluate's policy": lambda: actq.evaluate(image, observations, object()),
        "head of no image": lambda: actq.Head(policy),
        "number of heads": lambda: actq.Head(image, -1),
        "seed": lambda: actq.Head(image, 1, seed=2**32),
        "text as observations": lambda: head("x"),
        "ragged observations": lambda: head(ragged),
        "ragged mask": lambda: head(observations, ragged),
        "ragged recording": lambda: actq.quantize(policy, {"obs": ragged}, progress=False),
        "keys": lambda: actq.quantize(policy, {3: observations}, progress=False),
        "image": lambda: actq.Image("x"),
        "load": lambda: actq.Image.load(3),
        "save": lambda: image.save(None),
        "inspect": lambda: image.inspect(clock="fast"),
        "report's policy": lambda: image.report(object()),
        "report's recordings": lambda: image.report(policy, recordings=3),
        "report's file": lambda: Page("x").save(3),
        "report's folder": lambda: Page("x").save("missing/x.html"),
        "board": lambda: image.cost(3),
        "export": lambda: image.export_c("c", name=3),
        "port": lambda: actq.Link(3),
        "output": lambda: actq.import_policy(mlp, output=3),
        "states": lambda: actq.import_policy(mlp, states={"h": 3}),
        "states of a head": lambda: head.restore(3),
    }
    for name, call in calls.items():
        with pytest.raises(Exception) as raised:
            call()
        assert isinstance(raised.value, actq.Error), f"{name}: {raised.value!r}"
    assert copy.deepcopy(policy) is policy


def test_sources_of_policies_are_checked(mlp, tmp_path):
    for source, text in [
        (None, "the policy is of type NoneType; pass a path, a torch.nn.Module or a trained model"),
        (b"x", "the policy is of type bytes"),
        ("", "the path of the policy is empty"),
        (tmp_path / "none.pt", "none.pt: there is no such file"),
    ]:
        with pytest.raises(actq.Error, match=text):
            actq.import_policy(source)
    for option in ("name", "input_names", "output_names"):
        with pytest.raises(actq.Error, match=f"only a module or a TorchScript file takes {option}"):
            actq.import_policy(mlp, **{option: "x"})
    with pytest.raises(actq.Error, match="states is of type list; pass a mapping"):
        actq.import_policy(mlp, states=["a"])
    for answers, text in [
        (tmp_path / "none.toml", "none.toml: .*No such file"),
        ({"rate_hz": None}, "answers: rate_hz is of type NoneType"),
        ({"rate_hz": float("nan")}, "answers: rate_hz: .*not JSON compliant"),
    ]:
        with pytest.raises(actq.Error, match=text):
            actq.import_policy(mlp, answers=answers)


def test_torch_is_named_if_it_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(actq.Error, match="FakeQuant needs torch .*; install it by `pip install torch`"):
        actq.FakeQuant
    with pytest.raises(actq.Error, match="modules and TorchScript files need torch"):
        actq.import_policy(SimpleNamespace(forward=lambda obs: obs))


def test_only_files_of_their_kind_are_replaced(mlp, observations, tmp_path):
    policy = actq.import_policy(mlp)
    image = actq.quantize(policy, observations, method="rtn", progress=False)
    recording = tmp_path / "obs.npy"
    np.save(recording, observations)
    before = recording.read_bytes()
    with pytest.raises(actq.Error, match="obs.npy: exists and is not an actq image"):
        image.save(recording)
    with pytest.raises(actq.Error, match="obs.npy: exists and is no .onnx file"):
        image.to_onnx(recording)
    assert recording.read_bytes() == before
    for _ in range(2):
        image.save(tmp_path / "i.actq")
        image.to_onnx(tmp_path / "i.onnx")
    page, link = tmp_path / "page.html", tmp_path / "link.html"
    link.symlink_to(page)
    for text in ("first", "second \u00b1"):
        Page(text).save(link)
        assert link.is_symlink() and page.read_text(encoding="utf-8") == text
    with pytest.raises(actq.Error, match="steps is 0; use a whole number from 1 on"):
        image.export_c(tmp_path / "c", golden=recording, steps=0)
    with pytest.raises(actq.Error, match='the image was made from another policy than "ur3_reach"; pass that one, or none'):
        actq.evaluate(image, observations, actq.import_policy(UR3))


def test_ctrl_c_ends_quantize(tmp_path):
    """In a process of its own, as at a prompt: a process that a script starts in the background ignores the signal."""
    script = f"""
import actq, signal
signal.signal(signal.SIGINT, signal.default_int_handler)
policy = actq.import_policy({str(UR3)!r})
def told(work, share):
    print("begun", flush=True)
try:
    actq.quantize(policy, bpw=2, progress=told).save({str(tmp_path / "i.actq")!r})
except KeyboardInterrupt:
    print("interrupted", flush=True)
    # The process can go on.
    head = actq.Head(actq.quantize(policy, bits=3, method="rtn", progress=False))
    print("goes on", head([0.0] * head.image.obs_len).shape, flush=True)
"""
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "begun\n"
    process.send_signal(signal.SIGINT)
    # Learning would take minutes, and then save an image.
    lines = process.communicate()[0].splitlines()
    assert "interrupted" in lines and lines[-1].startswith("goes on") and process.returncode == 0
    assert os.listdir(tmp_path) == []


LONG = """
import actq, numpy, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
folder = sys.argv[1]
policy, image = actq.import_policy(folder + "/wide.onnx"), actq.Image.load(folder + "/i.actq")
obs = numpy.ones((1, image.obs_len), numpy.float32)
def head(n):
    return actq.Head(image, n)
{before}
print("begun", flush=True)
try:
    {call}
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
DRIVEN = """
import gymnasium
class Env(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(-10, 10, (image.obs_len,), numpy.float32)
    action_space = gymnasium.spaces.Box(-1, 1, (image.act_len,), numpy.float32)
    def reset(self, *, seed=None, options=None):
        return obs[0], {}
    def step(self, action):
        return obs[0], 0.0, False, False, {}
env = gymnasium.vector.SyncVectorEnv([Env] * 3)
"""


@pytest.mark.parametrize(
    "call",
    [
        "policy(obs.repeat(100_000, axis=0))",
        "image.report(recordings=[folder + '/obs.npy'])",
        "image.export_c(folder + '/c', golden=folder + '/obs.npy', steps=10**9)",
        "[head(100_000) for _ in range(10**6)]",
        "actq.Head(image)(obs.repeat(300_000, axis=0))",
    ],
)
def test_ctrl_c_ends_a_call_within_a_second(tmp_path, call):
    """Each of them would take longer."""
    wide_image(tmp_path)
    np.save(tmp_path / "obs.npy", np.random.default_rng(1).normal(size=(200_000, 64)).astype(np.float32))
    assert seconds_of_ctrl_c(LONG.format(before="", call=call), tmp_path) < 1


def test_ctrl_c_ends_a_rollout_within_a_second(tmp_path):
    pytest.importorskip("gymnasium", reason="gymnasium is not installed")
    wide_image(tmp_path)
    assert seconds_of_ctrl_c(LONG.format(before=DRIVEN, call="actq.rollout(head(3), env, frames=10**9)"), tmp_path) < 1


def test_an_interrupted_export_writes_nothing(tmp_path):
    image, recording = wide_image(tmp_path), tmp_path / "obs.npy"
    np.save(recording, np.random.default_rng(1).normal(size=(10_000, 64)).astype(np.float32))
    began = time.monotonic()
    assert len(image.export_c(tmp_path / "whole", golden=recording, steps=10**9)) == 4
    whole = time.monotonic() - began
    # A process in the background ignores the signal.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(whole / 10, signal.raise_signal, [signal.SIGINT])
    try:
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            image.export_c(tmp_path / "none", golden=recording, steps=10**9)
    finally:
        signal.signal(signal.SIGINT, before)
    # So long that the abandoned work has ended.
    time.sleep(2 * whole)
    assert sorted(os.listdir(tmp_path)) == ["i.actq", "obs.npy", "whole", "wide.onnx"]


def wide_image(folder):
    """Saves an image as i.actq, and returns it."""
    random = np.random.default_rng(1)
    layers = [(random.normal(size=size) / 16, np.zeros(size[1])) for size in [(64, 256), (256, 256), (256, 8)]]
    policy = actq.import_policy(write_mlp(folder / "wide.onnx", layers))
    image = actq.quantize(policy, bits=4, method="rtn", progress=False)
    image.save(folder / "i.actq")
    return image


def seconds_of_ctrl_c(script, folder):
    """Interrupts a script a tenth of a second after its call began, before a fast machine ends it; returns the seconds until it
    has ended the call."""
    process = subprocess.Popen([sys.executable, "-c", script, folder], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "begun\n"
        time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        sent = time.monotonic()
        assert process.stdout.readline() == "interrupted\n"
        return time.monotonic() - sent
    finally:
        process.kill()
        process.wait()


def test_arguments_are_whole_names(tmp_path):
    onnx = pytest.importorskip("onnx", reason="onnx is not installed")
    name = "sequential/normalization/mean:0"
    ports = [onnx.helper.make_tensor_value_info(port, 1, [1, 6]) for port in ("obs", name, "action")]
    node = onnx.helper.make_node("Sub", ["obs", name], ["action"])
    graph = onnx.helper.make_graph([node], "g", ports[:2], ports[2:])
    onnx.save(onnx.helper.make_model(graph, opset_imports=[onnx.helper.make_opsetid("", 17)], ir_version=8), tmp_path / "m.onnx")
    with pytest.raises(actq.Error, match=r'pass observe=\["sequential/normalization/mean:0"\]$'):
        actq.import_policy(tmp_path / "m.onnx")
    with pytest.raises(actq.Error, match=r'observe=\["force:1"\]: the file has no input of this name'):
        actq.import_policy(tmp_path / "m.onnx", observe=["force:1"])


def test_a_policy_folder_takes_limits():
    free, limited = actq.import_policy(UR3), actq.import_policy(UR3, low=-0.01, high=0.02, max_step=0.001)
    assert limited.digest != free.digest and limited.name == free.name
    rows = np.random.default_rng(1).normal(size=(20, free.obs_len)).astype(np.float32)
    np.testing.assert_array_equal(limited(rows), np.clip(free(rows), np.float32(-0.01), np.float32(0.02)))
    head = actq.Head(actq.quantize(limited, bits=4, method="rtn", progress=False))
    steps = np.diff([head(row) for row in rows], axis=0)
    assert np.abs(steps).max() <= 0.001 + 1e-6 and pickle.loads(pickle.dumps(limited)).digest == limited.digest


def test_an_exception_of_a_callback_ends_the_work():
    class Enough(Exception):
        pass

    def told(work, share):
        raise Enough

    threads = threading.active_count()
    with pytest.raises(Enough):
        actq.quantize(actq.import_policy(UR3), bpw=2, progress=told)
    assert threading.active_count() == threads


def test_progress_is_reported(mlp, observations):
    class Seen(Exception):
        pass

    def told(work, share):
        assert 0 <= share <= 1
        if work.startswith("learning, error "):
            raise Seen

    # So many steps that learning does not end before its report.
    with pytest.raises(Seen):
        actq.quantize(actq.import_policy(mlp), observations, bpw=3, steps=10**8, progress=told)


def test_a_bar_shows_progress(mlp, observations, capsys):
    pytest.importorskip("tqdm", reason="tqdm is not installed")
    actq.quantize(actq.import_policy(mlp), observations, bpw=3, steps=2000, progress=True)
    assert "left" in capsys.readouterr().err


def test_progress_is_shown_in_a_notebook_and_not_in_a_log(monkeypatch, capsys):
    from actq import _progress

    class ZMQInteractiveShell:
        pass

    with _progress.reporter(None) as report:
        assert report is None, "standard error is no terminal here"
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=ZMQInteractiveShell))
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    monkeypatch.setattr(_progress, "INTERVAL", 0.0)
    with _progress.reporter(None) as report:
        report("learning", 0.25)
    assert re.fullmatch(r"progress: \d+ s, 25%: learning\n", capsys.readouterr().err)
