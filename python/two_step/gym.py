"""Environments of Gymnasium whose episodes have faults.

``TwoStep/Jam-v0``: level flight in which a surface jams 1 to 3 s after the start, at an angle of its travel.
``TwoStep/Track-v0``: a roll angle (up to 0.5 rad) and an altitude (up to 100 m from the start) to follow, other ones every
8 s; in half of the episodes a surface jams too.

>>> import gymnasium, two_step.gym
>>> env = gymnasium.make("TwoStep/Jam-v0", airframe="tvc_jet", action="redundant")
>>> observation, info = env.reset(seed=1)
>>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

Options of both, also of ``gymnasium.make_vec``: ``scenario="nominal"``, those of :func:`two_step.fly` (``airframe=``,
``law=`` by name, ``set=``, ...), and

action: "redundant" is beside the main controller (``law``, by default the paper's PID): aileron, nozzle pitch and nozzle yaw,
    each from -1 to 1 of its travel; of an aircraft without a nozzle an increment of each surface. No action (zeros) is the main
    controller alone. "all" is every effector in the place of the autopilot: 0 is a surface's neutral position, -1 and 1 the
    ends of its travel, and of an engine its least and largest thrust. ``action_names`` names the parts, ``action_travel`` has
    what 1 is, rad or N.
jams: names of the effectors of which one jams; by default all surfaces.
step_ms: time of a step, whole control periods; 20 ms.
episode_s: truncation, at most 30 s.

Observations are what a law may know: measured or estimated states, errors of the references, the observer's fault acceleration
and the main controller's commands, ``observation_names``, each divided by ``observation_scales``. The reward is, per second,
``1 - 0.5 min(1, (roll error / 0.5 rad)²) - 0.3 min(1, (altitude error / 100 m)²) - 0.2 min(1, |body rates|² / (0.5 rad/s)²)``;
the loss of the aircraft (a limit of its airframe file, or the ground) terminates the episode and gives -10.
``info["fault"]`` after a reset says what will jam; no law knows it.

An episode is a function of the seed and of the number of resets since: the same bits in one process, in many, in a vector.
"""

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from two_step._native import Episodes

TASKS = {"TwoStep/Jam-v0": "jam", "TwoStep/Track-v0": "track"}


def register():
    """Make the environments known to Gymnasium; importing this module, or Gymnasium where the package is installed, does it."""
    for name, task in TASKS.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point="two_step.gym:FaultEnv",
                vector_entry_point="two_step.gym:FaultVectorEnv",
                kwargs={"task": task},
            )


class _Spaces:
    def _begin(
        self, count, task, scenario, render_mode, *, action="redundant", jams=None, step_ms=20.0, episode_s=30.0, **options
    ):
        if render_mode is not None:
            # The error after which Stable-Baselines3 tries again without it.
            raise TypeError(f"render_mode = {render_mode!r}; expected None")
        self._episodes = Episodes(
            task, scenario, count, action=action, jams=jams, step_ms=step_ms, episode_s=episode_s, **options
        )
        self.action_names = self._episodes.action_names
        self.action_travel = self._episodes.action_travel
        self.observation_names = [name for name, _ in self._episodes.observations]
        self.observation_scales = np.array([scale for _, scale in self._episodes.observations])
        observed = (len(self.observation_names),)
        # Numbers beyond 100 times their scale are cut.
        return Box(-100.0, 100.0, observed, np.float32), Box(-1.0, 1.0, (len(self.action_names),), np.float32)


class FaultEnv(gymnasium.Env, _Spaces):
    """One flight; see the module."""

    metadata = {"render_modes": []}

    def __init__(
        self, task, scenario="nominal", *, render_mode=None, **options
    ):
        spaces = self._begin(1, task, scenario, render_mode, **options)
        self.observation_space, self.action_space = spaces
        self._begun = False

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        if seed is None and not self._begun:
            seed = int(self.np_random.integers(2**62))
        self._begun = True
        observations = self._episodes.reset([seed])
        return observations[0], {"fault": self._episodes.fault(0)}

    def step(self, action):
        actions = np.asarray(action, dtype=np.float64)[np.newaxis]
        observations, rewards, terminated, truncated, _ = self._episodes.step(actions, None)
        return observations[0], float(rewards[0]), bool(terminated[0]), bool(truncated[0]), {}


class FaultVectorEnv(VectorEnv, _Spaces):
    """Flights side by side, stepped together on all cores; see the module.

    autoreset_mode: ``AutoresetMode.SAME_STEP`` begins the next episode in the step that ends one, with the last observation in
        ``infos["final_obs"]``; ``AutoresetMode.NEXT_STEP`` begins it in the next step, whose action and reward do not count.
    """

    def __init__(
        self,
        num_envs=1,
        task="jam",
        scenario="nominal",
        *,
        autoreset_mode=AutoresetMode.NEXT_STEP,
        render_mode=None,
        **options,
    ):
        autoreset_mode = AutoresetMode(autoreset_mode)
        if autoreset_mode == AutoresetMode.DISABLED:
            raise ValueError(f"autoreset_mode = {autoreset_mode}; expected NEXT_STEP or SAME_STEP")
        self.metadata = {"render_modes": [], "autoreset_mode": autoreset_mode}
        self.num_envs, self.render_mode = num_envs, None
        spaces = self._begin(num_envs, task, scenario, render_mode, **options)
        self.single_observation_space, self.single_action_space = spaces
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._autoreset = "same" if autoreset_mode == AutoresetMode.SAME_STEP else "next"
        self._begun = False

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed if isinstance(seed, int) else None)
        if seed is None and not self._begun:
            seed = int(self.np_random.integers(2**62))
        self._begun = True
        if seed is None or isinstance(seed, int):
            seeds = [None if seed is None else seed + place for place in range(self.num_envs)]
        else:
            seeds = list(seed)
        return self._episodes.reset(seeds), {}

    def step(self, actions):
        actions = np.asarray(actions, dtype=np.float64)
        observations, rewards, terminated, truncated, last = self._episodes.step(actions, self._autoreset)
        infos = {}
        if last is not None:
            ended = terminated | truncated
            final = np.full(self.num_envs, None, dtype=object)
            for place in np.flatnonzero(ended):
                final[place] = last[place]
            infos = {"final_obs": final, "_final_obs": ended, "final_info": {}, "_final_info": ended}
        return observations, rewards, terminated, truncated, infos


register()
