"""Images as ONNX files and as modules of torch."""

import json

import numpy as np
import pytest

import actq
from conftest import UR3

runtime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")


def quantized(path, **options):
    options = {"bits": 8, "activations": 16, "method": "rtn", "progress": False, **options}
    return actq.quantize(actq.import_policy(path), **options)


def run(image, tmp_path, **inputs):
    image.to_onnx(tmp_path / "i.onnx")
    session = runtime.InferenceSession(tmp_path / "i.onnx", providers=["CPUExecutionProvider"])
    return session.run(None, inputs)


@pytest.fixture(params=["mlp", "ur3"])
def image(request, mlp):
    return quantized(mlp if request.param == "mlp" else UR3)


def test_an_onnx_file_gives_the_actions_of_the_image(image, tmp_path):
    rows = np.random.default_rng(4).normal(size=(20, image.obs_len)).astype(np.float32)
    (actions,) = run(image, tmp_path, obs=rows)
    found = np.stack([actq.Head(image)(row) for row in rows])
    # Of a chunk, a head plays the first action first.
    actions = actions.reshape(len(rows), -1)[:, : image.act_len]
    # The image rounds its activations.
    assert np.abs(actions - found).max() < 1e-2 * max(1, np.abs(found).max())


def test_an_onnx_file_of_an_image_can_be_imported_again(mlp, observations, tmp_path):
    image = quantized(mlp)
    image.to_onnx(tmp_path / "mlp.onnx")
    again = quantized(tmp_path / "mlp.onnx")
    first, second = (actq.Head(image)(observations) for image in (image, again))
    assert np.abs(first - second).max() < 0.02


def test_a_flow_policy_is_unrolled(flow, tmp_path):
    row = np.random.default_rng(5).normal(size=(1, flow.obs_len)).astype(np.float32)
    noise = np.zeros((1, dict(flow.network()["inputs"])["noise"]), np.float32)
    (chunk,) = run(flow, tmp_path, obs=row, noise=noise)
    assert chunk.shape[0] == 1 and chunk.shape[2] == flow.act_len and np.isfinite(chunk).all()


def written(folder, policy, shapes):
    """Writes a policy folder with tensors of random numbers."""
    random = np.random.default_rng(6)
    tensors = {name: random.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}
    header, at = {}, 0
    for name, tensor in tensors.items():
        span = [at, at := at + tensor.nbytes]
        header[name] = {"dtype": "F32", "shape": tensor.shape, "data_offsets": span}
    text = json.dumps(header).encode()
    data = b"".join(tensor.tobytes() for tensor in tensors.values())
    (folder / "policy.safetensors").write_bytes(len(text).to_bytes(8, "little") + text + data)
    (folder / "policy.json").write_text(json.dumps(policy))
    return folder


def recurrent(folder):
    """Writes a policy folder with a normalization, an LSTM, a GRU, norms, a sum and a product."""
    h = 8
    shapes = {
        "mean": (5,), "scale": (5,),
        "lstm.w_ih": (4 * h, 5), "lstm.w_hh": (4 * h, h), "lstm.b_ih": (4 * h,), "lstm.b_hh": (4 * h,),
        "gru.w_ih": (3 * h, h), "gru.w_hh": (3 * h, h), "gru.b_ih": (3 * h,), "gru.b_hh": (3 * h,),
        "ln.w": (h,), "ln.b": (h,), "rms.w": (h,), "out.w": (2, h), "out.b": (2,),
    }  # fmt: skip
    cell = ("w_ih", "w_hh", "b_ih", "b_hh")
    ops = [
        {"op": "normalize", "mean": "mean", "scale": "scale", "clip": 3.0},
        {"op": "lstm", "hidden": h, "gates": "i,f,g,o", **{key: f"lstm.{key}" for key in cell}, "save": "lstm"},
        {"op": "layernorm", "w_ln": "ln.w", "b_ln": "ln.b"},
        {"op": "gelu"},
        {"op": "gru", "hidden": h, "gates": "r,z,n", **{key: f"gru.{key}" for key in cell}},
        {"op": "add", "with": "lstm"},
        {"op": "rmsnorm", "w_ln": "rms.w"},
        {"op": "mish"},
        {"op": "mul", "with": "lstm"},
        {"op": "linear", "w": "out.w", "b": "out.b"},
    ]
    return written(folder, {"name": "recurrent", "obs_dim": 5, "act_dim": 2, "ops": ops}, shapes)


def test_a_recurrent_network_takes_and_gives_its_state(tmp_path):
    image = quantized(recurrent(tmp_path))
    assert [name for name, _ in image.network()["outputs"]] == ["action", "next_state"]
    head, state = actq.Head(image), np.zeros((1, 24), np.float32)
    for row in np.random.default_rng(8).normal(size=(10, 1, 5)).astype(np.float32):
        action, state = run(image, tmp_path, obs=row, state=state)
        assert np.abs(action[0] - head(row[0])).max() < 2e-3


