"""gym-aloha's transfer of a cube with what the simulation knows as observation, without its pictures."""

import numpy as np
from gym_aloha.env import AlohaEnv
from gym_aloha.tasks.sim import TransferCubeTask

# Joints of both arms; steps of an episode, 50 a second; and the reward when the left arm has the cube.
ACTIONS, STEPS, DONE = 14, 300, 4


class Task:
    """An episode: frames of 14 joints and the cube's pose (7), targets of 14 joints."""

    def __init__(self):
        # Its own observation needs a screen, and its `state` is not implemented.
        TransferCubeTask.get_observation = lambda task, physics: np.concatenate(
            [task.get_qpos(physics), task.get_env_state(physics)]
        )
        AlohaEnv._format_raw_obs = lambda env, raw: raw
        self.env = AlohaEnv("transfer_cube")
        self.model = self.env._env.physics.model.ptr

    def reset(self, seed):
        return self.env.reset(seed=seed)[0]

    def step(self, action):
        """Returns the frame after the action, and the reward."""
        return self.env.step(action)[:2]
