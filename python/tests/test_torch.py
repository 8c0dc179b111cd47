"""Modules of torch and TorchScript files."""

import numpy as np
import pytest

import actq

torch = pytest.importorskip("torch", reason="torch is not installed (requirements-optional.txt)")
nn = torch.nn


def actor():
    torch.manual_seed(0)
    return nn.Sequential(nn.Linear(12, 32), nn.ELU(), nn.LayerNorm(32), nn.Linear(32, 32), nn.SiLU(), nn.Linear(32, 4))


class Recurrent(nn.Module):
    def __init__(self):
        super().__init__()
        self.lstm = nn.LSTM(12, 16)
        self.out = nn.Linear(16, 4)

    def forward(self, obs, h, c):
        y, (h, c) = self.lstm(obs[None], (h, c))
        return self.out(y[0]), h, c


class Normed(nn.Module):
    def __init__(self):
        super().__init__()
        self.norm, self.out = nn.RMSNorm(12), nn.Linear(12, 4)

    def forward(self, obs):
        return self.out(self.norm(obs))


def near(policy, module, observations):
    """An image of 8 bits and int16 activations is within 2 % of the module."""
    image = actq.quantize(policy, bits=8, method="rtn", activations=16, progress=False)
    with torch.no_grad():
        expected = module(torch.from_numpy(observations)).numpy()
    found = actq.Head(image)(observations)
    assert np.abs(found - expected).max() < 0.02 * np.abs(expected).max()


def test_a_module_is_imported(observations):
    module = actor().train()
    policy = actq.import_policy(module, torch.zeros(1, 12), name="actor")
    assert (policy.name, policy.obs_len, policy.act_len) == ("actor", 12, 4)
    assert policy.parameters == sum(p.numel() for p in module.parameters())
    assert module.training, "the module's mode is as before"
    near(policy, module, observations)


def test_a_module_with_an_operator_of_the_newer_exporter_is_imported(observations):
    pytest.importorskip("onnxscript", reason="onnxscript is not installed (requirements-optional.txt)")
    module = Normed().eval()
    near(actq.import_policy(module, torch.zeros(1, 12)), module, observations)


def test_the_newer_exporter_gets_a_module_in_evaluation_mode():
    pytest.importorskip("onnxscript", reason="onnxscript is not installed (requirements-optional.txt)")

    class Value(nn.Module):
        def __init__(self):
            super().__init__()
            self.body = nn.Sequential(nn.RMSNorm(12), nn.BatchNorm1d(12), nn.Dropout(0.5))
            self.out, self.value = nn.Linear(12, 4), nn.Linear(12, 1)

        def forward(self, obs):
            x = self.body(obs)
            return {"action": self.out(x), "value": self.value(x)}

    # The tracing exporter, which is tried first, sets the mode of all parts to that of the whole.
    assert actq.import_policy(Value().eval(), torch.zeros(1, 12)).act_len == 4


class Codes(torch.Tensor):
    """Weights of 8 bits and their scale, with the operations of a Linear layer and no others, as torchao's."""

    @staticmethod
    def __new__(cls, codes, scale):
        made = torch.Tensor._make_wrapper_subclass(cls, codes.shape, dtype=scale.dtype)
        made.codes, made.scale = codes, scale
        return made

    def __tensor_flatten__(self):
        return ["codes", "scale"], None

    def __deepcopy__(self, memo):
        return Codes(self.codes.clone(), self.scale.clone())

    @classmethod
    def __torch_function__(cls, function, types, args=(), kwargs=None):
        if function is nn.functional.linear:
            x, weight, bias = args
            return function(x, weight.codes * weight.scale, bias)
        with torch._C.DisableTorchFunctionSubclass():
            return function(*args, **(kwargs or {}))

    @classmethod
    def __torch_dispatch__(cls, function, types, args=(), kwargs=None):
        if function is torch.ops.aten.detach.default:
            return Codes(args[0].codes, args[0].scale)
        raise NotImplementedError(f"{function}")


