"""Vehicles in flight: `two_step.Vehicle` and the fixture `two_step_vehicle`.

No test waits for a wall time: each waits for a condition, so that a busy machine only makes them slower.
"""

import os
import select
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import two_step
from two_step.vehicle import VehicleError

pytest_plugins = ["pytester"]
EXAMPLE = Path(__file__).parents[2] / "examples" / "test_ground_station.py"
PAGE = Path(__file__).parents[2] / "docs" / "test-your-gcs.md"


@pytest.fixture(scope="module")
def paused():
    """A vehicle that stands still; the tests that share it leave it so."""
    with two_step.Vehicle(paused=True, speed="max") as vehicle:
        yield vehicle


def test_two_vehicles_fly_at_once_at_ports_of_their_own():
    with two_step.Vehicle(speed="max") as first, two_step.Vehicle(airframe="f16", speed="max") as second:
        assert first.address != second.address
        for vehicle in (first, second):
            begin_s = vehicle.time_s
            vehicle.wait(lambda v: v.time_s > begin_s + 2.0, what="two seconds of flight")
            assert vehicle["plant"] == "flying"
        assert first.connection.target_system == second.connection.target_system == 1
    assert first.log != second.log and first.log.stat().st_size > 0 and second.log.stat().st_size > 0


def test_the_log_is_one_of_the_flight_and_goes_with_the_vehicle():
    with two_step.Vehicle(speed="max") as vehicle:
        onset_s = vehicle.fail("rudder", stuck_deg=3)
    log = vehicle.log
    assert onset_s > 0.0 and two_step.read_log(log).tables
    del vehicle
    assert not log.exists()


def test_a_fault_acts_is_compensated_and_is_repaired():
    with two_step.Vehicle(paused=True, speed="max") as vehicle:
        assert vehicle.fail("left elevator stuck at 30 deg") == vehicle.time_s == 0.0
        vehicle.run()
        vehicle.wait(lambda v: v["compensator_active"], timeout_s=5, what="the compensator")
        assert [fault["what"] for fault in vehicle["faults"]] == ["left elevator stuck at 30.0 deg"]
        assert any(text.startswith("Injected: left elevator stuck at 30.0 deg") for text in vehicle.messages)
        assert "healthy since" in vehicle.clear("left elevator")
        vehicle.wait(lambda v: not v["faults"] and not v["compensator_active"], timeout_s=60, what="the release")


@pytest.mark.parametrize(
    ("fault", "how", "listed"),
    [
        ("left elevator", {"stuck_deg": -12.5}, "left elevator stuck at -12.5 deg"),
        ("rudder drifting 1 deg/s, ramp 2 s", {}, "rudder drifting 1.00 deg/s"),
        ("engine limited to 20 kN", {}, "engine limited to 20.0 kN"),
        ("nozzle pitch intermittent 30 % of 0.4 s", {}, "nozzle pitch intermittent 30 % of 0.4 s"),
        ("left elevator stuck at 3 deg at the actuator's rate", {}, "left elevator stuck at 3.0 deg"),
        ("rudder stuck", {}, "rudder stuck"),
        ("right aileron hard over negative", {}, "right aileron hard over negative"),
        ("servo 1 50 % left, for 3 s, every 8 s, 10 times", {}, "left aileron 50 % left"),
        ("nozzle yaw oscillating 5 deg at 2 Hz", {}, "nozzle yaw oscillating 5.0 deg at 2 Hz"),
        ("nozzle yaw delayed by 200 ms", {}, "nozzle yaw delayed by 200 ms"),
        ("Engine flame-out", {}, "engine flame-out"),
        ("gnss off, for 10 s", {}, "gnss off"),
        ("pitot biased by -3000 Pa", {}, "pitot biased by -3000"),
        ("engine monitor noisy by 2 kN", {}, "engine monitor noisy by 2"),
        ("left wing torn off by 20 %", {}, "left wing torn off by 20 %"),
    ],
)
def test_a_fault_is_the_one_that_its_words_mean(paused, fault, how, listed):
    assert paused.fail(fault, **how) == paused.time_s
    paused.wait(lambda v: v["faults"], what="the fault in the state")
    assert paused["faults"][0]["what"].startswith(listed)
    paused.clear()
    paused.wait(lambda v: not v["faults"], what="the repair in the state")


