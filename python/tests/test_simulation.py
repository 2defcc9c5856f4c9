"""Flights that Python steps."""

import copy
import os
import threading

import numpy as np
import pytest

import two_step


@pytest.fixture
def sim():
    return two_step.Simulation("nominal", seed=3, set={"plant.wind.turbulence_m_s": 1.0, "plant.duration_s": 30.0})


def test_it_flies_the_bits_of_fly(sim):
    flight = two_step.fly("nominal", seed=3, set={"plant.wind.turbulence_m_s": 1.0, "plant.duration_s": 2.0})
    altitudes = [sim.truth["altitude_m"]]
    for _ in range(200):
        sim.step(5)
        altitudes.append(sim.truth.altitude_m)
    assert np.array(altitudes).tobytes() == flight.tables["truth"]["altitude_m"].tobytes()
    assert sim.state["z2_pitch_rad_s2"] == flight.tables["control"]["z2_pitch_rad_s2"][-1]


def test_a_copy_and_a_restored_simulation_continue_with_the_same_bits(sim):
    sim.step(700)
    sim.fail("left elevator", stuck_deg=20, after_s=0.5)
    saved = sim.copy()
    sim.step(2000)
    end = sim.truth.values().tobytes()
    for other in (saved, copy.deepcopy(saved)):
        twin = other.copy()
        twin.step(2000)
        assert twin.truth.values().tobytes() == end
    sim.restore(saved)
    assert sim.time_s == saved.time_s == 1.4
    sim.step(2000)
    assert sim.truth.values().tobytes() == end


def test_reset_begins_anew_and_a_seed_decides_the_air(sim):
    sim.step(500)
    first = sim.truth.values().tobytes()
    sim.reset()
    assert sim.time_s == 0.0
    sim.step(500)
    assert sim.truth.values().tobytes() == first
    sim.reset(4)
    sim.step(500)
    assert sim.truth.values().tobytes() != first


def test_a_jam_begins_when_and_where_it_is_ordered_and_is_cleared(sim):
    sim.fail("left elevator", stuck_deg=30, after_s=3)
    sim.step(1499)
    assert abs(sim.truth["position_left_elevator_rad"]) < 0.1
    sim.step(3)
    assert sim.truth["position_left_elevator_rad"] == pytest.approx(np.deg2rad(30))
    sim.step(1000)
    assert sim.state["compensator_active"] == 1
    sim.clear("left elevator")
    sim.step(500)
    assert sim.truth["fault_left_elevator"] == 0 and abs(sim.truth["position_left_elevator_rad"]) < 0.2
    sim.fail("gnss", kind="off")
    sim.fail("rudder 50 % left")
    sim.fail("engine", kind="partial_loss", remaining_percent=50)
    sim.clear()
    sim.step()


def test_references_are_followed(sim):
    sim.refer(altitude_m=5100, roll_deg=15)
    sim.step(8000)
    assert sim.truth.roll_rad == pytest.approx(np.deg2rad(15), abs=0.1) and sim.truth.altitude_m > 5040


def test_a_controller_outside_moves_what_the_plant_obeys(sim):
    sim.act({"rudder": 0.1})
    sim.step()
    assert sim.truth["position_rudder_rad"] > 0.001
    values = sim.commands.values()
    values[:] = 0.0
    sim.act(values)
    assert sim.commands["rudder_rad"] == 0.0


def test_the_end_of_a_flight_is_the_end():
    sim = two_step.Simulation("nominal", set={"plant.duration_s": 0.1})
    assert sim.step(50) and not sim.step() and sim.is_over
    for call in (sim.step, lambda: sim.act({"rudder": 0.0}), lambda: sim.fail("rudder stuck")):
        with pytest.raises(RuntimeError, match="the flight is over"):
            call()
    sim.reset()
    assert sim.step()


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda s: s.fail("left elevator", stuck_deg=90), ValueError, "90 deg is outside -30 to 30 deg"),
        (lambda s: s.fail("left elevator stuck at 90 deg"), ValueError, "90 deg is outside -30 to 30 deg"),
        (lambda s: s.fail("flap", stuck_deg=3), ValueError, "left_aileron"),
        (lambda s: s.fail("rudder", stuck_deg=3, after_s=-1), ValueError, "after_s = -1"),
        (lambda s: s.fail("rudder", stuck_deg=3, after_s=float("nan")), ValueError, "after_s = NaN"),
        (lambda s: s.fail("rudder", stuck_deg=float("nan")), ValueError, "NaN"),
        (lambda s: s.fail("rudder", kind="zz"), ValueError, "zz"),
        (lambda s: s.clear("flap"), ValueError, "`flap` found, expected `all` or an effector"),
        (lambda s: s.refer(altitude_m=1e9), ValueError, "outside 500.0 to 12000.0 m"),
        (lambda s: s.refer(roll_deg=float("nan")), ValueError, "NaN"),
        (lambda s: s.act([1, 2]), ValueError, "2 numbers; the aircraft has 8 effectors"),
        (lambda s: s.act({"left_elevator": float("inf")}), ValueError, "left_elevator = inf"),
        (lambda s: s.act({"flap": 1.0}), KeyError, "the effectors are left_aileron"),
        (lambda s: s.act("x"), TypeError, "commands"),
        (lambda s: s.step(0), ValueError, "count = 0; expected at least 1"),
        (lambda s: s.step("a"), TypeError, ""),
        (lambda s: s.reset(-1), ValueError, "seed = -1"),
        (lambda s: s.state["x"], KeyError, "altitude_m"),
        (lambda s: s.truth.x, AttributeError, "no signal"),
        (lambda s: s.restore(3), TypeError, ""),
        (lambda s: s.restore(two_step.Simulation("nominal", airframe="f16")), ValueError, "another aircraft"),
    ],
)
def test_what_is_refused_changes_nothing(sim, call, error, words):
    sim.step(10)
    twin = sim.copy()
    with pytest.raises(error) as refused:
        call(sim)
    assert words in str(refused.value)
    twin.step(10)
    sim.step(10)
    assert sim.truth.values().tobytes() == twin.truth.values().tobytes()


def test_threads_and_forks_fly_the_same_bits(sim):
    def end(simulation):
        simulation.step(1000)
        return simulation.truth.values().tobytes()

    copies = [sim.copy() for _ in range(4)]
    ends = [None] * 4

    def fly(place):
        ends[place] = end(copies[place])

    threads = [threading.Thread(target=fly, args=(place,)) for place in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    two_step.fly("nominal", seed=range(0, 4), rows=False, set={"plant.duration_s": 1.0})  # threads of this process
    here = end(sim.copy())
    assert ends == [here] * 4
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        again = two_step.fly("nominal", seed=range(0, 4), rows=False, set={"plant.duration_s": 1.0})
        os.write(write, end(sim) if len(again) == 4 else b"")
        os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        assert pipe.read() == here
    assert os.waitpid(child, 0)[1] == 0
