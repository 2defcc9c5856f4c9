"""Whole flights: the bits of the command line, tables without copies, and refusals."""

import csv
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import two_step

SHORT = {"plant.duration_s": 8.0}


def test_a_flight_has_the_bits_of_the_command_line(sitl, out):
    options = ["--seed", "7", "--set", "plant.wind.turbulence_m_s=2.0", "--set", "plant.duration_s=8.0"]
    sitl("fly", "case1", *options, "--out", out)
    flight = two_step.fly("case1", seed=7, set={"plant.wind.turbulence_m_s": 2.0, **SHORT})
    with (out / "flight.csv").open() as file:
        rows = list(csv.reader(file))
    assert flight.table.names == rows[0]
    for place, name in enumerate(rows[0]):
        column = np.array([float(row[place]) for row in rows[1:]])
        assert column.tobytes() == flight[name].tobytes(), name
    outcome = json.loads((out / "outcome.json").read_text())
    assert (flight.kept, flight.end_s, flight.steps) == (
        outcome["outcome"] == "kept",
        outcome["end_s"],
        outcome["control_steps"],
    )
    assert {name: metric["value"] for name, metric in outcome["metrics"].items()} == flight.metrics


def test_case_1_of_the_paper_is_survived_with_the_compensator_and_lost_without():
    assert two_step.fly("case1").kept
    lost = two_step.fly("case1", ftc="off", rows=False)
    assert not lost.kept and lost.lost_by and 3.0 < lost.lost_at_s < 60.0 and lost.table is None


def test_seeds_fly_on_all_cores_with_the_same_bits_as_alone():
    options = {"set": {"plant.wind.turbulence_m_s": 3.0, **SHORT}, "rows": False}
    together = two_step.fly("case1", seed=range(5, 9), **options)
    assert together == [two_step.fly("case1", seed=seed, **options) for seed in range(5, 9)]


def test_the_table_is_taken_by_numpy_pandas_polars_and_pyarrow():
    pandas, polars, pyarrow = map(pytest.importorskip, ("pandas", "polars", "pyarrow"))
    table = two_step.fly("nominal", set={"plant.duration_s": 1.0}).table
    column = table["altitude_m"]
    assert column.base is not None and not column.flags.writeable
    assert np.shares_memory(column, table["altitude_m"])
    as_pandas, as_polars, as_arrow = table.to_pandas(), table.to_polars(), pyarrow.table(table)
    for others in (as_pandas["altitude_m"].to_numpy(), as_polars["altitude_m"].to_numpy()):
        assert np.array_equal(others, column)
    assert as_arrow.num_rows == len(table) == 101
    address = as_arrow["altitude_m"].chunk(0).buffers()[1].address
    assert address == column.__array_interface__["data"][0], "a copy"
    assert isinstance(as_pandas, pandas.DataFrame) and isinstance(as_polars, polars.DataFrame)


def test_faults_replace_those_of_the_scenario():
    healthy = two_step.fly("case1", faults=[], set=SHORT)
    assert healthy.metrics["fault_at"] is None
    line = two_step.fly("nominal", faults=["at 3 s: left elevator stuck at 30 deg"], set=SHORT)
    keys = {"effector": "left_elevator", "kind": "stuck_at", "angle_deg": 30, "onset_s": 3}
    assert line.metrics == two_step.fly("nominal", faults=[keys], set=SHORT).metrics
    assert np.rad2deg(line["left_elevator_rad"][-1]) == pytest.approx(30.0)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"law": "x"}, ValueError, "there is no law x; the laws are pid"),
        ({"law": 3}, TypeError, "law: expected a name or a callable, not 3"),
        ({"foo": 1}, TypeError, "--foo"),
        ({"airframe": "zz"}, ValueError, "tvc_jet, tvc_jet_mach, f16, aerosonde"),
        ({"period_ms": 9}, ValueError, "9 is not a number from 1 to 4"),
        ({"period_ms": float("nan")}, ValueError, "NaN is not a number from 1 to 4"),
        ({"seed": -1}, ValueError, "-1 is not a whole number"),
        ({"seed": range(3, 1)}, ValueError, "at least one number"),
        ({"seed": range(0, 8, 2)}, ValueError, "step 1"),
        ({"set": {"plant.x": 3}}, ValueError, "there is no such key"),
        ({"set": [1]}, ValueError, "1 is not KEY=VALUE"),
        ({"faults": "x"}, TypeError, "faults: expected a list"),
        ({"faults": [3]}, TypeError, ""),
        ({"faults": ["left elevatr stuck"]}, ValueError, "expected an effector: left aileron"),
        ({"faults": ["left elevator stuck at 60 deg"]}, ValueError, "60 deg is outside -30 to 30 deg"),
        ({"faults": ["when roll passes 3 deg: rudder stuck"]}, ValueError, "a script can do that"),
        ({"faults": [{"effector": "rudder", "kind": "stuck_at", "onset_s": 1}]}, ValueError, "angle_deg"),
    ],
)
def test_what_cannot_be_flown_is_refused_by_name_value_and_range(options, error, words):
    with pytest.raises(error) as refused:
        two_step.fly("case1", **options)
    assert words in str(refused.value)


def test_an_unknown_scenario_is_refused():
    with pytest.raises(ValueError, match="the scenarios are nominal, case1"):
        two_step.fly("case9")


def test_ctrl_c_ends_flights_and_leaves_the_interpreter_well():
    script = (
        "import signal, two_step\n"
        # A shell's jobs in the background ignore it.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "print('begins', flush=True)\n"
        "try:\n"
        "    two_step.fly('nominal', seed=range(0, 90000), rows=False)\n"
        "except KeyboardInterrupt:\n"
        "    print('interrupted', two_step.fly('nominal', set={'plant.duration_s': 1.0}).kept)\n"
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as child:
        try:
            assert child.stdout.readline() == "begins\n"
            # Until it flies: its threads run then.
            while len(list(Path(f"/proc/{child.pid}/task").iterdir())) < 3:
                time.sleep(0.01)
            child.send_signal(signal.SIGINT)
            assert child.communicate(timeout=120)[0] == "interrupted True\n"
            assert child.returncode == 0
        finally:
            child.kill()