def test_a_refusal_has_the_reason(paused):
    with pytest.raises(VehicleError, match="left elevator: angle 70 deg is outside -30 to 30 deg"):
        paused.fail("left elevator", stuck_deg=70)
    with pytest.raises(VehicleError, match="`wobbles` found, expected a kind of fault: stuck"):
        paused.fail("rudder wobbles")
    with pytest.raises(VehicleError, match="`flap` found, expected `all` or an effector: left aileron"):
        paused.clear("flap")
    with pytest.raises(VehicleError, match="for triggers there are scripts"):
        paused.fail("at 3 s: rudder stuck")
    paused.fail("rudder", stuck_deg=3)
    with pytest.raises(VehicleError, match="nothing changed, the same fault is there"):
        paused.fail("rudder", stuck_deg=3)
    paused.clear("rudder")
    with pytest.raises(VehicleError, match="there is no command \"dance\""):
        paused.shell("dance")
    assert paused.clear("rudder") == "no active fault"


@pytest.mark.parametrize("period_ms", [2.0, 1.3])
def test_time_stands_still_and_steps_are_exact(period_ms):
    with two_step.Vehicle(speed="max", period_ms=period_ms, paused=True) as vehicle:
        assert vehicle.time_s == 0.0
        vehicle.run()
        vehicle.wait(lambda v: v.time_s > 1.0, what="a second of flight")
        vehicle.pause()
        before = vehicle.state
        # An answer of the aircraft comes with a later packet of the plant.
        vehicle.clear()
        assert vehicle.state == before
        for periods in (1, 5, 250):
            begin_s = vehicle.time_s
            vehicle.step(periods)
            assert vehicle.time_s == vehicle["time_s"] == pytest.approx(begin_s + periods * period_ms / 1e3, abs=1e-9)
        with pytest.raises(ValueError, match="periods is 0; it must be a whole number from 1 to 100000"):
            vehicle.step(0)
        with pytest.raises(ValueError, match='speed is 2000; it must be between 0.01 and 1000, or "max"'):
            vehicle.run(2000)
        # A new flight begins at zero.
        vehicle.connection.mav.command_long_send(1, 1, 246, 0, 1, 0, 0, 0, 0, 0, 0)
        vehicle.wait(lambda v: v.time_s == 0.0, what="a new flight")
        vehicle.pause()
        vehicle.step(3)
        assert vehicle.time_s == pytest.approx(3 * period_ms / 1e3, abs=1e-9)
        begin_s = vehicle.time_s
        vehicle.run(speed=5)
        vehicle.wait(lambda v: v.time_s > begin_s + 0.5, what="half a second more")


def test_a_wait_ends_with_its_condition_or_its_time():
    with two_step.Vehicle(speed="max") as vehicle:
        vehicle.shell("reference altitude 5100")
        assert vehicle.wait(lambda v: v["altitude_m"] > 5050.0 and v.time_s, timeout_s=120, what="5050 m") > 0.0
        begin_s = vehicle.time_s
        with pytest.raises(TimeoutError, match="the mode Hold: not within 3 s; time_s .*mode Position"):
            vehicle.wait(lambda v: v["mode"] == "Hold", timeout_s=3.0, what="the mode Hold")
        assert vehicle.time_s > begin_s + 3.0


def test_a_flight_ends_with_its_duration_and_says_so():
    with two_step.Vehicle("case1", speed="max", until_s=5) as vehicle:
        with pytest.raises(VehicleError, match="the flight is over: time_s "):
            vehicle.wait(lambda v: v["mode"] == "Hold")
        with pytest.raises(VehicleError, match="the flight is over"):
            vehicle.pause()


def test_a_dead_process_is_noticed_with_what_it_wrote():
    with two_step.Vehicle() as vehicle:
        vehicle._processes["autopilot"].kill()
        with pytest.raises(VehicleError, match="autopilot has ended with status -9: .*INFO"):
            vehicle.wait(lambda v: False, timeout_s=1e6)
        with pytest.raises(VehicleError, match="autopilot has ended"):
            vehicle.shell("status")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"scenario": "nothing"}, "--scenario nothing: .*the scenarios are nominal, case1"),
        ({"speed": 0}, "--speed .* from 0.01 to 1000"),
        ({"airframe": "kite"}, "--model kite: .*f16"),
        ({"airframe": "kite.toml"}, "--airframe kite.toml: .*f16"),
        ({"script": "nope.txt"}, "--script nope.txt: No such file"),
        ({"params": {"NOPE": 1}}, "there is no parameter NOPE"),
        ({"seed": -1}, "--seed .*-1 is not a whole number from 0"),
    ],
)
def test_a_wrong_option_is_refused_with_its_value_and_what_is_allowed(options, words):
    with pytest.raises(ValueError, match=words):
        two_step.Vehicle(**options)


