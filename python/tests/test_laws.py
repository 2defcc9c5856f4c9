"""Laws in Python: main controllers and compensators."""

import threading
import traceback

import numpy as np
import pytest

import two_step

SHORT = {"plant.duration_s": 4.0}


class Cascade:
    """Altitude by climb rate and pitch rate, roll by roll rate, airspeed by thrust; two integrals that trim."""

    def __init__(self):
        self.elevator_rad = self.thrust_m_s2 = 0.0
        self.steps = 0

    def __call__(self, state):
        self.steps += 1
        climb_m_s = min(max(0.2 * (state.altitude_reference_m - state.altitude_m), -40.0), 40.0)
        climb_error = climb_m_s - state.climb_rate_m_s
        speed_error = state.airspeed_reference_m_s - state.airspeed_m_s
        h = state.period_s
        self.elevator_rad = min(max(self.elevator_rad - 0.0002 * climb_error * h, -0.1), 0.1)
        self.thrust_m_s2 = min(max(self.thrust_m_s2 + 0.02 * speed_error * h, -4.0), 4.0)
        return two_step.Command(
            aileron_rad=1.5 * (state.roll_rad - state.roll_reference_rad) + 0.5 * state.p_rad_s,
            elevator_rad=state.trim_elevator_rad
            - 0.003 * climb_error
            + 1.2 * state.q_rad_s
            + 1.0 * (state.pitch_rad - state.trim_pitch_rad)
            + self.elevator_rad,
            rudder_rad=0.2 * state.r_rad_s,
            thrust_n=state.trim_thrust_n + state.mass_kg * (0.3 * speed_error + self.thrust_m_s2),
        )


class Copied(Cascade):
    def __deepcopy__(self, memo):
        other = Copied()
        other.__dict__.update(self.__dict__)
        return other


def proportional(state):
    """Against the estimated roll acceleration, by the ailerons alone."""
    return two_step.Compensation(aileron_rad=0.05 * state.z2_roll_rad_s2)


def test_a_law_of_the_examples_flies_as_in_rust():
    """examples/own_law.rs has the same law; `cargo run --example own_law -- fly case1` keeps the aircraft too."""
    flight = two_step.fly("case1", law=Cascade)
    assert flight.kept and flight["altitude_m"][-1] == pytest.approx(6000, abs=20)


def test_each_flight_has_a_law_of_its_own():
    flights = two_step.fly("case1", law=Cascade, seed=range(0, 3), rows=False, set=SHORT)
    assert flights == [two_step.fly("case1", law=Cascade, seed=seed, rows=False, set=SHORT) for seed in range(3)]


def test_an_instance_is_reset_and_needs_a_copy_for_several_flights():
    class Counting(Cascade):
        resets = 0

        def reset(self):
            type(self).resets += 1

    two_step.fly("nominal", law=Counting(), set=SHORT)
    assert Counting.resets == 1
    with pytest.raises(TypeError, match="give the class, or give its instances __deepcopy__"):
        two_step.fly("nominal", law=Counting(), seed=range(2), set=SHORT)


def test_a_simulation_with_a_law_is_copied_where_the_law_can_be():
    sim = two_step.Simulation("case1", law=Copied())
    sim.step(2000)
    twin = sim.copy()
    sim.step(1000)
    twin.step(1000)
    assert sim.truth.values().tobytes() == twin.truth.values().tobytes()
    with pytest.raises(TypeError, match="__deepcopy__"):
        two_step.Simulation("case1", law=Cascade).copy()


def test_a_compensator_acts_beside_the_main_controller_when_the_detector_wakes_it():
    flight = two_step.fly("case1", compensator=proportional, set={"plant.duration_s": 6.0})
    control = flight.tables["control"]
    demand, awake = control["compensation_aileron_rad"], control["fade"]
    assert np.all(demand[awake == 0] == 0) and np.any(demand != 0)
    whole = (awake == 1) & (flight["t_s"] < 6.0)
    assert np.allclose(demand[whole], 0.05 * control["z2_roll_rad_s2"][whole], rtol=1e-12)


def test_one_law_can_be_both():
    both = two_step.fly("case1", law=Cascade, compensator=proportional, set=SHORT)
    assert np.any(both.tables["control"]["compensation_aileron_rad"] != 0)
    assert both["main_aileron_rad"][-1] != two_step.fly("case1", compensator=proportional, set=SHORT)["main_aileron_rad"][-1]


