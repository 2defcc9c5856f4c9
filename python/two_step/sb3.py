"""The vector environment for Stable-Baselines3, which has a contract of its own for them.

>>> from stable_baselines3 import PPO
>>> model = PPO("MlpPolicy", two_step.sb3.make_vec("TwoStep/Jam-v0", 64))

It steps all flights on all cores. The single environments also work with ``stable_baselines3.common.env_util.make_vec_env``.
"""

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecEnv

import two_step.gym  # noqa: F401, which makes the environments known


class FaultVecEnv(VecEnv):
    def __init__(self, envs):
        self._envs, self._actions, self._seed = envs, None, None
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self):
        observations, _ = self._envs.reset(seed=self._seed)
        self._seed = None
        return observations

    def step_async(self, actions):
        self._actions = actions

    def step_wait(self):
        observations, rewards, terminated, truncated, infos = self._envs.step(self._actions)
        ended = terminated | truncated
        details = [{"TimeLimit.truncated": bool(one)} for one in truncated & ~terminated]
        for place in np.flatnonzero(ended):
            details[place]["terminal_observation"] = infos["final_obs"][place]
        return observations, rewards.astype(np.float32), ended, details

    def seed(self, seed=None):
        self._seed = seed
        return [None if seed is None else seed + place for place in range(self.num_envs)]

    def close(self):
        self._envs.close()

    def get_attr(self, attr_name, indices=None):
        return [getattr(self._envs, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name, value, indices=None):
        raise AttributeError(f"{attr_name}: the flights of this vector have no attributes of their own")

    def env_method(self, method_name, *args, indices=None, **kwargs):
        raise AttributeError(f"{method_name}: the flights of this vector have no methods of their own")

    def env_is_wrapped(self, wrapper_class, indices=None):
        return [False] * len(list(self._get_indices(indices)))


def make_vec(name, num_envs, **options):
    """As ``gymnasium.make_vec``, for Stable-Baselines3."""
    envs = gymnasium.make_vec(name, num_envs=num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **options)
    return FaultVecEnv(envs)
