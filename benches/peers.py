#!/usr/bin/env python3
"""TensorAeroSpace, JSBSim, jsbgym and this project on one machine, in one run, as one table.

    python3 benches/peers.py                        # builds this checkout; prints the table
    python3 benches/peers.py --wheel FILE --write   # a wheel that is there; the table goes into docs/peers.md

Each gets an environment of its own with fixed versions from PyPI (several GB in all) and runs in its own processes. Turns alternate in
order. What one core does is measured on one core; vector environments use all. Speed says nothing about accuracy.
"""

import argparse
import copy
import datetime
import functools
import hashlib
import importlib
import importlib.metadata
import json
import math
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/peers.md"
MARKS = ("<!-- peers.py begins -->", "<!-- peers.py ends -->")
JAM_DEG = 10.0
# Flown of each jam after it begins, s.
JAM_S = 1.0
FLIGHT_STEPS = 200


# What each project does, in a process of its own environment. `new` begins a flight, `restart` begins it anew in the same object, `fly`
# gives the bytes of what it saw, `steps` has the calls whose speed is measured: name, integration step in ms, function of a count.


class Peer:
    # Its environment of Gymnasium: itself, where a flight is one.
    environment = None

    def copy(self, flight):
        return copy.deepcopy(flight)

    def whole_flight(self):
        """Simulated seconds a second of flights in one call, where there is such a call."""
        return None

    def batched(self):
        """Speed and step of vectors that are not of Gymnasium."""
        return {}


class GymPeer(Peer):
    """A flight is an environment of Gymnasium."""

    # Environments of a vector, and how Gymnasium runs them.
    VECTORS = ((8, "sync"), (8, "async"), (64, "sync"), (64, "async"))

    def new(self):
        env = self.make()
        env.reset(seed=1)
        return env

    def restart(self, env):
        env.reset(seed=1)

    def fly(self, env, steps=FLIGHT_STEPS):
        import numpy as np

        rest = neutral(env.action_space)
        seen = []
        for step in range(steps):
            action = rest + 0.05 * math.sin(step / 5.0) * (env.action_space.high - rest)
            observation, _, ended, cut, _ = env.step(action.astype(rest.dtype))
            seen.append(numbers(observation).tobytes())
            if ended or cut:
                break
        assert np.isfinite(numbers(observation)).all(), observation
        return b"".join(seen)

    def env_stepper(self):
        env = self.new()
        action = neutral(env.action_space)

        def step():
            _, _, ended, cut, _ = env.step(action)
            if ended or cut:
                env.reset()

        return times(step)

    def vector(self, size, mode):
        """Environment steps a second of a vector; ended environments begin anew within it."""
        vector = self.make_vector(size, mode)
        try:
            vector.reset(seed=1)
            action = neutral(vector.action_space)
            return size * rate(times(lambda: vector.step(action)), time.perf_counter)
        finally:
            vector.close()


class TwoStepEnvironment(GymPeer):
    ENV = "TwoStep/Jam-v0"
    STEP_MS = 20.0
    # The package brings a vector of its own, which Gymnasium takes by itself.
    VECTORS = ((8, None), (64, None))

    def make(self):
        import gymnasium

        return gymnasium.make(self.ENV, step_ms=self.STEP_MS)

    def make_vector(self, size, mode):
        import gymnasium

        return gymnasium.make_vec(self.ENV, num_envs=size, step_ms=self.STEP_MS)


