"""Images are the command's, byte for byte."""

import json
import pickle

import numpy as np
import pytest

import actq
from conftest import FLOW, UR3


@pytest.fixture(scope="session")
def image(mlp, observations):
    return actq.quantize(actq.import_policy(mlp), observations, bpw=3, steps=100, progress=False)


OPTIONS = [
    ({"bpw": 3.0}, ["--bpw", "3"]),
    ({"bits": 4}, ["--bits", "4"]),
    ({"flash": 3000}, ["--flash", "3000"]),
    ({"ms": 0.2, "clock": 100e6}, ["--ms", "0.2", "--clock", "100M"]),
    ({"flash": 3000, "ms": 0.1}, ["--flash", "3000", "--ms", "0.1"]),
    ({"bpw": 2, "effort": "quick"}, ["--bpw", "2", "--effort", "quick"]),
    ({"method": "gptq", "bits": 3, "group": 32}, ["--method", "gptq", "--bits", "3", "--group", "32"]),
    ({"activations": 16, "seed": 7, "relative": True}, ["--activations", "16", "--seed", "7", "--relative"]),
]


@pytest.mark.parametrize(("options", "arguments"), OPTIONS)
def test_same_options_give_the_bytes_of_the_command(command, mlp, observations, tmp_path, options, arguments):
    is_set = options.get("method") == "gptq" or "effort" in options
    steps, words = ({}, []) if is_set else ({"steps": 30}, ["--steps", "30"])
    np.save(tmp_path / "obs.npy", observations)
    command("quantize", mlp, "--calib", tmp_path / "obs.npy", "--out", tmp_path / "c.actq", *words, *arguments)
    image = actq.quantize(actq.import_policy(mlp), observations, progress=False, **{**steps, **options})
    assert image.bytes == (tmp_path / "c.actq").read_bytes()


def test_every_form_of_a_recording_gives_one_image(mlp, observations, tmp_path):
    np.save(tmp_path / "a.npy", observations)
    np.savez(tmp_path / "b.npz", obs=observations)
    policy, starts = actq.import_policy(mlp), np.zeros(len(observations), dtype=bool)
    forms = [
        observations,
        observations.astype(np.float64),
        observations.astype(">f4"),
        np.asfortranarray(observations),
        observations[None],
        {"obs": observations},
        (observations, starts),
        tmp_path / "a.npy",
        str(tmp_path / "b.npz"),
        np.load(tmp_path / "b.npz"),
    ]
    images = [actq.quantize(policy, form, bpw=3, steps=5, progress=False) for form in forms]
    assert all(image == images[0] for image in images)


def test_tensors_of_torch_are_recordings(mlp, observations):
    torch = pytest.importorskip("torch", reason="torch is not installed (requirements-optional.txt)")
    policy, tensor = actq.import_policy(mlp), torch.from_numpy(observations)
    make = lambda form: actq.quantize(policy, form, bpw=3, steps=5, progress=False)  # noqa: E731
    expected, starts = make(observations), torch.zeros(len(observations), dtype=torch.bool)
    with_gradient = tensor.clone().requires_grad_()
    for form in [tensor, with_gradient, tensor.double(), tensor[None], {"obs": with_gradient}, (with_gradient, starts)]:
        assert make(form) == expected
    assert make([tensor[:100], tensor[100:]]) == make([observations[:100], observations[100:]])
    for short in [tensor.half(), tensor.bfloat16()]:
        assert make(short) == make(short.float().numpy())
    head, row = actq.Head(expected), with_gradient[:1]
    assert np.array_equal(head(row, torch.tensor([True])), actq.Head(expected)(observations[:1]))
    assert np.array_equal(policy(with_gradient), policy(observations))
    head.restore(torch.from_numpy(head.state()))
    assert actq.evaluate(expected, with_gradient, policy) == actq.evaluate(expected, observations, policy)


def test_episodes_are_those_of_a_padded_file(command, mlp, observations, tmp_path):
    lengths = [100, 250, 150]
    padded = np.zeros((3, 250, 12), dtype=np.float32)
    starts, at = np.zeros(500, dtype=bool), 0
    for i, length in enumerate(lengths):
        padded[i, :length], starts[at] = observations[at : at + length], True
        at += length
    recording = {"obs": padded, "length": np.array(lengths)}
    np.savez(tmp_path / "a.npz", **recording)
    policy = actq.import_policy(mlp)
    image = actq.quantize(policy, recording, bpw=3, steps=5, progress=False)
    command("quantize", mlp, "--calib", tmp_path / "a.npz", "--out", tmp_path / "c", "--bpw", "3", "--steps", "5")
    assert image.bytes == (tmp_path / "c").read_bytes()
    assert actq.evaluate(image, (observations, starts), policy) == actq.evaluate(image, recording, policy)


