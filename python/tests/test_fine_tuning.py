"""Modules that were trained further, back as images."""

import copy
import pickle

import numpy as np
import pytest

import actq
from conftest import write_mlp
from test_export import quantized, recurrent

torch = pytest.importorskip("torch", reason="torch is not installed (requirements-optional.txt)")


def trained(module, loss, steps=10, rate=1e-3):
    optimizer = torch.optim.Adam(module.parameters(), rate)
    losses = []
    for _ in range(steps):
        value = loss()
        optimizer.zero_grad()
        value.backward()
        optimizer.step()
        losses.append(value.item())
    return losses


def toward_zero(module, obs, **inputs):
    def loss():
        outputs = module(obs, **inputs)
        return sum(o.square().mean() for o in (outputs if isinstance(outputs, tuple) else (outputs,)))

    return loss


def weights_of(image):
    return {name: array for name, array in image.network()["tensors"].items() if name.startswith("weight_")}


def removed_rows(folder):
    """A network whose second hidden unit is worth no bits, with weights of unequal importance."""
    random = np.random.default_rng(9)
    layers = [(random.normal(size=(12, 40)) * np.geomspace(1, 1e-4, 40), np.zeros(40)), (random.normal(size=(40, 4)), np.zeros(4))]
    return write_mlp(folder / "unequal.onnx", layers)


@pytest.fixture(params=["2 bits", "mixed", "groups", "scalar", "scalar 8 bits", "recurrent", "recurrent scalar", "flow"])
def image(request, mlp, flow, observations, tmp_path):
    """Images of all layouts and kinds of weights."""
    if request.param == "flow":
        return flow
    if request.param == "mixed":
        policy = actq.import_policy(removed_rows(tmp_path))
        return actq.quantize(policy, observations, bpw=1.5, steps=20, progress=False)
    if "recurrent" in request.param:
        core = "m0" if "scalar" in request.param else None
        return quantized(recurrent(tmp_path), bits=4, activations=8, core=core)
    options = {
        "2 bits": {"bits": 2, "activations": 16},
        "groups": {"bits": 3, "group": 32, "activations": 8},
        "scalar": {"bits": 2, "group": 0, "activations": 8, "core": "m3"},
        "scalar 8 bits": {"bits": 8, "group": 32, "activations": 8, "core": "rv32imac"},
    }
    return quantized(mlp, **options[request.param])


def inputs_of(image, count=6):
    """Random observations, and the noise of a flow policy."""
    random, sizes = np.random.default_rng(3), dict(image.network()["inputs"])
    given = {name: random.normal(size=(count, n)).astype(np.float32) for name, n in sizes.items() if name != "state"}
    return {name: torch.from_numpy(array) for name, array in given.items()}


def test_the_image_of_an_untrained_module_has_the_same_bytes(image):
    assert actq.FakeQuant(image).to_image() == image
    assert actq.FakeQuant(image).double().to_image() == image
    assert copy.deepcopy(actq.FakeQuant(image)).to_image() == image


def test_the_image_of_a_trained_module_has_its_weights_and_actions(image):
    module, inputs = actq.FakeQuant(image), inputs_of(image)
    trained(module, toward_zero(module, **inputs), rate=1e-2)
    new = pickle.loads(pickle.dumps(module)).to_image()
    assert len(new) == len(image) and new.source != image.source and new.crc32 != image.crc32
    assert actq.FakeQuant(new).to_image() == new
    changed = 0
    for name, found in weights_of(new).items():
        expected = (module._levels(name, getattr(module, name)) * getattr(module, f"step_{name}")).detach().numpy()
        assert np.array_equal(found, expected), name
        changed += (found != weights_of(image)[name]).sum()
    assert changed > 0, "training has moved no weight to another level"
    for name, value in module.named_parameters():
        if not name.startswith("weight_"):
            assert np.array_equal(new.network()["tensors"][name], value.detach().numpy()), name
    if "noise" in inputs:
        return
    head, states = actq.Head(new, 1), ()
    for row in inputs["obs"]:
        with torch.no_grad():
            outputs = module(row[None], *states)
        action, *states = outputs if isinstance(outputs, tuple) else (outputs,)
        action = action.numpy().reshape(-1)[: new.act_len]
        assert np.abs(head(row.numpy()) - action).max() < 2e-2 * max(1, np.abs(action).max())