class TwoStep(Peer):
    name = "Two-Step"
    package = "two-step"
    modules = ("two_step", "two_step.gym")
    # The nominal scenario ends after a minute.
    LONG = {"plant.duration_s": 1e6}

    def __init__(self):
        import two_step

        self.two_step = two_step
        try:
            import two_step.gym  # noqa: F401

            self.environment = TwoStepEnvironment()
        except ImportError as error:
            print(f"no environment: {error}", file=sys.stderr)
            self.environment = None

    def new(self):
        return self.two_step.Simulation("case1", seed=1, set={"plant.wind.turbulence_m_s": 3.0})

    def restart(self, simulation):
        simulation.reset(1)

    def fly(self, simulation, steps=FLIGHT_STEPS):
        seen = []
        for _ in range(steps):
            # 20 ms, so that the jam of the scenario, at 3 s, is in the flight.
            simulation.step(10)
            seen.append(simulation.truth.values().tobytes())
        return b"".join(seen)

    def copy(self, simulation):
        return simulation.copy()

    def steps(self):
        simulation = self.two_step.Simulation("nominal", set=self.LONG)

        def with_state():
            simulation.step()
            simulation.truth.values()

        yield "`Simulation.step()`", 2.0, times(simulation.step)
        yield "`step()` and `truth.values()`, 59 signals", 2.0, times(with_state)
        yield "`step(n)`", 2.0, simulation.step

    def whole_flight(self):
        fly = functools.partial(self.two_step.fly, "case1", rows=False)
        return rate(times(fly)) * fly().end_s

    def env_step_ms(self):
        return TwoStepEnvironment.STEP_MS

    def facts(self):
        names = len(self.two_step.Simulation("nominal").state)
        observations = f"yes: {names} signals, as `state.roll_rad`, and the true ones, `truth`"
        if self.environment:
            names = len(self.environment.make().unwrapped.observation_names)
            observations += f"; of the environment {names}, `observation_names`"
        return {"observations": observations}

    def jam(self):
        held = self.jammed(lambda simulation, trim: simulation.act(trim))
        flown = self.jammed(lambda simulation, trim: None)
        left, right = flown["left"][-1], flown["right"][-1]
        moved, commanded = span(flown["left"]), span(flown["command"])
        return {
            "one_elevator": 'yes, any surface at any angle, at once or at the actuator\'s rate; `fail("left elevator", stuck_deg=10)`',
            "apart": f"{apart(left, right)}: left {left:.1f}, right {right:.1f} deg after {JAM_S:.0f} s, with the autopilot",
            "rolls": f"{yes(held['roll'][-1] > 1.0)}: {held['roll'][-1]:.0f} deg in {JAM_S:.0f} s with all commands held; with the "
            f"autopilot's PID, without compensator, {max(flown['roll']):.1f} deg at most",
            "after_actuator": f"{yes(moved < 1e-9 < commanded)}: command moves by {commanded:.1f} deg, surface by {moved:.1f}",
        }

    def jammed(self, control):
        """What follows a jam of the left elevator, deg, while `control` may replace the autopilot's commands by those before it."""
        simulation = self.two_step.Simulation("nominal", ftc="off")
        simulation.step(1000)
        trim = simulation.commands.values()
        simulation.fail("left elevator", stuck_deg=JAM_DEG)
        rows = {"roll": [], "command": [], "left": [], "right": []}
        for _ in range(round(JAM_S / 0.002)):
            control(simulation, trim)
            rows["command"].append(math.degrees(simulation.commands.left_elevator_rad))
            simulation.step()
            truth = simulation.truth
            rows["roll"].append(abs(math.degrees(truth.roll_rad)))
            rows["left"].append(math.degrees(truth.position_left_elevator_rad))
            rows["right"].append(math.degrees(truth.position_right_elevator_rad))
        return rows