def test_quantized_weights_of_a_module_are_imported(observations):
    torch.manual_seed(0)
    module = nn.Sequential(nn.Linear(12, 32), nn.ELU(), nn.Linear(32, 4)).eval()
    for layer in (module[0], module[2]):
        scale = layer.weight.detach().abs().amax(dim=1, keepdim=True) / 127
        codes = (layer.weight.detach() / scale).round().to(torch.int8)
        layer.weight = nn.Parameter(Codes(codes, scale), requires_grad=False)
    near(actq.import_policy(module, torch.zeros(1, 12)), module, observations)


def test_a_torchscript_file_is_imported(observations, tmp_path):
    module = actor().eval()
    torch.jit.script(module).save(tmp_path / "actor.pt")
    policy = actq.import_policy(tmp_path / "actor.pt", torch.zeros(1, 12))
    assert policy.name == "actor"
    near(policy, module, observations)


def test_a_module_has_the_bytes_of_its_file(command, observations, tmp_path):
    module = actor().eval()
    torch.onnx.export(module, (torch.zeros(1, 12),), str(tmp_path / "actor.onnx"), opset_version=17, dynamo=False)
    np.save(tmp_path / "obs.npy", observations)
    options = ["--calib", tmp_path / "obs.npy", "--bpw", "3", "--steps", "5"]
    command("quantize", tmp_path / "actor.onnx", "--out", tmp_path / "c.actq", *options)
    policy = actq.import_policy(module, torch.zeros(1, 12), name="actor")
    image = actq.quantize(policy, observations, bpw=3, steps=5, progress=False)
    assert image.bytes == (tmp_path / "c.actq").read_bytes()


def test_a_recurrent_module_keeps_its_state(observations):
    torch.manual_seed(0)
    module = Recurrent()
    state = torch.zeros(1, 1, 16)
    policy = actq.import_policy(
        module,
        (torch.zeros(1, 12), state, state),
        input_names=["obs", "h", "c"],
        output_names=["action", "h_next", "c_next"],
        states={"h": "h_next", "c": "c_next"},
    )
    assert policy.state_len == 32
    image = actq.quantize(policy, bits=8, method="rtn", activations=16, progress=False)
    head, h, c = actq.Head(image), state, state
    for row in observations[:20]:
        with torch.no_grad():
            expected, h, c = module(torch.from_numpy(row[None]), h, c)
        assert np.abs(head(row) - expected.numpy()[0]).max() < 0.02


def test_an_observed_input_is_no_state():
    class Predicts(nn.Module):
        def __init__(self):
            super().__init__()
            self.next, self.out = nn.Linear(12, 12), nn.Linear(12, 4)

        def forward(self, state, gain):
            return self.out(state) * gain, self.next(state)

    example = (torch.zeros(1, 12), torch.zeros(1, 4))
    names = {"input_names": ["state", "gain"], "output_names": ["action", "next_state"]}
    with pytest.raises(actq.Error, match=r'observe=\["state"\]'):
        actq.import_policy(Predicts(), example, **names)
    policy = actq.import_policy(Predicts(), example, observe=["state"], **names)
    assert (policy.obs_len, policy.state_len) == (16, 0)
    with pytest.raises(actq.Error, match="observe is the text 'state'; pass a list of inputs"):
        actq.import_policy(Predicts(), example, observe="state", **names)


def test_what_cannot_be_imported_is_named():
    class Sorted(nn.Module):
        def forward(self, obs):
            return obs.sort().values

    with pytest.raises(actq.Error, match="Sorted: "):
        actq.import_policy(Sorted(), torch.zeros(1, 12))
    with pytest.raises(actq.Error, match=r"Linear: pass an example of the module's input, as torch.zeros\(1, n_obs\)"):
        actq.import_policy(nn.Linear(12, 4))
    with pytest.raises(actq.Error) as raised:
        actq.import_policy(nn.Linear(12, 4), torch.zeros(1, 5))
    assert str(raised.value) == "Linear: the example has 5 values; the module takes 12"
    for example, found in ((np.zeros((1, 12), np.float32), "ndarray"), ({"obs": torch.zeros(1, 12)}, "dict"), ((), "empty")):
        with pytest.raises(actq.Error, match=f"the example is of type .*{found}.*; pass a tensor"):
            actq.import_policy(nn.Linear(12, 4), example)
    with pytest.raises(actq.Error, match="Module: the module fails on the example"):
        actq.import_policy(nn.Module(), torch.zeros(1, 12))


