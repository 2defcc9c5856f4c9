"""Campaigns: many flights drawn from one specification, on all cores.

A specification is the name of one that comes with the program ("jams", "smoke", ...) or a TOML file. A campaign that was
interrupted goes on in its folder.
"""

from two_step import _native, commands


def run(spec, *, out=None, laws=None, compensators=None, own_set=None, **options):
    """Fly every run that is not there yet.

    laws, compensators: {"name": law}, laws in Python that fly beside those of the specification. A class makes a law for
        each flight; an instance needs ``__deepcopy__``; a function has no state. The same name in both is one law that is both.
    own_set: {"name": {"FTC_MODE": 2}}, parameters that a law in Python flies with; these are of a compensator that always acts.
    options: those of ``sitl campaign run``: ``samples=``, ``seed=``, ``airframe=``, ``set=``, ``only=``, ``shard="1/4"``.

    Returns a :class:`two_step.commands.Result`: ``result["runs"]`` has a row for each run, ``result["summary"]`` one for each
    group with its intervals.
    """
    own = _own(laws, compensators, own_set)
    return commands.run("campaign run", spec, out=out, own=own, **options)


def worst(spec, *, out=None, laws=None, compensators=None, own_set=None, **options):
    """The smallest fault, the earliest time or the weakest gust that each law does not survive."""
    own = _own(laws, compensators, own_set)
    return commands.run("campaign worst", spec, out=out, own=own, **options)


def tune(spec, *, out=None, **options):
    """Search the gains of each law by one procedure, on flights of their own."""
    return commands.run("campaign tune", spec, out=out, **options)


def suite(*, out=None, laws=None, compensators=None, own_set=None, **options):
    """Fly FTC-1 to FTC-12 with every law."""
    own = _own(laws, compensators, own_set)
    return commands.run("campaign suite", out=out, own=own, **options)


def compare(one, other):
    """Compare the results of two folders of one specification, run by run; returns the text."""
    return _native.command(["campaign", "compare"], [str(one), str(other)])[1]


def _own(laws, compensators, own_set):
    laws, compensators, own_set = laws or {}, compensators or {}, own_set or {}
    names = list(dict.fromkeys([*laws, *compensators]))
    for name in own_set:
        if name not in names:
            raise ValueError(f"own_set: {name!r}; expected the name of a law in Python: {', '.join(names) or 'there is none'}")
    return [commands.own_law(laws.get(name), compensators.get(name), name, own_set.get(name)) for name in names]