class JsbSim(Peer):
    name = "JSBSim"
    package = "jsbsim"
    modules = ("jsbsim",)
    # The module has no step of its own; the value is that of its scripts and of jsbgym's predecessor.
    STEP_S = 1.0 / 120.0

    def __init__(self):
        import jsbsim

        self.jsbsim = jsbsim

    def load(self, model, altitude_ft, speed_ft_s, path=None, step_s=STEP_S):
        aircraft = self.jsbsim.FGFDMExec(None)
        aircraft.set_debug_level(0)
        if path:
            assert aircraft.load_model_with_paths(model, str(path), aircraft.get_engine_path(), aircraft.get_systems_path())
        else:
            assert aircraft.load_model(model)
        aircraft.set_dt(step_s)
        aircraft["ic/h-sl-ft"] = altitude_ft
        aircraft["ic/vt-fps"] = speed_ft_s
        assert aircraft.run_ic()
        aircraft["propulsion/set-running"] = -1
        return aircraft

    def trimmed(self, *args, **kwargs):
        aircraft = self.load(*args, **kwargs)
        aircraft["simulation/do_simple_trim"] = 1
        return aircraft

    def new(self):
        return self.load("f16", 15_000.0, 500.0)

    def restart(self, aircraft):
        aircraft.reset_to_initial_conditions(0)
        aircraft["propulsion/set-running"] = -1

    def fly(self, aircraft, steps=FLIGHT_STEPS):
        seen = []
        for step in range(steps):
            aircraft["fcs/elevator-cmd-norm"] = 0.05 * math.sin(step / 5.0)
            aircraft.run()
            seen.append([aircraft[name] for name in ("velocities/q-rad_sec", "position/h-sl-ft", "attitude/phi-rad", "velocities/u-fps")])
        return json.dumps(seen).encode()

    def steps(self):
        aircraft = self.trimmed("f16", 15_000.0, 500.0)
        names = ["velocities/q-rad_sec", "position/h-sl-ft", "attitude/phi-rad", "attitude/theta-rad", "velocities/u-fps", "aero/alpha-rad"]

        def with_state():
            aircraft.run()
            for name in names:
                aircraft[name]

        yield "`run()`, F-16", 1e3 * self.STEP_S, times(aircraft.run)
        yield "`run()` and 6 properties", 1e3 * self.STEP_S, times(with_state)
        assert abs(aircraft["position/h-sl-ft"] - 15_000.0) < 5_000.0, "it has not flown level"
        aircraft = self.trimmed("f16", 15_000.0, 500.0, step_s=0.002)
        yield "`run()`, F-16", 2.0, times(aircraft.run)

    def facts(self):
        return {"observations": f"yes: {len(self.new().get_property_catalog())} properties of the F-16 by name"}

    def flown(self, aircraft, fault, watched):
        """Values before a fault, and after commands that change with it for as long as a jam is flown."""
        for _ in range(120):
            aircraft.run()
        before = [aircraft[name] for name in watched]
        aircraft[fault] = 1
        aircraft["fcs/elevator-cmd-norm"] = -0.3
        aircraft["fcs/aileron-cmd-norm"] = 0.3
        for _ in range(round(JAM_S / self.STEP_S)):
            aircraft.run()
        return before, [aircraft[name] for name in watched]

    def jam(self):
        models = bundled_aircraft(self.jsbsim)
        bundled = with_elevator_jam(self.jsbsim, models)
        # The F-16's surfaces are no actuators: a position written from outside holds to the next step.
        f16 = self.trimmed("f16", 15_000.0, 500.0)
        for _ in range(10):
            f16.run()
        f16["fcs/elevator-pos-rad"] = math.radians(JAM_DEG)
        f16.run()
        overwritten = abs(math.degrees(f16["fcs/elevator-pos-rad"]) - JAM_DEG) > 0.1
        # The Cessna's are.
        watched = ["fcs/elevator-pos-rad", "fcs/elevator-control"]
        cessna = ("c172x", 5_000.0, 180.0)
        before, after = self.flown(self.trimmed(*cessna), "fcs/elevator-actuator/malfunction/fail_stuck", watched)
        moved, commanded = (math.degrees(abs(b - a)) for a, b in zip(before, after))
        ends = [
            self.flown(self.trimmed(*cessna), f"fcs/elevator-actuator/malfunction/{fault}", watched)[1][0]
            for fault in ("fail_hardover", "fail_zero")
        ]
        limit, zero = (math.degrees(end) for end in ends)
        watched = ["fcs/left-aileron-pos-rad", "fcs/right-aileron-pos-rad", "attitude/phi-rad"]
        before, after = self.flown(self.trimmed(*cessna), "fcs/left-aileron-actuator/malfunction/fail_stuck", watched)
        left, right, roll = (math.degrees(b - a) for a, b in zip(before, after))
        with tempfile.TemporaryDirectory() as folder:
            two = self.two_elevators(Path(folder))
            for _ in range(120):
                two.run()
            # To the limit of its travel, 0.34 rad.
            two["fcs/left-elevator-actuator/malfunction/fail_hardover"] = 1
            two_roll = 0.0
            for _ in range(round(JAM_S / self.STEP_S)):
                two.run()
                two_roll = max(two_roll, abs(math.degrees(two["attitude/phi-rad"])))
            two_left, two_right = (math.degrees(two[f"fcs/{side}-elevator-pos-rad"]) for side in ("left", "right"))
        return {
            "one_elevator": "of the one elevator, not of one half, where an aircraft's XML has an `<actuator>`: where it stands (`fail_stuck`), at "
            f"a limit ({limit:.1f} deg in the Cessna) or near zero ({zero:.1f}). Of {len(models)} bundled models {len(bundled)} have it "
            f"({', '.join(bundled)}); the F-16 has not, and {'overwrites' if overwritten else 'keeps'} a position that is written",
            "apart": f"elevators of bundled aircraft no, ailerons of the Cessna yes: left moves by {abs(left):.1f}, right by {abs(right):.1f} "
            f"deg. With two elevators that the user writes in XML {apart(two_left, two_right)}: left {two_left:.1f}, right "
            f"{two_right:.1f} deg",
            "rolls": f"by one aileron {yes(abs(roll) > 1.0)}: {abs(roll):.0f} deg in {JAM_S:.0f} s. By one elevator {yes(two_roll > 1.0)} with "
            f"that XML, {two_roll:.0f} deg; its rolling moment is the user's",
            "after_actuator": f"{yes(moved < 1e-6 < commanded)}: command moves by {commanded:.1f} deg, surface by {moved:.1f}",
        }

    def two_elevators(self, folder):
        """The Cessna with an actuator for each elevator, and a rolling moment of their difference."""
        source = Path(self.jsbsim.get_default_root_dir()) / "aircraft/c172x"
        shutil.copytree(source, folder / "c172x")
        file = folder / "c172x/c172x.xml"
        xml = file.read_text()
        begin = xml.index('<actuator name="fcs/elevator-actuator">')
        end = xml.index("</actuator>", begin) + len("</actuator>")
        actuator = xml[begin:end]
        sides = "".join(
            actuator.replace("fcs/elevator-actuator", f"fcs/{side}-elevator-actuator").replace(
                "fcs/elevator-pos-rad", f"fcs/{side}-elevator-pos-rad"
            )
            for side in ("left", "right")
        )
        mean = (
            '<fcs_function name="fcs/elevator-mean"><function><product><value>0.5</value><sum><property>fcs/left-elevator-pos-rad'
            "</property><property>fcs/right-elevator-pos-rad</property></sum></product></function>"
            "<output>fcs/elevator-pos-rad</output></fcs_function>"
        )
        roll = (
            '<function name="aero/coefficient/Cl-elevators"><product><property>aero/qbar-psf</property><property>metrics/Sw-sqft'
            "</property><property>metrics/bw-ft</property><difference><property>fcs/left-elevator-pos-rad</property><property>"
            "fcs/right-elevator-pos-rad</property></difference><value>0.05</value></product></function>"
        )
        xml = xml[:begin] + sides + mean + xml[end:]
        axis = xml.index('<axis name="ROLL">') + len('<axis name="ROLL">')
        file.write_text(xml[:axis] + roll + xml[axis:])
        return self.trimmed("c172x", 5_000.0, 180.0, path=folder)