def test_an_unknown_option_is_named_beside_the_known_ones():
    with pytest.raises(TypeError, match="no option 'altitude'; further ones are allocation"):
        two_step.Vehicle(altitude=3000)


def test_options_reach_both_processes(tmp_path):
    script = tmp_path / "say.txt"
    script.write_text("say Hello\n")
    with two_step.Vehicle(airframe="f16", law="lqr", params={"MAV_SYS_ID": 7}, script=script, speed=10, log_dir=tmp_path) as vehicle:
        vehicle.wait(lambda v: any("Hello" in text for text in v.messages), what="the script's text")
        assert vehicle.connection.target_system == 7
        assert vehicle.shell("param get CTL_LAW").split()[1] == "3"
    assert vehicle.log.parent == tmp_path


PARENT = """
    import sys, two_step
    vehicle = two_step.Vehicle(speed=1, log_dir=sys.argv[1])
    print(*(process.pid for process in vehicle._processes.values()), flush=True)
    sys.stdin.read()
"""


def test_a_killed_parent_leaves_no_process(tmp_path):
    parent = subprocess.Popen([sys.executable, "-c", textwrap.dedent(PARENT), tmp_path], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    children = [os.pidfd_open(int(pid)) for pid in parent.stdout.readline().split()]
    assert len(children) == 2
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    for child in children:
        # Ready when the process has ended; the time limit is that of a machine that stands still.
        ready = _wait_readable(child, 60.0)
        os.close(child)
        assert ready
    parent.stdin.close()
    parent.stdout.close()


def test_a_vehicle_that_nobody_closed_ends_with_its_program_and_leaves_no_file():
    program = "import two_step; vehicle = two_step.Vehicle(); print(vehicle.log, flush=True)"
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert ended.stderr == "" and not Path(ended.stdout.strip()).parent.exists()


def _wait_readable(descriptor, timeout_s):
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return bool(poll.poll(timeout_s * 1000.0))


FLIGHTS = """
    def test_kept(two_step_vehicle):
        two_step_vehicle(speed="max").fail("rudder floating")
        assert False

    def test_removed(two_step_vehicle):
        first, second = two_step_vehicle(speed="max"), two_step_vehicle(speed="max")
        assert first.log.exists() and second.log.exists()
"""


def test_the_fixture_keeps_the_logs_of_failed_tests_only_and_shows_their_path(pytester, monkeypatch):
    pytester.makepyfile(textwrap.dedent(FLIGHTS))
    result = pytester.runpytest_subprocess(*_plugin(), "--two-step-logs", "logs")
    result.assert_outcomes(failed=1, passed=1)
    [log] = (pytester.path / "logs").glob("*/*.ulg")
    assert log.parent.name == "test_kept-0"
    result.stdout.fnmatch_lines(["*two_step vehicle 0*", f"flight log: {log}", "*Injected: rudder float*"])
    assert [folder.name for folder in (pytester.path / "logs").iterdir()] == ["test_kept-0"]


def test_the_plugin_is_light_to_load(pytester):
    pytester.makepyfile("import sys\ndef test_light():\n    assert not {'numpy', 'pymavlink', 'two_step.vehicle'} & set(sys.modules)")
    pytester.runpytest_subprocess(*_plugin()).assert_outcomes(passed=1)


def test_the_example_passes_and_is_the_one_of_the_page(pytester):
    assert EXAMPLE.read_text() in PAGE.read_text()
    pytester.runpytest_subprocess(*_plugin(), EXAMPLE).assert_outcomes(passed=1)


def _plugin():
    """Options that load the plugin once, whether or not the package is installed."""
    from importlib.metadata import entry_points

    is_installed = any(point.value == "two_step.pytest_plugin" for point in entry_points(group="pytest11"))
    return [] if is_installed else ["-p", "two_step.pytest_plugin"]
