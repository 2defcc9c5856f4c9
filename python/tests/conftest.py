import os
import subprocess
from pathlib import Path

import pytest

#: The command line that the package is compared with: a program of the same checkout, or the package's own.
SITL = os.environ.get("TWO_STEP_PROGRAM", "sitl")


@pytest.fixture
def sitl(tmp_path):
    """Runs `sitl` with words; gives its standard output. Nothing goes into the user's folders."""

    def run(*words, status=0):
        env = {**os.environ, "HOME": str(tmp_path), "XDG_DATA_HOME": str(tmp_path / "data")}
        done = subprocess.run([SITL, *map(str, words)], capture_output=True, text=True, env=env, cwd=tmp_path)
        assert done.returncode == status, done.stdout + done.stderr
        return done.stdout

    return run


@pytest.fixture
def out(tmp_path) -> Path:
    return tmp_path / "out"
