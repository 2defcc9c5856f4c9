"""Whole flights."""

import json
from dataclasses import dataclass, field

from two_step import _native


@dataclass(frozen=True)
class Flight:
    """What became of a flight, and its signals.

    ``flight["altitude_m"]`` is a column of ``table``, the columns of ``flight.csv``. ``tables`` has further signals by name:
    ``truth``, ``control`` (what autopilot and laws computed) and ``sensors``, at most a hundred rows a second.
    """

    seed: int
    #: Whether the aircraft flew to the end within its limits.
    kept: bool
    #: When, s, and how it was lost; None where it was kept.
    lost_at_s: float | None
    lost_by: str | None
    #: Simulation time at the end, s, and control steps flown.
    end_s: float
    steps: int
    #: Measures by name, None where the flight had nothing to measure; their units by name, "1" of a ratio.
    metrics: dict[str, float | None] = field(repr=False)
    units: dict[str, str] = field(repr=False)
    #: Sensors that the estimator gave up: name, time, s, and why.
    sensors_lost: list[dict]
    #: The first touchdown of a flight over a ground: rate of descent, place on the runway, angles.
    touchdown: dict | None = None
    tables: dict[str, _native.Table] = field(default_factory=dict, repr=False)

    @property
    def table(self):
        """The signals of ``flight.csv``; None of a flight that kept no rows."""
        return self.tables.get("flight")

    def __getitem__(self, name):
        if self.table is None:
            raise KeyError(f"{name!r}: this flight kept no rows")
        return self.table[name]

    @classmethod
    def _of(cls, outcome, tables=()):
        metrics = outcome["metrics"]
        return cls(
            seed=outcome["seed"],
            kept=outcome["outcome"] == "kept",
            lost_at_s=outcome["lost_at_s"],
            lost_by=outcome["lost_by"],
            end_s=outcome["end_s"],
            steps=outcome["control_steps"],
            metrics={name: metric["value"] for name, metric in metrics.items()},
            units={name: metric["unit"] for name, metric in metrics.items()},
            sensors_lost=outcome.get("sensors_lost", []),
            touchdown=outcome.get("touchdown"),
            tables=dict(tables),
        )


def fly(scenario, *, law=None, compensator=None, faults=None, rows=True, **options):
    """Fly a scenario to its end.

    scenario: "nominal", "case1", ... or the path of a file.
    law: name of a main controller ("pid", "ndi", "lqr", ...), or a law in Python: a callable, or a class whose instances are,
        from a :class:`LawState` to a :class:`Command`. Its exception ends the flight and is raised here.
    compensator: name of the compensator's estimator ("neso", ...), or a compensator in Python beside any main controller: as
        ``law``, to a :class:`Compensation`. It acts when the detector wakes it, or always with ``ftc="always"``.
    faults: instead of those of the scenario, a list of lines such as ``"at 3 s: left elevator stuck at 30 deg"``, or of dicts
        with the keys of a scenario's ``[[plant.fault]]``; ``[]`` is a healthy aircraft.
    rows: False keeps no signals, for speed.
    options: those of ``sitl fly`` with underscores: ``airframe="f16"``, ``model=``, ``allocation=``,
        ``gains=``, ``ftc="off"``, ``seed=7``, ``set={"plant.wind.turbulence_m_s": 3.0, "FTC_MODE": 0}``, ``period_ms=``,
        ``step_us=``, ``script=``, ``judge=["altitude"]``, ``no_stop_at_loss=True``, ...

    Returns a :class:`Flight`; for ``seed=range(1, 101)`` a list of them without signals, flown on all cores.
    Raises ValueError or TypeError with the name, the value and what is allowed.
    """
    outcomes, tables = _native.fly(
        scenario, law=law, compensator=compensator, faults=faults, rows=rows, **options
    )
    outcomes = json.loads(outcomes)
    if isinstance(options.get("seed"), range):
        return [Flight._of(outcome) for outcome in outcomes]
    return Flight._of(outcomes[0], tables)
