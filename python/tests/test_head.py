"""Actions are those of `actq serve`, bit for bit."""

import copy
import os
import pickle
import subprocess
import sys
import threading

import numpy as np
import pytest

import actq
from conftest import UR3
from test_export import quantized, recurrent, written


def served(command, path, observations):
    given = b"".join(b"S" + row.tobytes() for row in observations)
    out = command("serve", path, given=b"R" + given)
    return np.frombuffer(out, dtype="<f4").reshape(len(observations), -1)


@pytest.fixture(scope="module", params=["step", "flow"])
def image(request, flow):
    return flow if request.param == "flow" else actq.quantize(actq.import_policy(UR3), bits=3, method="rtn")


@pytest.fixture(scope="module")
def rows(image):
    return np.random.default_rng(3).normal(size=(40, image.obs_len)).astype(np.float32)


def test_one_robot_has_the_bits_of_serve(command, image, rows, tmp_path):
    image.save(tmp_path / "i.actq")
    head = actq.Head(image)
    actions = np.stack([head(row) for row in rows])
    assert actions.dtype == np.float32
    assert actions.tobytes() == served(command, tmp_path / "i.actq", rows).tobytes()


def test_robots_are_independent(image, rows):
    batch = rows.reshape(4, 10, -1)
    alone = [actq.Head(image, seed=robot) for robot in range(4)]
    together = actq.Head(image, 4)
    for step in range(10):
        mask = np.array([step == 5, False, step == 7, False])
        found = together(batch[:, step], mask)
        expected = [head(row, [reset]) for head, row, reset in zip(alone, batch[:, step], mask)]
        assert found.tobytes() == np.stack(expected).tobytes()
    assert found.shape == (4, image.act_len) and together.n == 4


def test_reset_begins_again(image, rows):
    head = actq.Head(image)
    first = [head(row) for row in rows[:5]]
    head.reset()
    assert np.array_equal(first, [head(row) for row in rows[:5]])


def test_seeds_of_a_flow_policy_differ(flow):
    row = np.zeros(flow.obs_len, dtype=np.float32)
    assert np.array_equal(actq.Head(flow, seed=1)(row), actq.Head(flow, seed=1)(row))
    assert not np.array_equal(actq.Head(flow, seed=1)(row), actq.Head(flow, seed=2)(row))


def test_observations_of_other_types_and_layouts(image, rows):
    expected = actq.Head(image)(rows[:4]).tobytes()
    for form in (rows[:4].astype(np.float64), np.asfortranarray(rows[:4]), rows[:4].tolist(), rows[:8][::2][:4]):
        same = np.asarray(form, dtype=np.float32)
        assert actq.Head(image)(form).tobytes() == actq.Head(image)(np.ascontiguousarray(same)).tobytes()
    assert actq.Head(image)(rows[:4].astype(np.float64)).tobytes() == expected