@pytest.mark.parametrize(("folder", "method", "steps"), [(UR3, "distill", 2), (FLOW, "rtn", None)])
def test_a_policy_folder_brings_its_recordings(command, folder, method, steps, tmp_path):
    options = ["--bits", "3", "--method", method] + ([] if steps is None else ["--steps", steps])
    command("quantize", folder, "--out", tmp_path / "c.actq", *options)
    image = actq.quantize(actq.import_policy(folder), bits=3, steps=steps, method=method, progress=False)
    assert image.bytes == (tmp_path / "c.actq").read_bytes()


def test_steps_require_a_method_that_learns():
    with pytest.raises(actq.Error, match="method rtn does not learn"):
        actq.quantize(actq.import_policy(UR3), bits=3, steps=2, method="rtn", progress=False)


def test_errors_of_an_image_are_those_of_eval(command, image, mlp, observations, tmp_path):
    np.save(tmp_path / "heldout.npy", observations[:200])
    (tmp_path / "mlp.onnx").write_bytes(mlp.read_bytes())
    image.save(tmp_path / "i.actq")
    told = json.loads(command("eval", tmp_path / "i.actq", "--policy", tmp_path / "mlp.onnx", "--json"))
    errors = actq.evaluate(image, tmp_path / "heldout.npy", actq.import_policy(mlp))
    assert vars(errors) == told


def test_an_image_survives_its_file(image, tmp_path):
    image.save(tmp_path / "i.actq")
    loaded = actq.Image.load(tmp_path / "i.actq")
    assert loaded == image == pickle.loads(pickle.dumps(image)) == actq.Image(image.bytes)
    assert (image.name, image.obs_len, image.act_len, len(image)) == ("mlp", 12, 4, len(image.bytes))
    assert image.bits_per_weight < 3.01 and image.rate_hz == 50.0


def test_a_report_is_a_page_with_the_image(image, tmp_path):
    page = image.report()
    assert page.startswith("<!doctype html>") and "<h2" not in page and 'srcdoc="&lt;!doctype' in page._repr_html_()
    page.save(tmp_path / "i.html")
    assert (tmp_path / "i.html").read_text(encoding="utf-8") == page


def test_reports_are_those_of_the_command(command, image, tmp_path):
    image.save(tmp_path / "i.actq")
    assert image.inspect() == command("inspect", tmp_path / "i.actq").decode()
    cost = image.cost("stm32f405")
    assert f"{cost['milliseconds']:.3f} ms at 168 MHz" in image.inspect()
    assert 0 < cost["scratch_bytes"] < cost["scratch_limit"]
    command("export-c", tmp_path / "i.actq", "--out", tmp_path / "c")
    paths = image.export_c(tmp_path / "py")
    assert len(paths) == 3
    for path in paths:
        assert path.read_bytes() == (tmp_path / "c" / path.name).read_bytes()
    paths[0].write_text("by hand")
    with pytest.raises(actq.Error, match="actq did not write it"):
        image.export_c(tmp_path / "py")
    assert paths[0].read_text() == "by hand"
    assert image.export_c(tmp_path / "py", force=True) == paths
    assert paths[0].read_bytes() == (tmp_path / "c" / paths[0].name).read_bytes()


PROFILE = """
family = "mine"
[[mark]]
ending = "yaml"
keys = ["home_pose"]
[[rule]]
key = "last_action"
meaning = "is the action that is fed back the network's output (\\"raw\\")?"
value = "raw"
from = "deploy/run.py:8"
[stack]
file = "robot.yaml"
rate = { period = "dt" }
joints = { names = "motors", default = "home_pose" }
observation = [{ terms = ["gyro", "q", "action"], scale = 1.0 }]
action = { kind = "position", scale = 0.25, relative = true, fed_back = "last_action" }
[[stack.term]]
names = ["gyro"]
is = "raw"
len = 4
[[stack.term]]
names = ["q"]
is = "joints"
relative = true
[[stack.term]]
names = ["action"]
is = "action"
"""