def test_an_exception_reaches_the_caller_with_its_traceback():
    def fails(state):
        if state.time_s > 1.0:
            return {}["no such key"]
        return two_step.Command(thrust_n=state.trim_thrust_n)

    for fly in (
        lambda: two_step.fly("nominal", law=fails),
        lambda: two_step.fly("nominal", law=fails, seed=range(3)),
        lambda: two_step.Simulation("nominal", law=fails).step(5000),
        lambda: two_step.campaign.run("smoke", laws={"fails": fails}, samples=1),
    ):
        with pytest.raises(KeyError, match="no such key") as raised:
            fly()
        assert any(frame.name == "fails" for frame in traceback.extract_tb(raised.value.__traceback__))


def test_an_exception_ends_no_flight_of_another_thread():
    begun, raised = threading.Event(), threading.Event()

    def waits(state):
        begun.set()
        assert raised.wait(60)
        return two_step.Command(thrust_n=state.trim_thrust_n)

    def fails(state):
        raise KeyError("its own")

    short = {"plant.duration_s": 2.0}
    flights = []
    other = threading.Thread(target=lambda: flights.append(two_step.fly("nominal", law=waits, set=short)))
    other.start()
    assert begun.wait(60)
    with pytest.raises(KeyError, match="its own"):
        two_step.fly("nominal", law=fails, set=short)
    raised.set()
    other.join()
    assert flights[0].end_s == 2.0


@pytest.mark.parametrize(
    ("answer", "error", "words"),
    [
        (None, TypeError, "the law returned None; expected a two_step.Command"),
        ((1, 2), TypeError, "expected a two_step.Command"),
        (two_step.Command(elevator_rad=float("nan")), ValueError, "elevator_rad = NaN; expected a finite number"),
        (two_step.Compensation(), TypeError, "expected a two_step.Command"),
    ],
)
def test_a_law_that_returns_nonsense_is_refused(answer, error, words):
    with pytest.raises(error, match=words):
        two_step.fly("nominal", law=lambda state: answer)


def test_a_law_cannot_step_its_own_simulation():
    held = []

    def steps(state):
        held[0].step() if held else None
        return two_step.Command(thrust_n=state.trim_thrust_n)

    sim = two_step.Simulation("nominal", law=steps)
    held.append(sim)
    with pytest.raises(RuntimeError, match="in use"):
        sim.step()


def test_a_law_flies_in_a_campaign_under_its_name_and_in_margins(out):
    result = two_step.campaign.run("smoke", laws={"mine": Cascade}, samples=1, out=out)
    assert "mine" in set(result["runs"]["law"]) and "mine" in set(result["summary"]["law"])
    beside = two_step.campaign.run(
        "smoke", compensators={"ailerons": proportional}, own_set={"ailerons": {"FTC_MODE": 2}}, samples=1
    )
    assert "ailerons" in set(beside["runs"]["law"])
    loops = two_step.margins(law=Copied, compensator="neso", no_flights=True)
    assert set(loops["margins"]["law"]) == {"Copied"} and "Copied" in loops.text
    assert np.nanmin(loops["margins"]["phase_deg"]) > 0 and loops["eigenvalues"]["real_rad_s"].max() < 0
    with pytest.raises(ValueError, match="cannot be copied"):
        two_step.margins(law=Cascade, compensator="neso")
    with pytest.raises(ValueError, match="own_set: 'b'; expected the name of a law in Python: a"):
        two_step.campaign.run("smoke", laws={"a": Cascade}, own_set={"b": {}})


def test_laws_of_a_campaign_fly_beside_each_other():
    laws = {"class": Copied, "ailerons": proportional}
    both = two_step.campaign.run(
        "smoke", laws={"class": Copied}, compensators={"ailerons": proportional}, samples=1
    )["runs"].to_pandas()
    for name, law in laws.items():
        role = "compensators" if name == "ailerons" else "laws"
        alone = two_step.campaign.run("smoke", samples=1, **{role: {name: law}})["runs"].to_pandas()
        columns = [column for column in alone if column != "run"]
        one, other = (runs[runs["law"] == name][columns].reset_index(drop=True) for runs in (both, alone))
        assert len(one) and one.equals(other), name
