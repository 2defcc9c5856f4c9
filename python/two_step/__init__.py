"""Flights of an aircraft that breaks: dynamics, faults, autopilot and campaigns of Two-Step.

>>> import two_step
>>> flight = two_step.fly("case1")
>>> flight.kept, round(flight.metrics["altitude_rmse"])
(True, 310)
>>> flight["altitude_m"][-1] > 5900
True

Angles are rad, times s, lengths m, forces N where a name does not say otherwise; the last words of a name are its unit.
Axes and signs are those of the flight log: body axes x forward, y right, z down; a positive deflection is trailing edge down
for ailerons and elevators, left for the rudder.
"""

from two_step import campaign
from two_step._native import Command, Compensation, LawState, Signals, Simulation, Table, __version__
from two_step.commands import design_lqr, fmu, linearize, margins, new_aircraft, read_log, replay, study, trimmable
from two_step.flights import Flight, fly

__all__ = [
    "Command",
    "Compensation",
    "Flight",
    "LawState",
    "Signals",
    "Simulation",
    "Table",
    "Vehicle",
    "campaign",
    "design_lqr",
    "fly",
    "fmu",
    "linearize",
    "margins",
    "new_aircraft",
    "read_log",
    "replay",
    "study",
    "trimmable",
]


def __getattr__(name):
    # It needs what few flights need.
    if name == "Vehicle":
        from two_step.vehicle import Vehicle

        return Vehicle
    raise AttributeError(f"module 'two_step' has no attribute {name!r}")
