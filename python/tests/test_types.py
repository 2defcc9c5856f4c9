"""The types of the part in Rust, `_native.pyi`, are those of the module."""

import subprocess
import sys

import pytest


def test_the_stubs_are_those_of_the_module(tmp_path):
    pytest.importorskip("mypy")
    # A slot of the type, which the module's dictionary does not show.
    allowed = tmp_path / "allowed"
    allowed.write_text(r"two_step\._native\.Signals\.__getattr__" + "\n")
    checked = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "--allowlist", allowed, "two_step._native"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr
