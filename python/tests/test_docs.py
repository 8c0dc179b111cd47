"""The listings of docs/PYTHON.md run, in order; so does that of docs/IMPORT.md."""

import re
from importlib.util import find_spec

import numpy
import pytest

import actq
from conftest import ROOT, listings

gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed")


def shorter(listing):
    """Trains and learns for fewer steps."""
    listing = listing.replace("learn(30_000)", "learn(16_000)")
    return listing.replace("bpw=2)", "bpw=2, steps=500)").replace("bpw=1.5, ", "bpw=1.5, steps=200, ")


def test_every_listing_runs(cart_pole, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names, skipped = {}, []
    # The last one needs a controller: test_link.py runs it.
    for i, listing in enumerate(listings("PYTHON")[:-1]):
        needed = re.findall(r"(torch|stable_baselines3)\b", listing)
        missing = [name for name in set(needed) if find_spec(name) is None]
        if missing and i == 0:
            # Without them, the policy of an ONNX file stands in for the trained one.
            names.update(actq=actq, gymnasium=gymnasium, **cart_pole)
        elif missing:
            skipped.append(i)
        else:
            exec(compile(shorter(listing), f"listing {i}", "exec"), names)
    assert names["trained"].mean_return > 150
    # Not worse than the f32 policy by more than a tenth.
    assert names["driven"].mean_return > 0.9 * names["trained"].mean_return
    assert names["tuned"].rounds[-1].rollout.mean_return > 100
    assert (tmp_path / "firmware/policy.h").exists() and (tmp_path / "cart-pole.actq").exists()
    if "after" in names:
        # One epoch of training gains.
        assert names["after"].mean_return > names["before"].mean_return
    if skipped:
        pytest.skip(f"{len(skipped)} of its listings: torch is not installed (requirements-optional.txt)")


def test_a_recording_is_saved_as_documented(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (listing,) = (text for text in listings("IMPORT") if "numpy.save" in text)
    exec(compile(listing, "IMPORT", "exec"), {"numpy": numpy, "observations": [[1.0, 2.0, 3.0]] * 4, "length": 3})
    saved = numpy.load("obs.npy")
    assert saved.shape == (4, 3) and saved.dtype == numpy.float32


def test_a_head_steps_with_flat_memory(cart_pole, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "python/examples"))
    import soak

    image = actq.quantize(cart_pole["policy"], bits=8, method="rtn", progress=False)
    soak.step(image, robots=512, steps=200_000, most_growth=2 << 20)