class Net(nn.Module):
    """A network from 6 values and what a module adds to 3 actions, with buffers of zeros."""

    def __init__(self, more=0, **buffers):
        super().__init__()
        torch.manual_seed(1)
        self.net = nn.Sequential(nn.Linear(6 + more, 16), nn.ELU(), nn.Linear(16, 3))
        for name, shape in buffers.items():
            self.register_buffer(name, torch.zeros(shape))


class History(Net):
    def __init__(self):
        super().__init__(6, frames=(1, 2, 6))

    def forward(self, x):
        self.frames = torch.cat([self.frames[:, 1:], x[:, None]], 1)
        return self.net(self.frames.flatten(1))


class Filter(Net):
    def __init__(self):
        super().__init__(low_pass=(1, 3))

    def forward(self, x):
        self.low_pass.mul_(0.8).add_(0.2 * self.net(x))
        return self.low_pass.clone()


class LastAction(Net):
    """Keeps a tensor that is no buffer, and does not exist at first."""

    def __init__(self):
        super().__init__(3)
        self.last = None

    def forward(self, x):
        last = torch.zeros(1, 3) if self.last is None else self.last
        self.last = self.net(torch.cat([x, last], 1))
        return self.last


class Late(Net):
    """Acts otherwise after more steps than are compared."""

    def __init__(self):
        super().__init__()
        self.steps = 0

    def forward(self, x):
        self.steps += 1
        return self.net(x) * (0.0 if self.steps > 900 else 1.0)


class Cell(Net):
    def __init__(self):
        super().__init__(h=(1, 6))
        self.cell = nn.GRUCell(6, 6)

    def forward(self, x):
        self.h[:] = self.cell(x, self.h)
        return self.net(self.h)


class CellAndFilter(Cell):
    def __init__(self):
        super().__init__()
        self.register_buffer("low_pass", torch.zeros(1, 3))

    def forward(self, x):
        self.low_pass.mul_(0.8).add_(0.2 * super().forward(x))
        return self.low_pass.clone()


class Lstm(Net):
    """Keeps the states of a layer, as a tuple that does not exist at first."""

    def __init__(self):
        super().__init__()
        self.lstm, self.states = nn.LSTM(6, 6), None

    def forward(self, x):
        hidden, self.states = self.lstm(x[None], self.states)
        return self.net(hidden[0])


@pytest.mark.parametrize(
    ("make", "kept"), [(History, "frames"), (Filter, "low_pass"), (LastAction, "last"), (Late, "steps"), (CellAndFilter, "h, low_pass")]
)
def test_memory_of_a_module_is_refused(make, kept):
    with pytest.raises(actq.Error, match=f"{make.__name__}: the action depends on values that .* from step to step: {kept};"):
        actq.import_policy(make(), torch.zeros(1, 6))


@pytest.mark.parametrize(("make", "state_len"), [(Cell, 6), (Lstm, 12)])
def test_states_that_a_module_keeps_by_itself_are_states(make, state_len):
    policy = actq.import_policy(make(), torch.zeros(1, 6))
    assert policy.state_len == state_len
    head = actq.Head(actq.quantize(policy, bits=8, method="rtn", activations=16, progress=False))
    module, rows = make().eval(), np.random.default_rng(1).standard_normal((50, 6), dtype=np.float32)
    for row in rows:
        with torch.no_grad():
            expected = module(torch.from_numpy(row[None])).numpy()[0]
        assert np.abs(head(row) - expected).max() < 0.02