def bundled_aircraft(jsbsim):
    folder = Path(jsbsim.get_default_root_dir()) / "aircraft"
    return sorted(path.stem for path in folder.glob("*/*.xml") if path.stem == path.parent.name)


def with_elevator_jam(jsbsim, models):
    """Those whose elevator has a switch that jams it."""
    found = []
    for model in models:
        aircraft = jsbsim.FGFDMExec(None)
        aircraft.set_debug_level(0)
        try:
            assert aircraft.load_model(model)
        except Exception as error:
            print(f"{model} is not counted: {error!r}", file=sys.stderr)
            continue
        if any("elevator" in name.lower() and "fail_stuck" in name for name in aircraft.get_property_catalog()):
            found.append(model)
    return found


class JsbGym(GymPeer):
    name = "jsbgym"
    package = "jsbgym"
    modules = ("jsbgym",)
    ENV = "F16-HeadingControlTask-Shaping.STANDARD-NoFG-v0"

    def __init__(self):
        import jsbgym  # noqa: F401

        self.environment = self

    def make(self):
        import gymnasium

        return gymnasium.make(self.ENV)

    def make_vector(self, size, mode):
        import gymnasium

        return gymnasium.make_vec(self.ENV, num_envs=size, vectorization_mode=mode)

    def steps(self):
        # An environment that is collected closes its simulation.
        env = self.new()
        simulation = env.unwrapped.sim
        yield "`Simulation.run()`, F-16", 1e3 * simulation.sim_dt, times(simulation.run)

    def env_step_ms(self):
        env = self.new()
        before = env.unwrapped.sim.get_sim_time()
        env.step(neutral(env.action_space))
        return round(1e3 * (env.unwrapped.sim.get_sim_time() - before), 6)

    def facts(self):
        task = self.make().unwrapped.task
        return {
            "observations": f"an array of {len(task.state_variables)}; names in `task.state_variables`, any property of JSBSim through `sim`",
        }

    def jam(self):
        import jsbsim
        from jsbgym import utils

        models = sorted({values[0].jsbsim_id for values in utils.get_env_id_kwargs_map().values()})
        found = with_elevator_jam(jsbsim, models)
        return {
            "one_elevator": f"no: {len(found)} of its {len(models)} aircraft have a switch that jams an elevator",
            "apart": "no",
            "rolls": "no",
            "after_actuator": "-",
        }


