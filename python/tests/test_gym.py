"""Environments of Gymnasium: their contract, their bits, their vector."""

import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import AutoresetMode  # noqa: E402

import two_step  # noqa: E402
import two_step.gym  # noqa: E402

# Every shipped aircraft with a model of its own.
AIRFRAMES = sorted(file.parent.name for file in Path(__file__).parents[2].glob("aircraft/*/model.toml"))


@pytest.mark.parametrize("task", two_step.gym.TASKS)
@pytest.mark.parametrize("airframe", AIRFRAMES)
@pytest.mark.parametrize("action", ["redundant", "all"])
def test_the_checker_finds_nothing(task, airframe, action):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Numbers beyond the usual range are named by it, not forbidden.
        warnings.filterwarnings("ignore", message=".*(observation|action) space.*")
        check_env(gymnasium.make(task, airframe=airframe, action=action).unwrapped)


def test_no_action_is_the_main_controller_alone_and_jams_lose_some_of_it():
    env = gymnasium.make("TwoStep/Jam-v0")
    lost = 0
    for seed in range(12):
        observation, info = env.reset(seed=seed)
        assert "stuck" in info["fault"] and observation.shape == (18,)
        steps, ended = 0, False
        while not ended:
            *_, reward, terminated, truncated, _ = env.step(np.zeros(3, np.float32))
            steps, ended = steps + 1, terminated or truncated
            assert reward == -10 if terminated else -0.02 < reward <= 0.02
        lost += terminated
        assert terminated != truncated and steps == 1500 or terminated
    assert 0 < lost < 12


def fly_by_hand(seed, actions):
    env = gymnasium.make("TwoStep/Track-v0").unwrapped
    rows = [env.reset(seed=seed)[0]]
    for action in actions:
        observation, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            observation, _ = env.reset()
        rows.append(observation)
    return np.array(rows)


@pytest.mark.parametrize("mode", [AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP])
def test_a_vector_has_the_bits_of_single_environments_and_the_last_observations(mode):
    count, steps = 5, 1600
    actions = np.random.default_rng(1).uniform(-0.3, 0.3, (steps, count, 3))
    vector = gymnasium.make_vec("TwoStep/Track-v0", num_envs=count, autoreset_mode=mode, episode_s=10.0)
    assert vector.metadata["autoreset_mode"] == mode
    singles = [gymnasium.make("TwoStep/Track-v0", episode_s=10.0).unwrapped for _ in range(count)]
    observations, _ = vector.reset(seed=7)
    ended = [False] * count
    firsts = np.array([env.reset(seed=7 + place)[0] for place, env in enumerate(singles)])
    assert observations.tobytes() == firsts.tobytes()
    endings = 0
    for action in actions:
        observations, rewards, terminations, truncations, infos = vector.step(action)
        for place, env in enumerate(singles):
            if ended[place]:
                expected, reward, ended[place] = env.reset()[0], 0.0, False
            else:
                expected, reward, terminated, truncated, _ = env.step(action[place])
                assert (terminated, truncated) == (terminations[place], truncations[place])
                ended[place] = terminated or truncated
                endings += ended[place]
                if ended[place] and mode == AutoresetMode.SAME_STEP:
                    assert np.array_equal(infos["final_obs"][place], expected) and infos["_final_obs"][place]
                    expected, ended[place] = env.reset()[0], False
            assert np.array_equal(observations[place], expected) and rewards[place] == reward
    assert endings >= count


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_other_processes_have_the_same_bits(method):
    actions = np.random.default_rng(2).uniform(-0.2, 0.2, (50, 3))
    script = (
        "import multiprocessing, sys, numpy as np\n"
        "from test_gym import fly_by_hand\n"
        "def main():\n"
        "    actions = np.random.default_rng(2).uniform(-0.2, 0.2, (50, 3))\n"
        f"    with multiprocessing.get_context('{method}').Pool(2) as pool:\n"
        "        for rows in pool.starmap(fly_by_hand, [(3, actions), (4, actions)]):\n"
        "            print(rows.tobytes().hex())\n"
        "if __name__ == '__main__':\n"
        "    main()\n"
    )
    from pathlib import Path

    file = Path(__file__).parent
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=file)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [fly_by_hand(seed, actions).tobytes().hex() for seed in (3, 4)]


def test_an_environment_observes_what_a_compensator_is_given():
    """Before the jam, and without an action: so a trained policy flies in a campaign with the inputs of its training."""
    env = gymnasium.make("TwoStep/Jam-v0").unwrapped
    seen = [env.reset(seed=5)[0]]
    seen += [env.step(np.zeros(3))[0] for _ in range(45)]
    given = []

    def records(state):
        given.append(state.observation())
        return two_step.Compensation()

    two_step.fly("nominal", compensator=records, ftc="always", set={"plant.duration_s": 0.9})
    assert np.array(given[::10]).tobytes() == np.array(seen).tobytes()


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"action": "x"}, ValueError, "action = \"x\""),
        ({"step_ms": 3}, ValueError, "step_ms = 3; expected 1 to 1000 control periods of 2 ms"),
        ({"step_ms": float("nan")}, ValueError, "step_ms = NaN"),
        ({"episode_s": 31}, ValueError, "expected one step to 30"),
        ({"foo": 1}, TypeError, "--foo"),
        ({"airframe": "q"}, ValueError, "tvc_jet"),
        ({"render_mode": "human"}, TypeError, "render_mode"),
        ({"jams": ["flap"]}, ValueError, "jams: \"flap\"; expected some of left_aileron"),
        ({"jams": []}, ValueError, "at least one effector"),
    ],
)
def test_wrong_options_are_refused(options, error, words):
    with pytest.raises(error, match=words):
        two_step.gym.FaultEnv("jam", **options)


@pytest.mark.parametrize(
    ("action", "error"), [(np.zeros(2), ValueError), (np.full(3, np.nan), ValueError), ("x", ValueError)]
)
def test_wrong_actions_are_refused_and_the_episode_goes_on(action, error):
    env = two_step.gym.FaultEnv("jam")
    with pytest.raises(RuntimeError, match=r"reset\(\) begins one"):
        env.step(np.zeros(3))
    env.reset(seed=1)
    with pytest.raises(error):
        env.step(action)
    assert env.step(np.zeros(3))[1] > 0