def test_wrong_shapes_and_values_are_named(image, rows):
    head, n = actq.Head(image, 4), image.obs_len
    with pytest.raises(actq.Error, match=rf"the observations have the shape \[4, 3\]; use \[{n}\] for one, or \[n, {n}\]"):
        head(np.zeros((4, 3)))
    with pytest.raises(actq.Error, match="2 observations for a head of 4 states; make another head"):
        head(rows[:2])
    with pytest.raises(actq.Error, match="reset has 3 values for 4 observations"):
        head(rows[:4], [True, False, True])
    bad, before = rows[:4].copy(), actq.Head(image, 4)
    bad[2, 1] = np.nan
    with pytest.raises(actq.Error, match=r"^head 2: [^:]*$"):
        head(bad, [True] * 4)
    # Nothing has changed.
    assert head(rows[:4]).tobytes() == before(rows[:4]).tobytes()
    with pytest.raises(actq.Error, match="a batch has at least one head"):
        actq.Head(image, 0)
    for mask, of in (([1, 0, 0, 2], "int64"), (["False"] * 4, "<U5"), ([None] * 4, "object")):
        with pytest.raises(actq.Error, match=rf"reset is of type {of}; pass bool \[4\]"):
            head(rows[:4], mask)
    for mask in (True, np.zeros((2, 2), dtype=bool)):
        with pytest.raises(actq.Error, match=r"reset has the shape .* for 4 observations; pass bool \[4\]"):
            head(rows[:4], mask)
    # Observations that fail do not decide the number of states.
    first = actq.Head(image)
    with pytest.raises(actq.Error):
        first(bad)
    assert first.n is None and first(rows[0]).shape == (image.act_len,) and first.n == 1


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system does not fork")
def test_a_forked_process_does_not_wait_for_threads(image):
    script = f"""
import actq, os, signal, sys
image = actq.Image({image.bytes!r})
actq.Head(image)([0.0] * image.obs_len)
child = os.fork()
if child == 0:
    signal.alarm(60)
    try:
        actq.Head(image)([0.0] * image.obs_len)
    except actq.Error as error:
        os._exit(7 if "start worker processes by spawn" in str(error) else 8)
    os._exit(9)
actq.Head(image)([0.0] * image.obs_len)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    assert subprocess.run([sys.executable, "-"], input=script, text=True).returncode == 7


def test_other_threads_run_during_a_step(image):
    rows = np.zeros((4000, image.obs_len), dtype=np.float32)
    head, counted, stop = actq.Head(image, len(rows)), [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1

    head(rows)
    thread = threading.Thread(target=count)
    thread.start()
    during = 0
    for _ in range(100):
        # A busy machine may give the other thread no core during one step.
        before = counted[0]
        head(rows)
        during = max(during, counted[0] - before)
        if during > 1000:
            break
    stop.set()
    thread.join()
    assert during > 1000


@pytest.mark.parametrize("kind", ["mlp", "recurrent", "flow"])
def test_restored_states_go_on_with_the_same_bits(kind, mlp, flow, tmp_path):
    if kind == "recurrent":
        (tmp_path / "policy").mkdir()
    sources = {"mlp": lambda: quantized(mlp), "recurrent": lambda: quantized(recurrent(tmp_path / "policy")), "flow": lambda: flow}
    image = sources[kind]()
    rows = np.random.default_rng(3).normal(size=(12, 5, image.obs_len)).astype(np.float32)
    head = actq.Head(image, seed=7)
    for row in rows[:4]:
        head(row)
    states, copied, loaded = head.state(), copy.deepcopy(head), pickle.loads(pickle.dumps(head))
    assert states.dtype == np.uint8 and states.shape[0] == 5
    later = [head(row).tobytes() for row in rows[4:]]
    head.reset()
    head.restore(states)
    restored = actq.Head(image)
    restored.restore(states)
    for other in (copied, loaded, head, restored):
        assert other.n == 5 and other.image == image
        assert [other(row).tobytes() for row in rows[4:]] == later
    # A robot's state in another order, and several times.
    many = actq.Head(image, 3)
    many.restore(states[[2, 2, 0]])
    first = many(rows[4][[2, 2, 0]])
    assert first.tobytes() == np.frombuffer(later[0], np.float32).reshape(5, -1)[[2, 2, 0]].tobytes()


def test_a_head_before_its_first_step_is_copied(image):
    rows = np.random.default_rng(3).normal(size=(4, image.obs_len)).astype(np.float32)
    head = actq.Head(image, seed=3)
    loaded = pickle.loads(pickle.dumps(head))
    assert loaded.n is None and loaded(rows).tobytes() == head(rows).tobytes()
    with pytest.raises(actq.Error, match="the head has no states yet; step it, or make it by actq.Head"):
        actq.Head(image).state()


def test_states_that_do_not_fit_change_nothing(image, mlp):
    rows = np.random.default_rng(3).normal(size=(4, image.obs_len)).astype(np.float32)
    head, other = actq.Head(image), actq.Head(quantized(mlp, bits=2), 4)
    head(rows)
    states = head.state()
    damaged = states.copy()
    damaged[3, -1] ^= 1
    for given, text in [
        (damaged, "state 3: saved state is damaged"),
        (states[:3], "3 states for a head of 4"),
        (states[0], r"the states have the shape \[\d+\]; pass the array \[n, bytes\] of Head.state"),
        (states[:0], r"the states have the shape \[0, \d+\]"),
        (states.astype(float), "the states are of type float64"),
        (states[:, :-1], "a state has .* bytes, and one of this image"),
        ("x", "the states are of type <U1"),
    ]:
        with pytest.raises(actq.Error, match=text):
            head.restore(given)
        assert head.state().tobytes() == states.tobytes()
    empty = actq.Head(image)
    with pytest.raises(actq.Error, match="state 3: saved state is damaged"):
        empty.restore(damaged)
    assert empty.n is None
    with pytest.raises(actq.Error, match="state 0: saved state belongs to another image"):
        actq.Head(quantized(mlp, bits=3), 4).restore(other.state())


def test_robots_have_their_own_prefix_until_the_next(tmp_path):
    attention = {"op": "attention", "heads": 2, "kv_heads": 1, "dim": 4, "prefix": 5}
    ops = [{"op": "linear", "w": "q"}, attention, {"op": "linear", "w": "o"}]
    policy = {"name": "prefixed", "obs_dim": 3, "act_dim": 2, "ops": ops}
    image = quantized(written(tmp_path, policy, {"q": (8, 3), "o": (2, 8)}))
    assert "prefix        at most 5 tokens of 1 head of 4, from a host" in str(image.inspect())
    random = np.random.default_rng(7)
    rows, keys, values = (random.normal(size=shape).astype(np.float32) for shape in [(3, 3), (3, 2, 1, 4), (3, 2, 1, 4)])
    head = actq.Head(image)
    with pytest.raises(actq.Error, match="prefix"):
        head(rows)
    head.set_prefix([(keys, values)])
    first = head(rows)
    assert head.n == 3 and len(np.unique(first[:, 0])) == 3
    head.reset()
    assert np.array_equal(head(rows), first) and np.array_equal(copy.deepcopy(head)(rows), first)
    # Alone, with arrays that have no axis of robots.
    for robot in range(3):
        alone = actq.Head(image)
        alone.set_prefix([(keys[robot].tolist(), values[robot])])
        assert np.array_equal(alone(rows[robot]), first[robot])
    wrong = [
        ([], "0 caches"),
        ([(keys[..., :3], values)], r"keys of cache 0 have the shape \[3, 2, 1, 3\]"),
        ([(keys[:2], values[:2])], "2 robots for a head of 3"),
        ([(np.zeros((6, 1, 4)), np.zeros((6, 1, 4)))], "more tokens"),
        ([(keys, np.full_like(values, np.nan))], "not finite"),
        ([(keys, values[:, :1])], "cache 0"),
    ]
    for caches, message in wrong:
        with pytest.raises(actq.Error, match=message):
            head.set_prefix(caches)
    assert np.array_equal(head(rows), first)
    head.clear_prefix()
    with pytest.raises(actq.Error, match="none was set"):
        head(rows)
    head.set_prefix([(keys, values)])
    assert np.array_equal(head(rows), first)
    with pytest.raises(actq.Error, match="reads no prefix"):
        actq.Head(quantized(recurrent(tmp_path))).set_prefix([(keys, values)])


def test_inputs_of_a_file_are_a_prefix(tmp_path):
    onnx = pytest.importorskip("onnx", reason="onnx is not installed")
    random = np.random.default_rng(8)
    shapes = {"wq": (6, 8), "wk": (6, 8), "wv": (6, 8), "wo": (24, 2)}
    weights = {name: random.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}
    weights["shape"] = np.array([1, 3, 2, 4], np.int64)
    lines = []
    for name in "qkv":
        lines += [("MatMul", ["obs", f"w{name}"], f"{name}0"), ("Reshape", [f"{name}0", "shape"], f"{name}1")]
        lines += [("Transpose", [f"{name}1"], name, {"perm": [0, 2, 1, 3]})]
    lines += [("Concat", ["past_k", "k"], "keys", {"axis": 2}), ("Concat", ["past_v", "v"], "values", {"axis": 2})]
    lines += [("Transpose", ["keys"], "across", {"perm": [0, 1, 3, 2]}), ("MatMul", ["q", "across"], "scores")]
    lines += [("Softmax", ["scores"], "shares", {"axis": -1}), ("MatMul", ["shares", "values"], "heads")]
    lines += [("Transpose", ["heads"], "tokens", {"perm": [0, 2, 1, 3]}), ("Flatten", ["tokens"], "flat")]
    lines += [("MatMul", ["flat", "wo"], "action")]
    nodes = [onnx.helper.make_node(op, inputs, [to], **dict(*rest)) for op, inputs, to, *rest in lines]
    shapes = {"obs": [1, 3, 6], "past_k": [1, 2, 5, 4], "past_v": [1, 2, 5, 4], "action": [1, 2]}
    *inputs, output = [onnx.helper.make_tensor_value_info(name, 1, shape) for name, shape in shapes.items()]
    constants = [onnx.numpy_helper.from_array(values, name) for name, values in weights.items()]
    model = onnx.helper.make_model(
        onnx.helper.make_graph(nodes, "expert", inputs, [output], constants),
        opset_imports=[onnx.helper.make_opsetid("", 17)],
        ir_version=8,
    )
    onnx.save(model, tmp_path / "expert.onnx")
    policy = actq.import_policy(tmp_path / "expert.onnx", prefix=["past_k", "past_v"], low=-100, high=100, rate_hz=50)
    head = actq.Head(actq.quantize(policy, bits=8, activations=16, method="rtn", progress=False))
    obs, past_k, past_v = (random.normal(size=shapes[name]).astype(np.float32) for name in ["obs", "past_k", "past_v"])
    head.set_prefix([(past_k[0].swapaxes(0, 1), past_v[0].swapaxes(0, 1))])
    q, k, v = ((obs[0] @ weights[f"w{name}"]).reshape(3, 2, 4).swapaxes(0, 1) for name in "qkv")
    keys, values = np.concatenate([past_k[0], k], axis=1), np.concatenate([past_v[0], v], axis=1)
    scores = np.exp(q @ keys.swapaxes(1, 2))
    flat = (scores / scores.sum(axis=-1, keepdims=True) @ values).swapaxes(0, 1).reshape(-1)
    expected = flat @ weights["wo"]
    assert np.abs(head(obs.reshape(-1)) - expected).max() < 0.1 * np.abs(expected).max()
    with pytest.raises(actq.Error, match=r'prefix=\["force:1"\]: the file has no input of this name'):
        actq.import_policy(tmp_path / "expert.onnx", prefix=["force:1"])