def test_a_module_has_the_actions_of_the_image(image):
    torch = pytest.importorskip("torch", reason="torch is not installed (requirements-optional.txt)")
    rows = np.random.default_rng(7).normal(size=(20, image.obs_len)).astype(np.float32)
    found = np.stack([actq.Head(image)(row) for row in rows])
    with torch.no_grad():
        exact, smooth = (
            actq.FakeQuant(image, activations=rounds)(torch.from_numpy(rows)).numpy() for rounds in (True, False)
        )
    exact, smooth = (actions.reshape(len(rows), -1)[:, : image.act_len] for actions in (exact, smooth))
    scale = max(1, np.abs(found).max())
    assert np.abs(exact - found).max() < 1e-4 * scale
    assert np.abs(smooth - found).max() < 1e-2 * scale


def test_int8_activations_are_rounded_as_the_image_rounds(mlp, observations):
    torch = pytest.importorskip("torch", reason="torch is not installed (requirements-optional.txt)")
    image = quantized(mlp, bits=2, activations=8)
    found = actq.Head(image)(observations)
    with torch.no_grad():
        exact, smooth = (
            actq.FakeQuant(image, activations=rounds)(torch.from_numpy(observations)).numpy() for rounds in (True, False)
        )
    near, far = (np.abs(of - found).mean() for of in (exact, smooth))
    assert near < 1e-4 and far > 10 * near


def test_a_module_can_be_trained(mlp, observations):
    torch = pytest.importorskip("torch", reason="torch is not installed (requirements-optional.txt)")
    module = actq.FakeQuant(quantized(mlp, bits=2, activations=8))
    obs = torch.from_numpy(observations)
    with torch.no_grad():
        target = actq.FakeQuant(quantized(mlp))(obs)
    optimizer = torch.optim.Adam(module.parameters(), 3e-3)
    losses = []
    for _ in range(100):
        loss = (module(obs) - target).square().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    # Weights stay on the grid of 2 bits.
    assert losses[-1] < 0.5 * losses[0]
    with pytest.raises(ValueError, match=r"obs is \(500, 3\); \(500, 12\) is needed"):
        module(obs[:, :3])


def test_only_weights_are_trained(tmp_path):
    torch = pytest.importorskip("torch", reason="torch is not installed (requirements-optional.txt)")
    module = actq.FakeQuant(quantized(recurrent(tmp_path)))
    buffers = dict(module.named_buffers())
    assert {name.split("_")[0] for name, _ in module.named_parameters()} == {"weight", "bias", "norm"}
    assert {name.split("_")[0] for name in buffers} >= {"mean", "factor"}
    limited = actq.FakeQuant(quantized(UR3))
    assert {"low", "high"} <= set(dict(limited.named_buffers())), "an optimizer must not move limits"
    with pytest.raises(actq.Error, match="the image is of type str; pass an actq.Image"):
        actq.FakeQuant("image.actq")
    with pytest.raises(actq.Error, match="obs is of type ndarray; pass a tensor"):
        limited(np.zeros((1, limited.inputs[0][1]), np.float32))


def test_a_flow_module_has_the_chunk_of_the_file(flow, tmp_path):
    torch = pytest.importorskip("torch", reason="torch is not installed (requirements-optional.txt)")
    row = np.random.default_rng(5).normal(size=(2, flow.obs_len)).astype(np.float32)
    noise = np.random.default_rng(6).normal(size=(2, dict(flow.network()["inputs"])["noise"])).astype(np.float32)
    (chunk,) = run(flow, tmp_path, obs=row, noise=noise)
    module = actq.FakeQuant(flow, activations=False)
    with torch.no_grad():
        found = module(torch.from_numpy(row), noise=torch.from_numpy(noise)).numpy()
    assert found.shape == chunk.shape and np.abs(found - chunk).max() < 1e-4 * np.abs(chunk).max()


def test_a_network_with_a_sampler_is_a_flow(tmp_path):
    onnx = pytest.importorskip("onnx", reason="onnx is not installed")
    helper = onnx.helper
    weights = onnx.numpy_helper.from_array(np.linspace(-1, 1, 16, dtype="f4").reshape(8, 2), "w")
    nodes = [helper.make_node("Concat", ["x", "t", "obs"], ["all"], axis=1), helper.make_node("MatMul", ["all", "w"], ["v"])]
    ports = [helper.make_tensor_value_info(name, 1, [1, n]) for name, n in [("x", 2), ("t", 1), ("obs", 5), ("v", 2)]]
    graph = helper.make_graph(nodes, "flow", ports[:3], ports[3:], [weights])
    path = tmp_path / "flow.onnx"
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), path)
    flow = {"kind": "flow", "steps": 4, "time": {"from": 0, "to": 1}}
    policy = actq.import_policy(path, sampler=flow)
    assert (policy.obs_len, policy.act_len) == (5, 2)
    assert actq.import_policy(path).obs_len == 8
    for sampler, why in [({**flow, "time_input": "time"}, "none of them"), ({"kind": 1}, "kind"), ({"steps": {1}}, "sampler")]:
        with pytest.raises(actq.Error, match=why):
            actq.import_policy(path, sampler=sampler)