def test_a_profile_describes_a_stack_of_ones_own(mlp, tmp_path):
    bundle, profile = tmp_path / "bundle", tmp_path / "mine.toml"
    bundle.mkdir()
    (bundle / "policy.onnx").write_bytes(mlp.read_bytes())
    (bundle / "robot.yaml").write_text("motors: [a, b, c, d]\nhome_pose: [0.1, 0.2, 0.3, 0.4]\ndt: 0.02\n")
    profile.write_text(PROFILE)
    policy = actq.import_policy(bundle, profile=profile)
    assert (policy.obs_len, policy.act_len, policy.rate_hz) == (8, 4, 50.0)
    # Raw values in, targets out; the network's last action is fed back.
    raw, home, last = np.random.default_rng(0).normal(size=(3, 8)).astype(np.float32), np.array([0.1, 0.2, 0.3, 0.4]), np.zeros(4)
    network, expected = actq.import_policy(mlp), []
    for gyro, joints in zip(raw[:, :4], raw[:, 4:]):
        last = network(np.concatenate([gyro, joints - home, last]))
        expected.append(home + 0.25 * last)
    np.testing.assert_allclose(policy(raw), expected, rtol=1e-4, atol=1e-5)
    with pytest.raises(actq.Error, match=r"the shape \[7\]; use \[8\] for one"):
        policy(raw[0, :7])
    with pytest.raises(actq.Error, match="profile: .*no.toml: "):
        actq.import_policy(bundle, profile=tmp_path / "no.toml")
    # A profile makes a bundle of an ONNX file; this one lacks the keys of the profile.
    with pytest.raises(actq.Error, match="not a bundle of this profile: no file has its keys"):
        actq.import_policy(mlp, profile=profile)
    with pytest.raises(actq.Error, match="policy: only a deploy bundle takes accept_profile, answers and profile"):
        actq.import_policy(UR3, profile=profile)


def test_one_onnx_file_with_metadata_is_a_bundle(mlp, tmp_path):
    onnx = pytest.importorskip("onnx", reason="onnx is not installed")
    path, model = tmp_path / "mjlab.onnx", onnx.load(mlp)
    metadata = {
        "joint_names": "a,b,c,d",
        "observation_names": "joint_pos,joint_vel,actions",
        "default_joint_pos": "0.1,0.2,0.3,0.4",
        "action_scale": "0.5,0.5,0.5,0.5",
        "joint_stiffness": "1,1,1,1",
        "joint_damping": "2,2,2,2",
    }
    onnx.helper.set_model_props(model, metadata)
    onnx.save(model, path)
    policy = actq.import_policy(path, accept_profile=True, answers={"rate_hz": 50})
    assert (policy.obs_len, policy.act_len, policy.rate_hz) == (8, 4, 50.0)
    # Without an answer it is the network alone.
    assert actq.import_policy(path).obs_len == 12
    with pytest.raises(actq.Error, match="rate_hz: how many ticks a second"):
        actq.import_policy(path, accept_profile=True)
    with pytest.raises(actq.Error, match="mjlab.onnx: a bundle takes no output, states, observe, prefix and rate_hz"):
        actq.import_policy(path, accept_profile=True, output="action")


def test_outliers_and_other_axes_are_said(mlp, observations, caplog):
    policy = actq.import_policy(mlp)
    quantize = lambda given, **options: actq.quantize(policy, given, bpw=3, steps=5, progress=False, **options)  # noqa: E731
    spiked = observations.copy()
    quantize(spiked)
    assert "is far outside" not in caplog.text and "all its other values" not in caplog.text
    spiked[100, 3] = 1e6
    quantize(spiked)
    assert "recordings: observation dimension 3 is 1.000e6 in episode 0, step 100, where all its other values" in caplog.text
    spiked[100, 3] = np.finfo(np.float32).max
    with pytest.raises(actq.Error, match="recordings: episode 0, step 100: .* which is no measured value"):
        quantize(spiked)


def test_steps_on_the_first_axis_are_said(mlp, caplog):
    random, walk = np.random.default_rng(4), np.zeros((8, 100, 12), np.float32)
    for step in range(1, 100):
        walk[:, step] = 0.95 * walk[:, step - 1] + 0.3 * random.normal(size=(8, 12))
    for given, is_said in [(walk, False), (np.swapaxes(walk, 0, 1), True)]:
        actq.quantize(actq.import_policy(mlp), given, bpw=3, steps=5, progress=False)
        assert ("recordings looks like [step, robot, value]" in caplog.text) == is_said


def test_the_default_of_distill_has_the_size_of_three_bits(mlp, observations):
    policy, options = actq.import_policy(mlp), {"steps": 5, "progress": False}
    three = actq.quantize(policy, observations, bits=3, **options)
    assert 0.9 * len(three) < len(actq.quantize(policy, observations, **options)) <= len(three)
    forced = {"widths": {"w1": 8}, **options}
    assert actq.quantize(policy, observations, **forced) == actq.quantize(policy, observations, bits=3, **forced)
    assert actq.quantize(policy, method="rtn", progress=False) == actq.quantize(policy, method="rtn", bits=3, progress=False)