def test_a_first_state_that_is_not_zero_is_refused():
    module = Cell()
    module.h += 1
    with pytest.raises(actq.Error, match="from step to step: h;"):
        actq.import_policy(module, torch.zeros(1, 6))


def test_memory_of_a_torchscript_file_is_refused(tmp_path):
    torch.jit.script(Filter()).save(tmp_path / "filter.pt")
    with pytest.raises(actq.Error, match="from step to step: low_pass; of TorchScript they cannot be taken; pass"):
        actq.import_policy(tmp_path / "filter.pt", torch.zeros(1, 6))


def test_the_reasons_of_both_exporters_are_given():
    pytest.importorskip("onnxscript", reason="onnxscript is not installed (requirements-optional.txt)")

    class Whole(nn.Module):
        def forward(self, obs):
            eighths = (obs * 8).to(torch.int8)
            return torch._int_mm(eighths.expand(32, 12)[:, :8], torch.ones(8, 8, dtype=torch.int8)).float()

    with pytest.raises(actq.Error, match="torch cannot export the module: .*; nor can its newer exporter: .*_int_mm"):
        actq.import_policy(Whole(), torch.zeros(1, 12))


def test_a_failed_export_prints_no_graph(capfd, tmp_path):
    torch.jit.script(Cell()).save(tmp_path / "cell.pt")
    capfd.readouterr()
    with pytest.raises(actq.Error, match="cell: torch cannot export the module: "):
        actq.import_policy(tmp_path / "cell.pt", torch.zeros(1, 6))
    assert "graph" not in "".join(capfd.readouterr())


def test_values_that_nothing_reads_are_no_memory():
    class Recorded(Net):
        def forward(self, x):
            self.last, self.calls = self.net(x), getattr(self, "calls", 0) + 1
            return self.last

    assert actq.import_policy(Recorded(), torch.zeros(1, 6)).act_len == 3


class Mirror(Net):
    def forward(self, x):
        return -self.net(-x) if x[0, 0] < 0 else self.net(x)


class Small(Net):
    def forward(self, x):
        return self.net(x) if x.abs().max() > 0.05 else self.net(0 * x)


class Far(Net):
    def forward(self, x):
        return self.net(x) if x.norm() < 100 else 0.5 * self.net(x)


class Item(Net):
    def forward(self, x):
        return self.net(x) * x.abs().max().item()


class Numpy(Net):
    def forward(self, x):
        return self.net(x) + torch.from_numpy(np.sin(x.numpy()[:, :3]))


class Loop(Net):
    def forward(self, x):
        y = self.net(x)
        for _ in range(int(3 * x[0, 0].abs())):
            y = 0.5 * y
        return y


@pytest.mark.parametrize("make", [Mirror, Small, Far, Item, Numpy, Loop])
def test_a_result_that_depends_on_values_is_refused(make):
    with pytest.raises(actq.Error, match=r"the result depends on values, .* at .*test_torch.py:\d+ \(Converting a tensor"):
        actq.import_policy(make(), torch.full((1, 6), 0.5))


def test_a_branch_without_a_difference_is_logged(caplog):
    class Checked(Net):
        def forward(self, x):
            assert not torch.isnan(x).any()
            return self.net(x)

    assert actq.import_policy(Checked(), torch.zeros(1, 6)).act_len == 3
    assert "no drawn observation shows a difference" in caplog.text


def test_random_numbers_are_refused():
    class Drawn(Net):
        def forward(self, x):
            return self.net(x) + float(np.random.default_rng().normal())

    with pytest.raises(actq.Error, match="two runs of the module on the same observations differ"):
        actq.import_policy(Drawn(), torch.zeros(1, 6))


