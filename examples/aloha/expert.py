"""An expert for gym-aloha's transfer of a cube: the right arm lifts it, and hands it to the left arm.

Usage: python expert.py FIRST_SEED EPISODES DEMONSTRATIONS.npz
"""

import sys

import mujoco
import numpy as np
from task import DONE, STEPS, Task

# From the wrist's body to where the fingers grip, in metres: half of the cube is left for the other arm.
TIP = 0.148
OPEN, CLOSED = 1.0, 0.0
# Deviation of the noise on targets, in radians, and the joints that get it: not the grippers.
NOISE, JOINTS = 0.015, np.array([1, 1, 1, 1, 1, 1, 0] * 2)


def turn(*turns):
    """Returns the product of turns, each an axis and degrees, as a quaternion."""
    whole = np.array([1.0, 0, 0, 0])
    for axis, degrees in turns:
        part = np.zeros(4)
        mujoco.mju_axisAngle2Quat(part, np.eye(3)["xyz".index(axis)], np.radians(degrees))
        mujoco.mju_mulQuat(whole, whole.copy(), part)
    return whole


DOWN = turn(("z", 180), ("y", 60))
RIGHT, LEFT = turn(("z", 180)), turn(("x", 90))


class Arm:
    """Inverse kinematics of one arm."""

    def __init__(self, model, side):
        self.model, self.data = model, mujoco.MjData(model)
        self.body = model.body(f"vx300s_{side}/gripper_link").id
        self.joints = slice(0, 6) if side == "left" else slice(8, 14)

    def tip(self, angles):
        """Returns position and orientation of the grip."""
        self.data.qpos[self.joints] = angles
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        rotation = self.data.xmat[self.body].reshape(3, 3)
        return self.data.xpos[self.body] + TIP * rotation[:, 0], self.data.xquat[self.body].copy()

    def angles(self, near, position, orientation):
        """Returns the six angles of a pose of the grip, by damped least squares."""
        angles, jacobian = near.copy(), np.zeros((6, self.model.nv))
        for _ in range(30):
            tip, attitude = self.tip(angles)
            inverse, error, turned = np.zeros(4), np.zeros(4), np.zeros(3)
            mujoco.mju_negQuat(inverse, attitude)
            mujoco.mju_mulQuat(error, orientation, inverse)
            mujoco.mju_quat2Vel(turned, error, 1.0)
            wanted = np.concatenate([position - tip, turned])
            if np.abs(wanted).max() < 1e-4:
                break
            mujoco.mj_jac(self.model, self.data, jacobian[:3], jacobian[3:], tip, self.body)
            part = jacobian[:, self.joints]
            angles += part.T @ np.linalg.solve(part @ part.T + 1e-4 * np.eye(6), wanted)
        return angles


def mix(a, b, share):
    """Returns a quaternion between two."""
    b = b if a @ b >= 0 else -b
    whole = a + share * (b - a)
    return whole / np.linalg.norm(whole)


def plan(arms, frame):
    """Yields the actions of an episode that begins with `frame`."""
    cube = frame[14:17] * [1, 1, 0] + [0, 0, 0.02]
    meeting = np.array([0.02, 0.5, 0.25])
    start = [arms[0].tip(frame[:6]), arms[1].tip(frame[7:13])]
    # Steps, then of each arm position and orientation of its grip, and its gripper.
    right = [
        (0, *start[1], OPEN),
        (60, cube + [0, 0, 0.08], DOWN, OPEN),
        (90, cube, DOWN, OPEN),
        (105, cube, DOWN, CLOSED),
        (180, meeting, RIGHT, CLOSED),
        (250, meeting, RIGHT, CLOSED),
        (265, meeting, RIGHT, OPEN),
        (300, meeting + [0.1, 0, 0], RIGHT, OPEN),
    ]
    left = [
        (0, *start[0], OPEN),
        (130, meeting - [0.12, 0, 0], LEFT, OPEN),
        (190, meeting - [0.12, 0, 0], LEFT, OPEN),
        (230, meeting, LEFT, OPEN),
        (245, meeting, LEFT, CLOSED),
        (300, meeting, LEFT, CLOSED),
    ]
    angles = [frame[:6].copy(), frame[7:13].copy()]
    for step in range(1, STEPS):
        action = []
        for i, way in enumerate([left, right]):
            after = next((n for n, point in enumerate(way) if point[0] >= step), len(way) - 1)
            (t0, p0, q0, g0), (t1, p1, q1, g1) = way[after - 1], way[after]
            share = min((step - t0) / (t1 - t0), 1)
            angles[i] = arms[i].angles(angles[i], p0 + share * (p1 - p0), mix(q0, q1, share))
            action += [*angles[i], g0 + share * (g1 - g0)]
        yield np.array(action)


def main():
    first, count, out = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
    task, random = Task(), np.random.default_rng(0)
    arms = [Arm(task.model, side) for side in ("left", "right")]
    episodes = []
    for seed in range(first, first + count):
        frame, episode, is_done = task.reset(seed), [], False
        for step, action in enumerate(plan(arms, frame)):
            episode.append((frame, action))
            # The policy learns to come back from where this takes the arms.
            if step % 8 == 0:
                noise = NOISE * random.normal(size=14) * JOINTS
            frame, reward = task.step(action + noise)
            is_done |= reward == DONE
        if is_done:
            episodes.append(episode)
    print(f"the expert succeeds in {len(episodes)} of {count} episodes")
    frames, targets = (np.float32([[pair[i] for pair in episode] for episode in episodes]) for i in (0, 1))
    # Without the name `action`: that would be the network's own output.
    np.savez(out, obs=frames, target=targets)


if __name__ == "__main__":
    main()