def test_a_module_is_trained_on_the_grid(mlp, observations):
    image = quantized(mlp, bits=2, activations=16)
    obs = torch.from_numpy(observations)
    with torch.no_grad():
        target = actq.FakeQuant(quantized(mlp))(obs)
    module = actq.FakeQuant(image)
    trained(module, lambda: (module(obs) - target).square().mean(), steps=100, rate=2e-3)
    error = lambda of: ((actq.Head(of)(observations) - target.numpy()) ** 2).mean()
    new = module.to_image()
    assert error(new) < 0.5 * error(image)
    # Errors against the f32 policy are measured by recorded actions: the image is no longer made of the policy.
    policy = actq.import_policy(mlp)
    recorded = {"obs": observations, "action": policy(observations)}
    assert actq.evaluate(new, recorded).nmse < actq.evaluate(image, recorded).nmse
    with pytest.raises(actq.Error, match="made from another policy"):
        actq.evaluate(new, observations, policy)


def test_modules_that_are_no_image_are_refused(mlp):
    image = quantized(mlp, bits=2, activations=8)

    def refused(text, change):
        module = actq.FakeQuant(image)
        with torch.no_grad():
            change(module)
        with pytest.raises(actq.Error, match=text):
            module.to_image()

    names = sorted(dict(actq.FakeQuant(image).named_parameters()))
    weight, bias = next(n for n in names if n.startswith("weight")), next(n for n in names if n.startswith("bias"))
    refused(f"{weight} has a value that is not finite", lambda m: getattr(m, weight).fill_(float("nan")))
    refused(f"{bias} has a value that is not finite", lambda m: getattr(m, bias).fill_(float("inf")))
    refused(f"{bias} has the shape \\(3,\\)", lambda m: setattr(m, bias, torch.nn.Parameter(torch.zeros(3))))


def test_larger_sums_leave_fewer_levels_to_activations(tmp_path):
    random = np.random.default_rng(4)
    path = write_mlp(tmp_path / "wide.onnx", [(random.normal(size=(1200, 4)), np.ones(4))])
    module = actq.FakeQuant(quantized(path, bits=8, group=0, activations=16))
    with torch.no_grad():
        module.weight_0.mul_(1e3)
    new = module.to_image()
    rows = random.normal(size=(5, 1200)).astype(np.float32)
    with torch.no_grad():
        expected = module(torch.from_numpy(rows)).numpy()
    assert np.abs(actq.Head(new)(rows) - expected).max() < 1e-3 * np.abs(expected).max()
    assert actq.FakeQuant(new).to_image() == new
    module = actq.FakeQuant(quantized(path, bits=8, group=128, activations=16))
    with torch.no_grad():
        module.weight_0.mul_(1e3)
    with pytest.raises(actq.Error, match="operation 0: the sums of a row leave int32; train fewer steps"):
        module.to_image()


def test_changed_limits_are_refused(tmp_path):
    random = np.random.default_rng(5)
    path = write_mlp(tmp_path / "limited.onnx", [(random.normal(size=(12, 4)), np.zeros(4))])
    policy = actq.import_policy(path, low=-1.0, high=1.0)
    module = actq.FakeQuant(actq.quantize(policy, bits=4, method="rtn", progress=False))
    module.low -= 1
    with pytest.raises(actq.Error, match="low has changed, but only weights, biases, norms and tables go back"):
        module.to_image()


def test_weights_without_a_step_stay_zero(tmp_path):
    """Rows that an image does not have are no weights."""
    random = np.random.default_rng(2)
    weight = random.normal(size=(12, 4))
    weight[:, 1] = 0
    image = quantized(write_mlp(tmp_path / "zero.onnx", [(weight, np.ones(4))]), bits=2, activations=8)
    module = actq.FakeQuant(image)
    obs = torch.from_numpy(random.normal(size=(20, 12)).astype(np.float32))
    trained(module, toward_zero(module, obs), rate=1e-2)
    assert not weights_of(module.to_image())["weight_0"][1].any()