class TensorAeroSpace(GymPeer):
    name = "TensorAeroSpace"
    package = "tensoraerospace"
    modules = ("tensoraerospace.envs",)
    ENV = "NonlinearAngularF16-v0"
    # Each process needs 0.7 GB; 64 would need 42 GB.
    VECTORS = ((8, "sync"), (8, "async"), (64, "sync"))

    def __init__(self):
        import tensoraerospace.envs  # noqa: F401
        from tensoraerospace.aerospacemodel.f16.nonlinear.angular.trim import find_trim

        self.trim = find_trim(150.0, 3_000.0)
        assert self.trim.converged
        self.environment = self

    def options(self, profile=None):
        return {
            "initial_state": self.trim.x0,
            "number_time_steps": 2_000,
            "track_altitude": True,
            "split_stab": True,
            "damage_profile": profile,
        }

    def make(self, profile=None):
        import gymnasium

        return gymnasium.make(self.ENV, **self.options(profile))

    def make_vector(self, size, mode):
        import gymnasium

        return gymnasium.make_vec(self.ENV, num_envs=size, vectorization_mode=mode, **self.options())

    def steps(self):
        model = self.new().unwrapped.model
        command = [self.trim.stab_rad, self.trim.stab_rad, 0.0, 0.0]

        yield "`AngularF16.run_step()`, RK4", 1e3 * model.dt, times(lambda: model.run_step(command))

    def env_step_ms(self):
        return 1e3 * self.new().unwrapped.dt

    def batched(self, size=64):
        """Speed and step of its one environment that is batched inside: a linear longitudinal model of the Boeing 747."""
        import torch
        from tensoraerospace.envs import ImprovedB747VecEnvTorch

        vector = ImprovedB747VecEnvTorch(num_envs=size, seed=1)
        vector.reset()
        action = torch.zeros((size, 1))

        speed = size * rate(times(lambda: vector.step(action)), time.perf_counter)
        return {f"{size} of a linear Boeing 747, batched": [speed, 1e3 * vector.dt]}

    def facts(self):
        from tensoraerospace.envs.f16.nonlinear_angular import MODEL_STATE_ORDER

        return {
            "observations": f"an array; names of its first {len(MODEL_STATE_ORDER)} values in `MODEL_STATE_ORDER`",
        }

    def jammed(self, surface, steps):
        """Roll, mean stabilator and aileron in deg after each step that follows a jam."""
        import numpy as np
        from tensoraerospace.aerospacemodel.f16.nonlinear.damage import DamageEvent, DamageProfile

        jam = {"surface": surface, "mode": "jam", "jam_position_rad": math.radians(JAM_DEG)}
        profile = DamageProfile(events=[DamageEvent(trigger_time=1.0, event_type="control_failure", payload=jam)])
        env = self.make(profile)
        env.reset(seed=1)
        stab_deg = math.degrees(self.trim.stab_rad)
        rows = []
        for step in range(100 + steps):
            observation = env.step(np.array([stab_deg, stab_deg, 0.0, 0.0]))[0]
            rows.append([math.degrees(observation[index]) for index in (5, 8, 10, 2)])
        return rows[99:]

    def jam(self):
        rows = self.jammed("stab_left", round(JAM_S / 0.01))
        stab_deg = math.degrees(self.trim.stab_rad)
        half = 0.5 * (JAM_DEG + stab_deg)
        at_once, end = rows[1], rows[-1]
        later = abs(rows[1][1] - half) > 1.0 and abs(end[1] - half) < 0.1
        left, right = (self.jammed(f"aileron_{side}", 50)[-1] for side in ("left", "right"))
        return {
            "one_elevator": "yes, `split_stab=True` and a `DamageProfile`: any angle at any time, also loss, partial loss and free floating; "
            f"a jam of the left aileron and one of the right are {'the same flight: one channel' if left == right else 'different flights'}",
            "apart": f"commands yes; the position is their mean: {end[1]:.1f} deg after {JAM_S:.0f} s with a jam at {JAM_DEG:.0f} and a "
            f"command of {stab_deg:.1f}",
            "rolls": f"{yes(abs(end[0]) > 1.0)}: {abs(end[0]):.0f} deg in {JAM_S:.0f} s with all commands held",
            "after_actuator": f"{'no: it replaces the command' if later else 'yes'}. The mean angle goes there through the servo "
            f"({at_once[1] - rows[0][1]:.1f} deg in the first 10 ms); the rolling moment is there at once ({abs(at_once[3]):.0f} deg/s "
            "after 10 ms)",
        }


