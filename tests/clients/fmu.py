"""Flies plant and autopilot as FMUs with FMPy, and compares every value with the flight in one process, to the bit."""

import argparse
import pathlib
import subprocess
import tempfile

import numpy as np
from pyulog import ULog

try:
    import fmpy
    from fmpy.fmi1 import FMICallException
    from fmpy.fmi3 import FMU3Slave
    from fmpy.validation import validate_fmu
except ImportError:
    print("skipped: FMPy is not installed")
    raise SystemExit

PERIOD_S = 0.002


class Fmu:
    """An FMU with its variables by name."""

    def __init__(self, path, folder, **start):
        problems = validate_fmu(str(path))
        assert not problems, problems
        description = fmpy.read_model_description(path)
        self.variables = {v.name: v for v in description.modelVariables}
        self.messages = []
        self.slave = FMU3Slave(
            guid=description.instantiationToken,
            # Each in a folder of its own: a loaded library must not be written over.
            unzipDirectory=fmpy.extract(path, tempfile.mkdtemp(dir=folder)),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=path.stem,
        )
        self.slave.instantiate(logMessage=lambda _, status, category, text: self.messages.append(text.decode()))
        self.slave.enterInitializationMode()
        for name, value in start.items():
            self.set(name, value)
        self.slave.exitInitializationMode()

    def names(self, causality, kind):
        chosen = self.variables.values()
        return [v.name for v in chosen if v.causality == causality and v.type == kind]

    def access(self, access, names, *values):
        references = [self.variables[name].valueReference for name in names]
        return getattr(self.slave, access + self.variables[names[0]].type)(references, *values)

    def set(self, name, value):
        self.access("set", [name], [value])

    def get(self, name):
        return self.access("get", [name])[0]

    def step(self, time_s, size_s=PERIOD_S):
        return self.slave.doStep(time_s, size_s)

    def refused(self, act, reason):
        """The call fails, and the log says this."""
        before = len(self.messages)
        try:
            act()
        except FMICallException:
            assert reason in self.messages[-1] and len(self.messages) == before + 1, self.messages
        else:
            raise AssertionError(f"not refused: {reason}")


def connections(source, target):
    """Names of the outputs that are inputs of the other one, each list of one type."""
    for kind in ["Float64", "UInt64", "Boolean", "String"]:
        names = [n for n in source.names("output", kind) if n in target.names("input", kind)]
        if names:
            yield names


def fly(plant, autopilot, steps):
    """The pair: the autopilot answers the sensors of a tick, and the plant obeys in the same step."""
    to_autopilot, to_plant = list(connections(plant, autopilot)), list(connections(autopilot, plant))
    outputs = {"plant": plant.names("output", "Float64"), "autopilot": autopilot.names("output", "Float64")}
    rows = {"plant": [], "autopilot": []}
    for step in range(steps):
        time_s = step * PERIOD_S
        rows["plant"].append(plant.access("get", outputs["plant"]))
        for names in to_autopilot:
            autopilot.access("set", names, plant.access("get", names))
        autopilot.step(time_s)
        rows["autopilot"].append(autopilot.access("get", outputs["autopilot"]))
        for names in to_plant:
            plant.access("set", names, autopilot.access("get", names))
        plant.step(time_s)
    return {
        name: np.array(column)
        for side in rows
        for name, column in zip(outputs[side], np.array(rows[side]).T, strict=True)
    }