def test_an_import_changes_nothing_of_the_module():
    module = nn.Sequential(nn.Linear(6, 6), nn.BatchNorm1d(6), History()).train()
    module[1].eval()
    module(torch.randn(1, 6)).sum().backward()
    # With a history of gradients, which torch's own copy refuses.
    assert not module[2].frames.is_leaf
    values = {name: value.clone() for name, value in module.state_dict().items()}
    grads = [parameter.grad.clone() for parameter in module.parameters()]
    modes, random = [part.training for part in module.modules()], torch.get_rng_state()
    with pytest.raises(actq.Error, match="from step to step: 2.frames;"):
        actq.import_policy(module, torch.zeros(1, 6))
    assert actq.import_policy(module[:2], torch.zeros(1, 6)).act_len == 6
    assert modes == [part.training for part in module.modules()] and not module[1].training
    assert all(torch.equal(value, values[name]) for name, value in module.state_dict().items())
    assert all(torch.equal(parameter.grad, grad) for parameter, grad in zip(module.parameters(), grads))
    assert torch.equal(random, torch.get_rng_state())


def test_observations_are_drawn_around_a_modules_means():
    class Physical(Filter):
        def forward(self, x):
            return super().forward(((x - 1e5) / 50).clamp(-5, 5))

    with pytest.raises(actq.Error, match="from step to step: low_pass;"):
        actq.import_policy(Physical(), torch.zeros(1, 6))


class Critic(Net):
    """Returns the critic's value and the mean action in one of several forms."""

    def __init__(self, form):
        super().__init__()
        self.critic, self.form = nn.Linear(6, 1), form

    def forward(self, x):
        return self.form(self.critic(x), self.net(x))


def test_the_action_of_several_outputs_is_asked_for():
    def sampled(value, mean):
        action = mean + torch.randn_like(mean)
        return action, value, (action - mean).square().sum(-1)

    for form, outputs in [
        (lambda value, mean: (value, mean), r"output_0 \(1 values\), output_1 \(3 values\)"),
        (lambda value, mean: {"mu": mean, "value": value}, r"mu \(3 values\), value \(1 values\)"),
        (sampled, r"output_1 \(1 values\)"),
    ]:
        with pytest.raises(actq.Error, match=f"choose one by output=.NAME.*{outputs}|{outputs}; choose one by output="):
            actq.import_policy(Critic(form), torch.zeros(1, 6))
    named = Critic(lambda value, mean: {"value": value, "action": mean})
    assert actq.import_policy(named, torch.zeros(1, 6)).act_len == 3
    pair = Critic(lambda value, mean: (value, mean))
    assert actq.import_policy(pair, torch.zeros(1, 6), output="output_1").act_len == 3


@pytest.mark.parametrize("function", [nn.Tanh, nn.ELU, nn.SELU, nn.Sigmoid, nn.SiLU, nn.GELU, nn.Softplus, nn.Mish])
def test_networks_without_biases_are_imported(function):
    for seed in range(4):
        torch.manual_seed(seed)
        layers = [nn.Linear(11, 64, bias=False), function(), nn.Linear(64, 64, bias=False), function()]
        assert actq.import_policy(nn.Sequential(*layers, nn.Linear(64, 3, bias=False)), torch.zeros(1, 11)).act_len == 3


class FreshRecurrent(nn.Module):
    """A fresh policy without biases: its actions are tiny where its observations are."""

    def __init__(self, cell, function, exported=None):
        super().__init__()
        torch.manual_seed(0)
        self.first, self.cell, self.out = nn.Linear(11, 64, bias=False), cell(64, 64, bias=False), nn.Linear(64, 3, bias=False)
        self.function, self.exported = function, exported or function

    def forward(self, obs, *states):
        hidden = (self.exported if torch.onnx.is_in_onnx_export() else self.function)(self.first(obs))
        states = self.cell(hidden, states) if len(states) > 1 else (self.cell(hidden, *states),)
        return (self.out(states[0]), *states)


class Keeping(nn.Module):
    """Keeps the states by itself."""

    def __init__(self, module, count):
        super().__init__()
        self.module, self.states = module, tuple(torch.zeros(1, 64) for _ in range(count))

    def forward(self, obs):
        action, *states = self.module(obs, *self.states)
        self.states = tuple(states)
        return action