PEERS = {"two-step": TwoStep, "jsbsim": JsbSim, "jsbgym": JsbGym, "tensoraerospace": TensorAeroSpace}
REQUIREMENTS = {
    "jsbsim": ["jsbsim==1.3.3"],
    "jsbgym": ["jsbgym==0.4.3", "jsbsim==1.3.3"],
    "tensoraerospace": ["tensoraerospace==0.3.18"],
}
BETTER = {
    "two-step": "each surface fails by itself and after its actuator; autopilot, compensators, estimator and judges around the aircraft; flights "
    "can be copied and repeated; small and quick to start",
    "jsbsim": "many aircraft, also rotorcraft, airships and rockets; engines, propellers, fuel, gear and ground; an aircraft is XML, with its "
    "own systems, and any property is written by name; used for decades, also by FlightGear",
    "jsbgym": "14 aircraft and two tasks with shaped rewards for each; plots, FlightGear; long steps for an agent",
    "tensoraerospace": "airliners, X-15, small UAVs, quadrotor, rockets, satellites; loss of parts of the wing with mass and inertia; some 20 "
    "agents and adaptive laws with it; 3D views of a flight",
}
INCLUDES = {
    "two-step": "RK4; each surface with servo and fault, WGS-84, sensors; autopilot, compensator, detector; truth, judge",
    "jsbsim": "one evaluation (Adams-Bashforth); engine, flight control system, fuel, ground contacts, oblate Earth",
    "jsbgym": "as JSBSim",
    "tensoraerospace": "RK4; three servos, spline tables, damage; history of states",
}


def neutral(space):
    """Zero where the space has it, else what is nearest."""
    import numpy as np

    return np.clip(np.zeros(space.shape, space.dtype), space.low, space.high)


def numbers(observation):
    """An observation as one array."""
    import numpy as np

    if isinstance(observation, dict):
        return np.concatenate([np.ravel(value) for value in observation.values()])
    return np.asarray(observation)


def span(values):
    return max(values) - min(values)


def yes(truth):
    return "yes" if truth else "no"


def apart(left_deg, right_deg):
    return yes(abs(left_deg - right_deg) > 1.0)


def times(call):
    """A function that calls so many times."""

    def run(count):
        for _ in range(count):
            call()

    return run


def rate(run, clock=time.process_time, seconds=0.5):
    """Calls a second of processor time or, of what runs on several cores, of wall time; run(count) makes so many, for at least so long."""
    run(1)
    count = 1
    while True:
        begin = clock()
        run(count)
        taken = clock() - begin
        if taken >= seconds:
            return count / taken
        count = max(2 * count, math.ceil(1.1 * count * seconds / max(taken, 1e-6)))


# Parts of a measurement, each in a process of its own.


def measure_speed(peer_class):
    """On one core: import, a step, an environment."""
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    result = {"import_s": {}}
    begin = time.perf_counter()
    for module in peer_class.modules:
        try:
            importlib.import_module(module)
        except ImportError as error:
            print(f"{module}: {error}", file=sys.stderr)
        else:
            result["import_s"][module] = time.perf_counter() - begin
    peer = peer_class()
    result["steps"] = [{"name": name, "step_ms": step_ms, "us": 1e6 / rate(run)} for name, step_ms, run in peer.steps()]
    result["whole_flight"] = peer.whole_flight()
    if peer.environment:
        result["env"] = {"name": peer.environment.ENV, "step_ms": peer.env_step_ms(), "per_s": rate(peer.environment.env_stepper())}
    return result


def measure_vectors(peer_class):
    """On all cores."""
    peer = peer_class()
    result = {}
    if peer.environment:
        for size, mode in peer.environment.VECTORS:
            result[f"{size} {mode or 'batched'}"] = [peer.environment.vector(size, mode), peer.env_step_ms()]
    return {**result, **peer.batched()}


def measure_facts(peer_class):
    """What does not depend on time."""
    peer = peer_class()
    facts = repeated(peer)
    if peer.environment not in (None, peer):
        facts["environment"] = repeated(peer.environment)
    distribution = importlib.metadata.distribution(peer.package) if installed(peer.package) else None
    facts["version"] = distribution.version if distribution else "checkout"
    facts["licence"] = licence(distribution)
    facts["with"] = {name: importlib.metadata.version(name) for name in ("jsbsim", "gymnasium", "numpy", "torch") if installed(name)}
    return {**facts, **peer.facts(), "jam": peer.jam()}


