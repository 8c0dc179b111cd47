"""Sweeps over budgets, whole episodes, and objects that print and travel."""

import html
import pickle

import numpy as np
import pytest

import actq


@pytest.fixture
def parts(observations):
    return observations[:400], observations[400:]


def test_a_sweep_has_the_images_of_quantize(mlp, parts, caplog):
    policy = actq.import_policy(mlp)
    learned, heldout = parts
    budgets = [2.0, {"bits": 3}, {"flash": "8K"}]
    seen = []
    found = actq.sweep(
        policy, learned, heldout=heldout, budgets=budgets, steps=20, progress=lambda work, share: seen.append((work, share))
    )
    for point, budget in zip(found.points, [{"bpw": 2.0}, {"bits": 3}, {"flash": 8192}]):
        assert point.image == actq.quantize(policy, learned, heldout=heldout, steps=20, progress=False, **budget)
        assert point.nmse == actq.evaluate(point.image, heldout, policy).nmse
        assert point.milliseconds == point.image.cost()["milliseconds"] and point.success is None
    assert len(found.points[2].image) <= 8192
    rows = found.rows()
    assert [row["budget"] for row in rows] == ["bpw=2.0", "bits=3", "flash=8K"] and "success" not in rows[0]
    lines = str(found).splitlines()
    assert lines[0].split() == ["budget", "bytes", "bits", "per", "weight", "ms", "NMSE"] and len(lines) == 4
    assert found._repr_html_().count("<tr>") == 4
    assert any(work.startswith("bits=3: ") and 1 / 3 <= share <= 2 / 3 for work, share in seen)
    some = actq.sweep(policy, learned, heldout=heldout, budgets=[{"flash": 300}, 4.0], steps=5, progress=False)
    assert [row["budget"] for row in some.rows()] == ["bpw=4.0"] and "flash=300: " in caplog.text
    with pytest.raises(actq.Error, match="300"):
        actq.sweep(policy, learned, heldout=heldout, budgets=[{"flash": 300}], steps=5, progress=False)
    with pytest.raises(actq.Error, match="budgets is empty"):
        actq.sweep(policy, learned, heldout=heldout, budgets=[])
    with pytest.raises(TypeError, match="unexpected keyword argument 'step'"):
        actq.sweep(policy, learned, budgets=[4.0], step=5)


def test_a_sweep_holds_parts_out_by_itself(mlp, observations):
    policy = actq.import_policy(mlp)
    found = actq.sweep(policy, observations, budgets=[2.0, 4.0], steps=20, progress=False)
    errors = [point.nmse for point in found.points]
    seen = [actq.evaluate(point.image, observations, policy).nmse for point in found.points]
    assert errors[0] > seen[0] > 0 and errors[1] < errors[0], "the parts are not those that the image learned from"
    assert found.points[0].image == actq.quantize(policy, observations, bpw=2.0, steps=20, progress=False)


@pytest.mark.parametrize("core", ["m0", "m3", "rv32imac", "m55"])
def test_a_sweep_has_the_times_of_its_core(mlp, parts, core):
    policy = actq.import_policy(mlp)
    options = {"heldout": parts[1], "steps": 5, "progress": False}
    found = actq.sweep(policy, parts[0], budgets=[2.0, {"bits": 8, "clock": 1e8}], core=core, **options)
    expected = [point.image.cost(clock=clock, core=core) for point, clock in zip(found.points, [168e6, 1e8])]
    assert [point.milliseconds for point in found.points] == [cost["milliseconds"] for cost in expected]


def test_a_sweep_draws_error_and_success(mlp, parts):
    pytest.importorskip("matplotlib", reason="matplotlib is not installed (requirements-optional.txt)")
    driven = iter([0.5, 1.0])
    found = actq.sweep(
        actq.import_policy(mlp), parts[0], heldout=parts[1], budgets=[2.0, 4.0], steps=5, progress=False,
        drive=lambda image: actq.Rollout((np.zeros((1, 12), np.float32), np.ones(1, bool)), [], next(driven)),
    )  # fmt: skip
    axes = found.plot().axes
    assert [ax.get_ylabel() for ax in axes[::2]] == ["held-out NMSE", "success"]
    for ax, value in [(axes[0], lambda point: point.nmse), (axes[2], lambda point: point.success)]:
        line = ax.lines[0]
        expected = sorted((len(point.image), value(point)) for point in found.points)
        assert list(zip(line.get_xdata(), line.get_ydata())) == expected


def test_sizes_are_texts_too(mlp, parts):
    policy = actq.import_policy(mlp)
    make = lambda flash: actq.quantize(policy, parts[0], flash=flash, steps=5, progress=False)  # noqa: E731
    assert make("8K") == make(8192)
    with pytest.raises(actq.Error, match="flash: "):
        make("much")


def test_reports_print_as_they_are(mlp):
    report = actq.quantize(actq.import_policy(mlp), bits=8, method="rtn", progress=False).inspect()
    assert repr(report) == str(report) and report.startswith("policy ")
    assert report._repr_html_() == f"<pre>{html.escape(report)}</pre>"


def test_a_policy_is_pickled_with_its_files(mlp):
    policy = actq.import_policy(mlp)
    loaded = pickle.loads(pickle.dumps(policy))
    assert (loaded.digest, repr(loaded)) == (policy.digest, repr(policy))
    make = lambda policy: actq.quantize(policy, bits=4, method="rtn", progress=False)  # noqa: E731
    assert make(loaded) == make(policy)
