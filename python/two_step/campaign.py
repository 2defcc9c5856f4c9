"""Campaigns: many flights drawn from one specification, on all cores.

A specification is the name of one that comes with the program ("jams", "smoke", ...) or a TOML file. A campaign that was
interrupted goes on in its folder.
"""

from two_step import commands


def run(spec, *, out=None, laws=None, **options):
    """Fly every run that is not there yet.

    laws: {"name": law}, a law in Python that flies beside those of the specification. A class makes a law for each flight;
        an instance needs ``__deepcopy__``; a function has no state.
    options: those of ``sitl campaign run``: ``samples=``, ``seed=``, ``airframe=``, ``set=``, ``only=``, ``shard="1/4"``.

    Returns a :class:`two_step.commands.Result`: ``result["runs"]`` has a row for each run, ``result["summary"]`` one for each
    group with its intervals.
    """
    return _with_law("campaign run", spec, out, laws, options)


def worst(spec, *, out=None, laws=None, **options):
    """The smallest fault, the earliest time or the weakest gust that each law does not survive."""
    return _with_law("campaign worst", spec, out, laws, options)


def tune(spec, *, out=None, laws=None, **options):
    """Search the gains of each law by one procedure, on flights of their own."""
    return _with_law("campaign tune", spec, out, laws, options)


def suite(*, out=None, **options):
    """Fly FTC-1 to FTC-12 with every law."""
    return commands.run("campaign suite", out=out, **options)


def compare(one, other):
    """Compare the results of two folders of one specification, run by run; returns the text."""
    from two_step import _native

    return _native.command(["campaign", "compare"], [str(one), str(other)])[1]


def _with_law(words, spec, out, laws, options):
    if laws is not None and len(laws) != 1:
        raise ValueError(f"laws has {len(laws)} entries; expected one: a campaign flies one law in Python beside its own")
    ((name, law),) = (laws or {None: None}).items()
    return commands.run(words, spec, out=out, law=law, name=name, **options)