def repeated(flights):
    """Whether a flight repeats, and whether its copy goes on as it does."""
    first = flights.new()
    seen = flights.fly(first)
    facts = {"hash": hashlib.sha256(seen).hexdigest(), "same_new": flights.fly(flights.new()) == seen}
    flights.restart(first)
    facts["same_restart"] = flights.fly(first) == seen
    saved = flights.new()
    flights.fly(saved, FLIGHT_STEPS // 2)
    try:
        other = flights.copy(saved)
    except Exception as error:
        return {**facts, "copy": f"no ({type(error).__name__} of `copy.deepcopy`)"}
    same = flights.fly(saved, FLIGHT_STEPS // 2) == flights.fly(other, FLIGHT_STEPS // 2)
    return {**facts, "copy": f"yes, {'same bits' if same else 'other bits'}"}


def installed(package):
    try:
        importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return False
    return True


def licence(distribution):
    if distribution is None:
        return "MIT OR Apache-2.0"
    named = distribution.metadata.get("License-Expression") or distribution.metadata.get("License")
    kinds = [line.split(" :: ")[-1] for line in distribution.metadata.get_all("Classifier", []) if line.startswith("License ::")]
    return named or ", ".join(kinds) or "not stated"


PARTS = {"speed": measure_speed, "vectors": measure_vectors, "facts": measure_facts}


# The process that the user starts.


def environment(folder, name, requirements, checkout):
    """The interpreter of an environment that has what is required, made where it is not there or has something else."""
    place = folder / name
    python = place / "bin/python"
    stamp = place / "peers.json"
    # A checkout or a wheel can have changed under the same name.
    local = [Path(requirement.split("[")[0]) for requirement in requirements if requirement.startswith("/")]
    built = [time.time() if path.is_dir() else path.stat().st_mtime for path in local]
    wanted = json.dumps([requirements, sys.version, *built])
    if not (stamp.exists() and stamp.read_text() == wanted):
        print(f"{name}: installing {' '.join(requirements)}", file=sys.stderr)
        shutil.rmtree(place, ignore_errors=True)
        # Without pip, which is no part of what is compared.
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", place], check=True)
        pip = [sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*pip, *requirements], check=True)
        stamp.write_text(wanted)
    # What this machine sets for its own programs is no part of the comparison.
    environ = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "OPENBLAS_", "OMP_"))}
    if checkout:
        environ["PYTHONPATH"] = str(ROOT / "python")
    return python, environ


def size_mb(python):
    """Of the packages, without the interpreter."""
    packages = next((python.parent.parent / "lib").glob("python*/site-packages"))
    return sum(path.stat().st_size for path in packages.rglob("*") if path.is_file() and not path.is_symlink()) / 1e6


def measured(name, part, python, environ):
    """The result of one part, from a process."""
    with tempfile.TemporaryDirectory(prefix="peers-") as folder:
        out = Path(folder) / "out.json"
        command = [python, Path(__file__).resolve(), "--measure", name, part, out]
        done = subprocess.run(command, cwd=folder, env=environ, capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"{name}, {part}: exit status {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}")
        return json.loads(out.read_text())


def compare_processes(one, other):
    one["same_process"] = one["hash"] == other["hash"]
    if "environment" in one:
        compare_processes(one["environment"], other["environment"])


def figure(values, digits=3):
    """Median, least and largest."""
    middle, least, most = (rounded(value, digits) for value in (statistics.median(values), min(values), max(values)))
    return middle if least == most else f"{middle} ({least} to {most})"


def rounded(value, digits=3):
    if value == 0.0:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{round(value, digits - 1 - math.floor(math.log10(abs(value)))):,.{places}f}"