@pytest.mark.parametrize("cell, names", [(nn.GRUCell, ["h"]), (nn.LSTMCell, ["h", "c"])])
def test_recurrent_modules_may_differ_by_the_errors_of_functions(cell, names):
    after = [f"{name}_next" for name in names]
    ports = {"input_names": ["obs", *names], "output_names": ["action", *after], "states": dict(zip(names, after))}
    example = (torch.zeros(1, 11), *(torch.zeros(1, 64) for _ in names))
    for function in (nn.ELU(), torch.tanh):
        assert actq.import_policy(FreshRecurrent(cell, function), example, **ports).state_len == 64 * len(names)
        kept = Keeping(FreshRecurrent(cell, function), len(names))
        assert actq.import_policy(kept, torch.zeros(1, 11)).state_len == 64 * len(names)
    for other in (nn.Hardtanh(), lambda x: 1.0003 * torch.tanh(x), lambda x: torch.tanh(x + 3e-5)):
        with pytest.raises(actq.Error, match="more than roundings explain. If forward computes outside of torch"):
            actq.import_policy(FreshRecurrent(cell, torch.tanh, other), example, **ports)


class Exported(nn.Module):
    """Computes something else while it is exported."""

    def __init__(self, exported):
        super().__init__()
        torch.manual_seed(0)
        self.first, self.out, self.exported = nn.Linear(11, 64, bias=False), nn.Linear(64, 3, bias=False), exported

    def forward(self, obs):
        hidden = self.first(obs)
        return 0.01 * self.out(self.exported(hidden) if torch.onnx.is_in_onnx_export() else torch.tanh(hidden))


@pytest.mark.parametrize("exported", [nn.Hardtanh(), nn.ELU(), lambda x: 1.0003 * torch.tanh(x), lambda x: torch.tanh(x + 3e-5)])
def test_another_function_or_weight_is_refused(exported):
    with pytest.raises(actq.Error, match="more than roundings explain. If forward computes outside of torch"):
        actq.import_policy(Exported(exported), torch.zeros(1, 11))
    assert actq.import_policy(Exported(torch.tanh), torch.zeros(1, 11)).act_len == 3


def test_errors_of_functions_are_summed():
    from actq import _functions

    def bounds(*given):
        return list(_functions.bounds(*given))

    torch.manual_seed(0)
    first, out = nn.Linear(5, 7), nn.Linear(7, 2)
    weights = out.weight.detach().abs().sum(dim=1).double().numpy()
    x, both = torch.randn(1, 5), np.array([0, 1])
    for function, error in [(nn.Tanh(), 1.5e-7), (nn.ELU(2.0), 2.4e-7), (nn.Sigmoid(), 1.1e-7)]:
        found = bounds(lambda given: out(function(first(*given))), [x], both)
        np.testing.assert_allclose(found, error * weights, rtol=1e-5)
        # Also of a script, and of a module that changes its input in place.
        script = torch.jit.script(nn.Sequential(first, function, out))
        np.testing.assert_allclose(bounds(lambda given: script(*given), [x], both), error * weights, rtol=1e-5)
        found = bounds(lambda given: out(function(first(given[0].clamp_(-1, 1)))), [x], both[1:])
        np.testing.assert_allclose(found, error * weights[1:], rtol=1e-5)
    hidden = first(x).detach().abs().clamp(min=1.0)[0]
    expected = 1.4e-7 * (out.weight.detach().abs() * hidden).sum(dim=1).numpy()
    np.testing.assert_allclose(bounds(lambda given: out(nn.functional.silu(first(*given))), [x], both), expected, rtol=1e-5)
    np.testing.assert_array_equal(bounds(lambda given: first(*given), [x], both), 0)
    # Of an episode, with the errors of all steps until then.
    run = lambda given: torch.cat([torch.tanh(given[0][:i]).sum(0) for i in (1, 2, 3)])  # noqa: E731
    np.testing.assert_allclose(bounds(run, [torch.randn(3, 1)], np.arange(3)), 1.5e-7 * np.array([1, 2, 3]), rtol=1e-5)
