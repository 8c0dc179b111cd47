#!/bin/sh
# filterpy 2.0.0, pykalman 0.11.2, simdkalman 1.0.4: one model, one prior and the same measurements give other estimates. filterpy's batch_filter takes the prior for the time before the first measurement and predicts first;
# pykalman and simdkalman take it for the time of that measurement and update first. filterpy does so with update_first=True. A measurement that is missing, as NaN, is skipped by simdkalman; in filterpy and pykalman all
# estimates from there on are NaN. pykalman skips it only in a masked array, filterpy only as None. There is no error in any of these.
# Seen on 2026-11-30:  first positions: filterpy 0.1000, 0.2266   pykalman, simdkalman, filterpy with update_first 0.0909, 0.2220   after a NaN: simdkalman 0.2964, pykalman and filterpy NaN, pykalman masked 0.2964
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q filterpy==2.0.0 pykalman==0.11.2 simdkalman==1.0.4 numpy==2.4.6 scipy==1.17.1
v/bin/python -W ignore - <<'PY'
import filterpy.kalman, pykalman, simdkalman
import numpy as np

F, H, Q, R = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[1.0, 0.0]]), np.diag([0.01, 0.1]), np.array([[0.1]])
mean, covariance = np.array([0.0, 1.0]), np.eye(2)


def with_filterpy(measured, **options):
    kf = filterpy.kalman.KalmanFilter(2, 1)
    kf.F, kf.H, kf.Q, kf.R, kf.P, kf.x = F, H, Q, R, covariance.copy(), mean[:, None].copy()
    return kf.batch_filter(list(measured), **options)[0][:, 0, 0]


def with_pykalman(measured):
    kf = pykalman.KalmanFilter(F, H, Q, R, initial_state_mean=mean, initial_state_covariance=covariance)
    return kf.filter(measured[:, None])[0][:, 0]


def with_simdkalman(measured):
    kf = simdkalman.KalmanFilter(F, Q, H, R)
    options = dict(initial_value=mean, initial_covariance=covariance, filtered=True, smoothed=False)
    return kf.compute(measured[None], 0, **options).filtered.states.mean[0][:, 0]


z = np.array([0.1, 0.25, 0.3, 0.45])
gap = np.where([False, True, False, False], np.nan, z)
seen = {
    "filterpy": with_filterpy(z),
    "filterpy, update_first": with_filterpy(z, update_first=True),
    "pykalman": with_pykalman(z),
    "simdkalman": with_simdkalman(z),
    "filterpy, NaN": with_filterpy(gap, update_first=True),
    "filterpy, None": with_filterpy([0.1, None, 0.3, 0.45], update_first=True),
    "pykalman, NaN": with_pykalman(gap),
    "pykalman, masked": with_pykalman(np.ma.masked_invalid(gap)),
    "simdkalman, NaN": with_simdkalman(gap),
}
for name, positions in seen.items():
    print(f"SEEN {name}: {np.asarray(positions).round(4).tolist()}")
assert np.allclose(seen["filterpy"][:2], [0.1, 0.2266], atol=1e-4)
for name in ("filterpy, update_first", "pykalman", "simdkalman"):
    assert np.allclose(seen[name][:2], [0.0909, 0.2220], atol=1e-4)
for name in ("filterpy, None", "pykalman, masked", "simdkalman, NaN"):
    assert np.allclose(seen[name][2], 0.2964, atol=1e-4)
for name in ("filterpy, NaN", "pykalman, NaN"):
    assert np.isnan(seen[name][1:]).all()
PY