def table(facts, turns, sizes):
    """One column for each project."""
    names = list(facts)
    rows = []

    def row(title, cell):
        rows.append([title, *(cell(name) for name in names)])

    def over_turns(name, part, get):
        values = [get(turn) for turn in turns[name][part]]
        return [value for value in values if value is not None]

    def import_cell(name):
        modules = turns[name]["speed"][0]["import_s"]
        return "<br>".join(
            f"`{module}`: {figure(over_turns(name, 'speed', lambda turn, module=module: turn['import_s'][module]))}" for module in modules
        )

    def step_cell(name):
        cells = []
        for index, step in enumerate(turns[name]["speed"][0]["steps"]):
            us = over_turns(name, "speed", lambda turn, index=index: turn["steps"][index]["us"])
            speed = [1e3 * step["step_ms"] / value for value in us]
            cells.append(f"{step['name']}, {step['step_ms']:.3g} ms: {figure(us)} us; {rounded(statistics.median(speed))} ×")
        return "<br>".join(cells)

    def whole_cell(name):
        values = over_turns(name, "speed", lambda turn: turn["whole_flight"])
        return f'`fly("case1", rows=False)`: {figure(values)} ×' if values else "-"

    def env_cell(name):
        first = turns[name]["speed"][0].get("env")
        if not first:
            return "no environment" if name != "two-step" else "`two_step.gym` is not in this version"
        values = over_turns(name, "speed", lambda turn: turn["env"]["per_s"])
        step_ms = first["step_ms"]
        simulated = rounded(statistics.median(values) * step_ms / 1e3)
        return f"`{first['name']}`: {figure(values)} steps/s of {step_ms:g} ms; {simulated} ×"

    def vector_cell(name):
        cells = []
        for kind, (_, step_ms) in turns[name]["vectors"][0].items():
            values = over_turns(name, "vectors", lambda turn, kind=kind: turn[kind][0])
            cells.append(f"{kind}: {figure(values)}; {rounded(statistics.median(values) * step_ms / 1e3)} ×")
        return "<br>".join(cells) or "-"

    def of_both(name, words):
        """Of a simulation and of the environment, where a project has both."""
        fact = facts[name]
        return words(fact) + (f"<br>environment: {words(fact['environment'])}" if "environment" in fact else "")

    def same_words(fact):
        kinds = {"new flight": "same_new", "new process": "same_process", "reset of one that has flown": "same_restart"}
        return "; ".join(f"{words}: {yes(fact[key])}" for words, key in kinds.items())

    row("version", lambda name: facts[name]["version"])
    row(
        "installed with it",
        lambda name: ", ".join(f"{package} {version}" for package, version in facts[name]["with"].items() if package != name),
    )
    row("licence", lambda name: facts[name]["licence"])
    row("installed packages, MB", lambda name: rounded(sizes[name]))
    row("import, s", import_cell)
    row("one step, integration step, simulated time over time", step_cell)
    row("a step has", INCLUDES.get)
    row("flights in one call", whole_cell)
    row("environment of Gymnasium", env_cell)
    row("vector of environments, all cores, environment steps/s", vector_cell)
    row("same seed, same bits", lambda name: of_both(name, same_words))
    row("copy of a flight that goes on", lambda name: of_both(name, lambda fact: fact["copy"]))
    row("observations by name", lambda name: facts[name]["observations"])
    row("jam of one elevator", lambda name: facts[name]["jam"]["one_elevator"])
    row("left and right move apart", lambda name: facts[name]["jam"]["apart"])
    row("it rolls the aircraft", lambda name: facts[name]["jam"]["rolls"])
    row("after the actuator", lambda name: facts[name]["jam"]["after_actuator"])
    row("better than the others in", BETTER.get)
    lines = [["", *(PEERS[name].name for name in names)], ["---"] * (len(names) + 1), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def machine():
    model = next(
        (line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")), "?"
    )
    return f"{len(os.sched_getaffinity(0))} cores, {model}, Linux {platform.release().split('-')[0]}, Python {platform.python_version()}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=Path(tempfile.gettempdir()) / "two-step-peers", help="environments, kept there")
    parser.add_argument("--wheel", type=Path, help="a wheel of two-step; without it pip builds this checkout, which takes minutes")
    parser.add_argument("--checkout", action="store_true", help="python/ as it is, not installed: to work on this script")
    parser.add_argument("--only", action="append", choices=list(PEERS), help="only these")
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--write", action="store_true", help="also into docs/peers.md")
    parser.add_argument("--json", type=Path, help="also every number")
    parser.add_argument("--measure", nargs=3, metavar=("PEER", "PART", "FILE"), help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.measure:
        name, part, out = args.measure
        Path(out).write_text(json.dumps(PARTS[part](PEERS[name])))
        return
    if args.checkout:
        ours = ["numpy", "gymnasium"]
    else:
        if args.wheel and not args.wheel.is_file():
            parser.error(f"--wheel {args.wheel}: no such file")
        source = args.wheel.resolve() if args.wheel else ROOT / "python"
        ours = [f"{source}[gymnasium]"]
    folder = args.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    names = [name for name in PEERS if not args.only or name in args.only]
    places = {name: environment(folder, name, REQUIREMENTS.get(name, ours), args.checkout and name == "two-step") for name in names}
    facts = {}
    for name in names:
        facts[name], again = (measured(name, "facts", *places[name]) for _ in range(2))
        compare_processes(facts[name], again)
    turns = {name: {"speed": [], "vectors": []} for name in names}
    for turn in range(args.turns):
        for name in names if turn % 2 == 0 else reversed(names):
            for part in ("speed", "vectors"):
                print(f"turn {turn + 1} of {args.turns}: {name}, {part}", file=sys.stderr)
                turns[name][part].append(measured(name, part, *places[name]))
    sizes = {name: size_mb(places[name][0]) for name in names}
    head = f"{datetime.date.today()}; {machine()}. Medians of {args.turns} turns, least and largest in brackets; × is times real time."
    if args.checkout:
        head += " **Not a release build: the numbers of Two-Step mean nothing.**"
    text = f"{head}\n\n{table(facts, turns, sizes)}"
    print(text)
    if args.json:
        args.json.write_text(json.dumps({"facts": facts, "turns": turns, "sizes_mb": sizes, "machine": machine()}, indent=1))
    if args.write:
        page = PAGE.read_text()
        before, after = page.split(MARKS[0])[0], page.split(MARKS[1])[1]
        PAGE.write_text(f"{before}{MARKS[0]}\n{text}\n{MARKS[1]}{after}")


if __name__ == "__main__":
    main()
