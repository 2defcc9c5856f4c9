#!/usr/bin/env python3
"""Speed of this project's F-16 beside that of JSBSim, in turns on one core.

    pip install jsbsim
    python3 sitl/benches/jsbsim_f16.py target/release/sitl

Both integrate the same aircraft type over a round Earth with the same step. It prints steps a second of one core, how much
faster than real time that is, the ratio, and what a step of each includes. Neither result is a measure of accuracy.
"""

import argparse
import csv
import os
import re
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import jsbsim

INCLUDES = {
    "plant alone": "aerodynamics and thrust by tables, servos, faults, WGS-84 with J2, truth; four evaluations of the derivative (RK4)",
    "plant, sensors": "the same, with tactical sensors every 2 ms and turbulence",
    "campaign": "the plant with exact sensors, and every 2 ms guidance, laws, observer, detector and all measures; setup of each run",
    "JSBSim": "aerodynamics by tables, engine, flight control system, fuel, ground contacts, oblate Earth; one evaluation "
    "(Adams-Bashforth), called step by step from Python",
}
# Flights of one campaign; what starts and ends the program is measured with a campaign of one flight and taken off.
FLIGHTS = 20
SPEC = """
name = "f16"
duration_s = {duration_s}
step_us = {step_us}
scenario = "nominal"
samples = {flights}

[set]
"plant.fault.1.kind" = "stuck_here"
"plant.fault.1.effector" = "rudder"

[[vary]]
key = "plant.fault.1.onset_s"
uniform = [1.0, 5.0]

[[airframe]]
name = "F-16"
file = "{root}/aircraft/f16/airframe.toml"
model = "{root}/aircraft/f16/model.toml"

[[law]]
name = "paper"
set = {{ FTC_MODE = 1 }}
"""


def processor_s(command):
    """Processor time of a program that ends well, s."""
    before = os.times()
    environment = {**os.environ, "RAYON_NUM_THREADS": "1"}
    subprocess.run(command, check=True, capture_output=True, env=environment)
    after = os.times()
    return after.children_user - before.children_user + after.children_system - before.children_system


def campaign(program, duration_s, step_us):
    """Seconds of flight for each second of processor time of a campaign."""
    root = Path(__file__).resolve().parents[2]
    with tempfile.TemporaryDirectory() as temporary:
        times = []
        for flights in [1, FLIGHTS + 1]:
            spec = Path(temporary) / f"{flights}.toml"
            spec.write_text(SPEC.format(duration_s=duration_s, step_us=step_us, flights=flights, root=root))
            out = Path(temporary) / f"{flights}"
            times.append(processor_s([program, "campaign", "run", spec, "--out", out]))
        # A lost aircraft would not have flown the whole duration.
        with (out / "summary.csv").open() as summary:
            (row,) = csv.DictReader(summary)
        assert row["kept"] == row["flights"], row
    return FLIGHTS * duration_s / (times[1] - times[0])


def plant(program, step_us):
    """Steps a second of the F-16's plant, alone and with sensors and turbulence."""
    out = subprocess.run([program, "bench", "--parts", "--repeat", "1"], check=True, capture_output=True, text=True).stdout
    found = re.search(rf"F-16 +step {step_us} us: plain +(\d+)/s.* all +(\d+)/s", out)
    assert found, out
    return [float(number) for number in found.groups()]


def jsbsim_f16(duration_s, step_us):
    """The same of JSBSim's F-16, trimmed in level flight, with its own flight control system."""
    aircraft = jsbsim.FGFDMExec(None)
    aircraft.set_debug_level(0)
    assert aircraft.load_model("f16")
    aircraft.set_dt(step_us * 1.0e-6)
    aircraft["ic/h-sl-ft"] = 15_000.0
    aircraft["ic/vt-fps"] = 500.0
    assert aircraft.run_ic()
    aircraft["propulsion/set-running"] = -1
    aircraft["simulation/do_simple_trim"] = 1
    steps = round(duration_s / (step_us * 1.0e-6))
    begin = time.process_time()
    for _ in range(steps):
        aircraft.run()
    speed = duration_s / (time.process_time() - begin)
    assert abs(aircraft["position/h-sl-ft"] - 15_000.0) < 1_500.0, "it has not flown level"
    return speed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--duration-s", type=float, default=40.0)
    parser.add_argument("--repeat", type=int, default=5)
    args = parser.parse_args()
    print(f"JSBSim {jsbsim.__version__}; medians of {args.repeat} turns; ratio to JSBSim in the same turn, and its range")
    for step_us in [1_000, 2_000]:
        turns = {name: [] for name in INCLUDES}
        step_s = step_us * 1.0e-6
        for _ in range(args.repeat):
            alone, with_sensors = plant(args.program.resolve(), step_us)
            turns["plant alone"].append(alone)
            turns["plant, sensors"].append(with_sensors)
            turns["campaign"].append(campaign(args.program.resolve(), args.duration_s, step_us) / step_s)
            turns["JSBSim"].append(jsbsim_f16(args.duration_s, step_us) / step_s)
        print(f"steps of {step_us} us")
        for name, rates in turns.items():
            rate = statistics.median(rates)
            ratios = sorted(ours / theirs for ours, theirs in zip(rates, turns["JSBSim"]))
            print(
                f"  {name:<14} {rate:9.0f} steps/s, {rate * step_s:6.0f} times real time, "
                f"ratio {statistics.median(ratios):5.2f} ({ratios[0]:.2f} to {ratios[-1]:.2f})"
            )
    print("a step includes")
    for name, what in INCLUDES.items():
        print(f"  {name:<14} {what}")


if __name__ == "__main__":
    main()
