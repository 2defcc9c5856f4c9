"""The command line: ``sitl``, or ``python -m two_step``."""

import os
import signal
import sys
import sysconfig
from pathlib import Path


def main():
    from two_step import _native

    # As of a program that is not Python: Ctrl-C ends it, and a closed pipe.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    started = Path(sys.argv[0])
    installed = Path(sysconfig.get_path("scripts")) / "sitl"
    program = started if started.name == "sitl" and os.access(started, os.X_OK) else installed
    sys.exit(_native.main(["sitl", *sys.argv[1:]], program.resolve()))


if __name__ == "__main__":
    main()