def equals_the_log(flown, log):
    """Every row of the log; away from events it has every fifth step."""
    topics = {data.name: data.data for data in ULog(str(log)).data_list}
    prefixes = {"truth": "truth.", "sensors": "sensors.", "control": "control.", "commands": ""}
    compared = 0
    for topic, prefix in prefixes.items():
        columns = topics[topic]
        places = np.round(columns["timestamp"] / (1e6 * PERIOD_S)).astype(int)
        for name, column in columns.items():
            if prefix + name in flown:
                ours = flown[prefix + name][places]
                same = ours.view(np.uint64) == column.astype(float).view(np.uint64)
                assert same.all(), (topic, name, columns["timestamp"][~same][0])
                compared += len(same)
    return compared


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--sitl", required=True)
    parser.add_argument("--library", required=True)
    arguments = parser.parse_args()
    folder = pathlib.Path(tempfile.mkdtemp())

    def sitl(*words):
        ended = subprocess.run([arguments.sitl, *words], capture_output=True, text=True)
        # A flight that loses the aircraft ends with 1.
        assert ended.returncode in ((0, 1) if words[0] == "fly" else (0,)), ended.stderr

    def pair(scenario, words):
        fmus = []
        for kind, option in [("plant", []), ("autopilot", ["--autopilot"])]:
            path = folder / f"{pathlib.Path(scenario).stem}_{kind}.fmu"
            to = ["--library", arguments.library, "--out", str(path)]
            sitl("aircraft", "fmu", "--scenario", scenario, *words, *option, *to)
            fmus.append(path)
        return fmus

    noisy = ["--set", "plant.sensors.grade=tactical", "--set", "plant.wind.turbulence_m_s=2"]
    # Its script breaks the aircraft, by the connection `fault`.
    chain = str(pathlib.Path(__file__).parents[2] / "scenarios" / "chain.toml")
    flights = [("case1", noisy, 3000), (chain, [], 3000), ("nominal", ["--airframe", "f16"], 1000)]
    for scenario, words, steps in flights:
        name = pathlib.Path(scenario).stem
        plant_file, autopilot_file = pair(scenario, words)
        plant, autopilot = Fmu(plant_file, folder), Fmu(autopilot_file, folder)
        flown = fly(plant, autopilot, steps)
        duration = ["--set", f"plant.duration_s={(steps - 1) * PERIOD_S}"]
        sitl("fly", scenario, *words, *duration, "--no-stop-at-loss", "--ulog", "--out", str(folder / name))
        values = equals_the_log(flown, folder / name / "flight.ulg")
        assert values > 10_000 and not plant.messages and not autopilot.messages
        print(f"{name} {' '.join(words)}: {values} values of {steps} steps are equal to the bit")

        broken = [n for n in flown if n.startswith("truth.fault_") and flown[n].any()]
        assert len(broken) == {"case1": 1, "chain": 2, "nominal": 0}[name], broken

        if name == "case1":
            # FMPy flies the plant alone, with the commands of the pair.
            commands = plant.names("input", "Float64")
            commands = [n for n in commands if n in flown]
            signals = np.zeros(steps, dtype=[("time", float)] + [(n, float) for n in commands])
            signals["time"] = np.arange(steps) * PERIOD_S
            for n in commands:
                signals[n] = flown[n]
            stop = (steps - 1) * PERIOD_S
            alone = fmpy.simulate_fmu(str(plant_file), input=signals, stop_time=stop, output_interval=PERIOD_S)
            for n in plant.names("output", "Float64"):
                assert (alone[n].view(np.uint64) == flown[n].view(np.uint64)).all(), n
            print("FMPy flies the plant alone to the same bits")

    plant_file = folder / "nominal_plant.fmu"
    other = Fmu(plant_file, folder, start_altitude_m=3000.0, seed=7, wind_east_m_s=10.0)
    assert abs(other.get("truth.altitude_m") - 3000.0) < 1e-6 and other.get("truth.wind_east_m_s") == 10.0
    plant = Fmu(plant_file, folder)
    plant.refused(lambda: plant.step(0.0, 0.003), "expected a multiple of the control period of 0.002 s")
    plant.refused(lambda: plant.step(0.0, 0.0), "expected a multiple")
    plant.refused(lambda: plant.step(1.0), "the communication point is 1 s; the time is 0 s")
    plant.refused(lambda: plant.set("fault", "rudder stuck at 300 deg"), "rudder stuck at 300 deg")
    plant.refused(lambda: plant.set("fault", "flap stuck"), "flap")
    plant.refused(lambda: plant.set("seed", 8), "cannot set a parameter")
    plant.refused(lambda: plant.set("truth.altitude_m", 8.0), "only parameters and inputs")

    plant.step(0.0, 5 * PERIOD_S)
    state = plant.slave.getFMUState()
    plant.set("fault", "rudder stuck at 10 deg; after 10 ms: left elevator 50 % left")
    plant.set("wind_north_m_s", 3.0)
    plant.step(0.01, 10 * PERIOD_S)
    assert plant.get("truth.position_rudder_rad") == np.radians(10.0)
    assert plant.get("truth.fault_left_elevator") > 0 and plant.get("truth.wind_north_m_s") == 3.0
    broken = plant.access("get", plant.names("output", "Float64"))
    plant.slave.setFMUState(state)
    assert plant.get("time") == 0.01 and plant.get("truth.fault_rudder") == 0
    plant.set("fault", "rudder stuck at 10 deg; after 10 ms: left elevator 50 % left")
    plant.set("wind_north_m_s", 3.0)
    plant.step(0.01, 10 * PERIOD_S)
    assert plant.access("get", plant.names("output", "Float64")) == broken
    plant.slave.freeFMUState(state)
    plant.set("fault", "clear all")
    plant.step(0.03)
    assert plant.get("truth.fault_rudder") == 0
    # Straight down: the flight ends on the ground.
    plant.set("fault", "left elevator stuck at 20 deg; right elevator stuck at 20 deg")
    time_s = 0.032
    while not plant.step(time_s, 0.1)[1]:
        time_s += 0.1
        assert time_s < 100.0, "it never lands"
    assert plant.get("truth.on_ground") == 1.0
    plant.slave.terminate()
    plant.slave.freeInstance()
    print("refusals, states, faults, wind and the ground are as they should be")


main()
