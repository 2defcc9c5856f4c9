"""The commands of ``sitl`` as functions. Options are those of the command, with underscores: ``--step-deg 5`` is ``step_deg=5``.

Each raises ValueError or TypeError with the option, its value and what is allowed.
"""

import json
import tempfile
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from two_step import _native


@dataclass(frozen=True)
class Result:
    """What a command gave."""

    #: Exit status: 0 where all went well.
    status: int
    #: What the command prints.
    text: str
    #: Tables by name.
    tables: dict[str, _native.Table]

    def __getitem__(self, name):
        return self.tables[name]


@contextmanager
def _folder(out):
    """The folder that the caller names, or one that goes with the call."""
    if out is not None:
        yield Path(out)
    else:
        with tempfile.TemporaryDirectory(prefix="two-step-") as folder:
            yield Path(folder) / "out"


def run(words, *arguments, out=None, own=(), **options):
    """Carry out a command that writes tables into a folder, ``out`` or a temporary one; ``own`` are laws in Python."""
    with _folder(out) as folder:
        given = [str(argument) for argument in arguments]
        status, text = _native.command(words.split(), given, own=list(own), out=folder, **options)
        tables = {path.stem: _native.Table.read(path) for path in sorted(folder.glob("*.parquet"))}
    return Result(status, text, tables)


def own_law(main=None, compensator=None, name=None, set=None):
    """A law in Python: main controller, compensator or both, its name, and parameters that it flies with in a campaign."""
    return {"main": main, "compensator": compensator, "name": name, "set": set}


def own_or_named(options, law=None, compensator=None):
    """The law in Python, if there is one; the names of those of the program go to the options."""
    given = {"law": law, "compensator": compensator}
    options.update({option: name for option, name in given.items() if isinstance(name, str)})
    return [own_law(*(None if isinstance(law, str) else law for law in given.values()))]


def study(name, *arguments, out=None, law=None, compensator=None, **options):
    """A study, ``sitl study NAME``: "paper", "turbulence", "estimator", ... Returns a :class:`Result`."""
    own = own_or_named(options, law, compensator)
    return run(f"study {name}", *arguments, out=out, own=own, **options)


def trimmable(*, out=None, **options):
    """For every jam whether a steady flight exists at all. Returns a :class:`Result` with its tables."""
    return run("aircraft trimmable", out=out, **options)


def margins(*, out=None, law=None, compensator=None, **options):
    """Eigenvalues, 1/s, and margins of gain, phase and delay of each law's loop. Returns a :class:`Result` with the tables
    ``margins`` and ``eigenvalues``.

    law, compensator: a name, or a law in Python (a class, or a function without state).
    """
    own = own_or_named(options, law, compensator)
    return run("aircraft margins", out=out, own=own, **options)


def fmu(out, *, autopilot=False, **options):
    """Write the plant, or the autopilot, as an FMU of FMI 3.0 for other simulators."""
    return _native.command(["aircraft", "fmu"], [], autopilot=autopilot, out=out, **options)[1]


def _toml_of(words, **options):
    with tempfile.TemporaryDirectory(prefix="two-step-") as folder:
        path = Path(folder) / "out.toml"
        _native.command(words, [], out=path, **options)
        return json.loads(_native.read_toml(path))


def linearize(**options):
    """The controller's model of an aircraft at its design point, as the content of a model file."""
    return _toml_of(["aircraft", "linearize"], **options)


def new_aircraft(*, out=None, **options):
    """Model and parameters of an aircraft by one procedure, checked in flights: the content of the model file, and the report,
    Markdown, which ends with what is weak."""
    with _folder(out) as folder:
        text = _native.command(["aircraft", "new"], [], out=folder, **options)[1]
        return json.loads(_native.read_toml(folder / "model.toml")), text


def design_lqr(**options):
    """Gains of the linear quadratic regulator: parameters by name."""
    return _toml_of(["aircraft", "design", "lqr"], **options)


def replay(log, *, law=None, compensator=None):
    """Fly the flight of a log again, with the law in Python that it has flown with, if it has. Returns whether it is the same to
    the bit; ValueError where it cannot be flown."""
    status, text = _native.command(["log", "replay"], [str(log)], own=[own_law(law, compensator)])
    if status > 1:
        raise ValueError(text.strip())
    return status == 0


@dataclass(frozen=True)
class Log:
    """A flight log: a table for each topic, and what the log says of its flight."""

    tables: dict[str, _native.Table]
    infos: dict[str, str]

    def __getitem__(self, topic):
        return self.tables[topic]


def read_log(path):
    """Read a flight log (ULog, ``flight.ulg``)."""
    tables, infos = _native.read_log(path)
    return Log(dict(tables), dict(infos))
