"""Trains a compensator by reinforcement learning, and flies it beside the paper's in a campaign.

    pip install two-step[gymnasium] stable-baselines3
    python examples/train_law.py --steps 100000 --out out

PPO learns commands of ailerons and nozzle beside the paper's PID. Afterwards 200 jams that it has not seen are flown with it
and with the PID alone; the table has the fraction lost with its 95 % interval (Wilson). The exit status is 0 where the lower
bound of what the law keeps is above the upper bound of what the PID alone keeps.
"""

import argparse
import math
import sys
from pathlib import Path

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

import two_step
from two_step import sb3

#: What jams: the surfaces of the paper's first case, which the PID alone often loses.
JAMS = ["left_elevator", "right_elevator"]
#: An action is held for this time: 20 ms would be five times as many steps for the same flights.
STEP_MS = 100.0
#: Seeds of the jams that are kept back; training draws its own ones from other seeds.
HELD_OUT = range(1_000_000, 1_000_200)


def train(steps, seed):
    torch.set_num_threads(1)
    # Most losses come within seconds of the jam, so short episodes have more of them.
    envs = VecMonitor(sb3.make_vec("TwoStep/Jam-v0", 16, jams=JAMS, step_ms=STEP_MS, episode_s=10.0))
    model = PPO(
        "MlpPolicy",
        envs,
        n_steps=128,
        batch_size=512,
        gamma=0.97,
        learning_rate=1e-3,
        # Small actions at first: noise of the whole travel would lose every flight.
        policy_kwargs={"net_arch": {"pi": [], "vf": [32]}, "log_std_init": -2.0},
        seed=seed,
        device="cpu",
        verbose=1,
    )
    return model.learn(steps)


class Policy:
    """The mean action of a trained model, as numpy computes it: a law has no torch."""

    def __init__(self, model):
        layers = [*model.policy.mlp_extractor.policy_net, model.policy.action_net]
        self._layers = [
            (layer.weight.detach().numpy(), layer.bias.detach().numpy()) for layer in layers if hasattr(layer, "weight")
        ]

    def __call__(self, observations):
        for weight, bias in self._layers[:-1]:
            observations = np.tanh(observations @ weight.T + bias)
        weight, bias = self._layers[-1]
        return np.clip(observations @ weight.T + bias, -1.0, 1.0)


def compensator(policy, travel_rad):
    """A class whose instances are the policy as a compensator: it holds each action for a step of its training."""

    class Learned:
        def __init__(self):
            self.next_s, self.held = 0.0, two_step.Compensation()

        def __call__(self, state):
            if state.time_s >= self.next_s - 1e-9:
                self.next_s += STEP_MS / 1000.0
                self.held = two_step.Compensation(*(policy(state.observation()) * travel_rad))
            return self.held

    return Learned


def kept(policy):
    """How many of the jams are kept for the whole episode."""
    envs = gymnasium.make_vec("TwoStep/Jam-v0", num_envs=len(HELD_OUT), jams=JAMS, step_ms=STEP_MS)
    observations, _ = envs.reset(seed=list(HELD_OUT))
    is_lost = np.zeros(len(HELD_OUT), bool)
    is_over = np.zeros(len(HELD_OUT), bool)
    while not is_over.all():
        observations, _, terminated, truncated, _ = envs.step(policy(observations))
        is_lost |= terminated & ~is_over
        is_over |= terminated | truncated
    return int((~is_lost).sum())


def interval(count, of):
    """Wilson's 95 % interval of a fraction."""
    z, p = 1.959964, count / of
    centre, half = p + z * z / (2 * of), z * math.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    return (centre - half) / (1 + z * z / of), (centre + half) / (1 + z * z / of)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=100_000, help="environment steps of training")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--campaign", default="jams", help="campaign in which the law flies beside the others")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder of the campaign's results")
    args = parser.parse_args()

    policy = Policy(train(args.steps, args.seed))
    of = len(HELD_OUT)
    flown = {"PID alone": kept(lambda observations: np.zeros((len(observations), 3))), "learned": kept(policy)}
    for name, count in flown.items():
        low, high = interval(count, of)
        print(f"{name}: {count} of {of} held-out jams kept, {100 * low:.1f} to {100 * high:.1f} %")

    travel_rad = gymnasium.make("TwoStep/Jam-v0").unwrapped.action_travel
    law = compensator(policy, travel_rad)
    result = two_step.campaign.run(
        args.campaign, compensators={"learned": law}, own_set={"learned": {"FTC_MODE": 2}}, out=args.out / args.campaign
    )
    print(result.text)
    better = interval(flown["learned"], of)[0] > interval(flown["PID alone"], of)[1]
    sys.exit(0 if better else 1)


if __name__ == "__main__":
    main()
