"""Types of the part in Rust; see the modules of two_step for its use."""

from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, Callable, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Command",
    "Compensation",
    "Episodes",
    "LawState",
    "Signals",
    "Simulation",
    "Table",
    "__version__",
    "command",
    "fly",
    "main",
    "read_log",
    "read_toml",
]

__version__: str

_Path = str | PathLike[str]

@final
class Table:
    """A table by columns; pandas, polars and pyarrow take it by the Arrow PyCapsule interface, without a copy."""

    @staticmethod
    def read(path: _Path) -> Table: ...
    @property
    def names(self) -> list[str]: ...
    @property
    def units(self) -> dict[str, str]: ...
    def __len__(self) -> int: ...
    def __contains__(self, key: str, /) -> bool: ...
    def __getitem__(self, key: str, /) -> Any: ...
    def to_dict(self) -> dict[str, Any]: ...
    def to_pandas(self) -> Any: ...
    def to_polars(self) -> Any: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...

@final
class Signals(Mapping[str, float]):
    """Named values of one instant, by ``signals["altitude_m"]`` or ``signals.altitude_m``."""

    def __getitem__(self, key: str, /) -> float: ...
    def __getattr__(self, name: str) -> float: ...
    def __iter__(self) -> Iterator[str]: ...
    def __len__(self) -> int: ...
    def keys(self) -> list[str]: ...  # type: ignore[override]
    def values(self) -> NDArray[np.float64]: ...  # type: ignore[override]
    def to_dict(self) -> dict[str, float]: ...

@final
class LawState:
    """What a law is given in one control period: SI units and rad."""

    time_s: float
    period_s: float
    p_rad_s: float
    q_rad_s: float
    r_rad_s: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    alpha_rad: float
    beta_rad: float
    airspeed_m_s: float
    altitude_m: float
    climb_rate_m_s: float
    thrust_n: float
    altitude_reference_m: float
    roll_reference_rad: float
    airspeed_reference_m_s: float
    z2_roll_rad_s2: float
    z2_pitch_rad_s2: float
    z2_yaw_rad_s2: float
    main_aileron_rad: float
    main_elevator_rad: float
    main_rudder_rad: float
    main_thrust_n: float
    mass_kg: float
    trim_pitch_rad: float
    trim_elevator_rad: float
    trim_thrust_n: float
    def to_dict(self) -> dict[str, float]: ...
    def observation(self) -> NDArray[np.float32]:
        """What the environments of two_step.gym observe."""

@final
class Command:
    """Commands of a main controller, rad and N, before limits."""

    aileron_rad: float
    elevator_rad: float
    rudder_rad: float
    thrust_n: float
    nozzle_pitch_rad: float
    nozzle_yaw_rad: float
    def __new__(
        cls,
        aileron_rad: float = 0.0,
        elevator_rad: float = 0.0,
        rudder_rad: float = 0.0,
        thrust_n: float = 0.0,
        nozzle_pitch_rad: float = 0.0,
        nozzle_yaw_rad: float = 0.0,
    ) -> Command: ...

@final
class Compensation:
    """Commands of a compensator beside the main controller, rad, before limits."""

    aileron_rad: float
    nozzle_pitch_rad: float
    nozzle_yaw_rad: float
    def __new__(cls, aileron_rad: float = 0.0, nozzle_pitch_rad: float = 0.0, nozzle_yaw_rad: float = 0.0) -> Compensation: ...

_Law = str | Callable[[LawState], Command] | type
_Compensator = str | Callable[[LawState], Compensation] | type

@final
class Simulation:
    """One flight, stepped from Python; it begins at its first tick."""

    def __new__(
        cls,
        scenario: _Path,
        *,
        law: _Law | None = None,
        compensator: _Compensator | None = None,
        faults: Sequence[str | Mapping[str, Any]] | None = None,
        **options: Any,
    ) -> Simulation: ...
    def reset(self, seed: int | None = None) -> None: ...
    def step(self, count: int = 1) -> bool: ...
    def act(self, commands: Mapping[str, float] | ArrayLike) -> None: ...
    def fail(self, target: str, *, after_s: float = 0.0, stuck_deg: float | None = None, **keys: Any) -> None: ...
    def clear(self, target: str | None = None) -> None: ...
    def refer(
        self,
        *,
        altitude_m: float | None = None,
        airspeed_m_s: float | None = None,
        roll_deg: float | None = None,
        course_deg: float | None = None,
    ) -> None: ...
    def copy(self) -> Simulation: ...
    def __copy__(self) -> Simulation: ...
    def __deepcopy__(self, _memo: object) -> Simulation: ...
    def restore(self, saved: Simulation) -> None: ...
    @property
    def time_s(self) -> float: ...
    @property
    def steps(self) -> int: ...
    @property
    def is_over(self) -> bool: ...
    @property
    def loss(self) -> str | None: ...
    @property
    def effectors(self) -> list[str]: ...
    @property
    def state(self) -> Signals: ...
    @property
    def truth(self) -> Signals: ...
    @property
    def commands(self) -> Signals: ...

@final
class Episodes:
    """Flights side by side for reinforcement learning; use two_step.gym."""

    action_names: list[str]
    action_travel: NDArray[np.float64]
    observations: list[tuple[str, float]]
    def __new__(
        cls, task: str, scenario: _Path, count: int, *, action: str, jams: Sequence[str] | None, step_ms: float, episode_s: float,
        **options: Any,
    ) -> Episodes: ...
    def reset(self, seeds: Sequence[int | None]) -> NDArray[np.float32]: ...
    def step(
        self, actions: NDArray[np.float64], autoreset: str | None
    ) -> tuple[
        NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], NDArray[np.float32] | None
    ]: ...
    def fault(self, place: int) -> str: ...

def fly(
    scenario: _Path,
    *,
    law: _Law | None = None,
    compensator: _Compensator | None = None,
    faults: Sequence[str | Mapping[str, Any]] | None = None,
    rows: bool = True,
    **options: Any,
) -> tuple[str, list[tuple[str, Table]]]: ...
def command(
    command: Sequence[str], arguments: Sequence[str], *, own: Sequence[Mapping[str, Any]] = ..., **options: Any
) -> tuple[int, str]: ...
def main(words: Sequence[str], program: _Path) -> int: ...
def read_log(path: _Path) -> tuple[list[tuple[str, Table]], list[tuple[str, str]]]: ...
def read_toml(path: _Path) -> str: ...
