#!/bin/sh
# minsnap-trajectories 0.3.0 (minimum-snap trajectories of drones): the README's call of compute_quadrotor_trajectory(), with yaw="velocity" ("Align
# yaw angle to quadrotor velocity"), gives body rates without that yaw. The attitudes turn with the flight path, by up to 2.1 rad/s here, and the
# rates that are fed forward stay as if the yaw was constant: yaw_rate keeps its default of zero, and the docstring names the two separately. With the
# yaw constant, rates and attitudes agree to 1e-3 rad/s. A controller that follows the rates turns against its own attitude reference. There is no
# error.
# Seen on 2026-11-30:  largest difference of the body rates and the attitudes' turn, yaw="velocity": 2.11 rad/s (given -0.02 to 0.02)   yaw constant:
# 0.000   yaw="velocity" with its own yaw_rate: 0.000
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps minsnap-trajectories==0.3.0 numpy==2.4.6 scipy==1.17.1
cat > run.py <<'PY'
import minsnap_trajectories as ms
import numpy as np
from scipy.spatial.transform import Rotation

# A round of 2 m, at one height.
corners = [ms.Waypoint(time, position) for time, position in zip((0, 2, 4, 6, 8), ([0, 0, 1], [2, 2, 1], [0, 4, 1], [-2, 2, 1], [0, 0, 1]))]
path = ms.generate_trajectory(corners, degree=8, idx_minimized_orders=(3, 4), num_continuous_orders=4)
times = np.linspace(0.5, 7.5, 14001)
velocity, acceleration = ms.compute_trajectory_derivatives(path, times, 3)[1:, :, :2]
rate = (velocity[:, 0] * acceleration[:, 1] - velocity[:, 1] * acceleration[:, 0]) / (velocity**2).sum(axis=1)


def compare(**options):
    """The largest difference (rad/s) about the body's z axis, and the largest rate that is given."""
    flight = ms.compute_quadrotor_trajectory(path, times, vehicle_mass=1.0, **options)
    turns = Rotation.from_quat(flight.attitude)
    real = (turns[:-1].inv() * turns[1:]).as_rotvec() / np.diff(times)[:, None]
    # The mean of both ends; where two pieces meet, the jerk is not smooth.
    given = (flight.body_rates[1:] + flight.body_rates[:-1]) / 2
    return np.abs(real - given)[:, 2].max(), np.abs(given[:, 2]).max()


seen = {"velocity": compare(yaw="velocity"), "constant": compare(yaw=0.7), "velocity and its rate": compare(yaw="velocity", yaw_rate=rate)}
print("SEEN difference and largest given rate about z (rad/s):", {name: [round(float(value), 3) for value in pair] for name, pair in seen.items()})
assert seen["velocity"][0] > 1.5 and seen["velocity"][1] < 0.1
assert seen["constant"][0] < 5e-3 and seen["velocity and its rate"][0] < 5e-3
PY
v/bin/python run.py
