"""The pages show code that runs: the blocks of a page in their order, with the names of those before."""

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
#: A gigabyte for one block; it runs where it is installed.
LARGE = "stable_baselines3"


@pytest.mark.parametrize("name", ["docs/python.md", "python/README.md", "README.md"])
def test_the_code_of_a_page_runs(name, tmp_path, monkeypatch):
    for module in ("pandas", "polars", "pyarrow", "gymnasium", "pymavlink"):
        pytest.importorskip(module)
    monkeypatch.chdir(tmp_path)
    page = ROOT / name
    text = page.read_text()
    blocks = list(re.finditer(r"^```python\n(.*?)^```$", text, re.DOTALL | re.MULTILINE))
    assert blocks
    names = {"__name__": "page"}
    for block in blocks:
        if LARGE in block[1] and importlib.util.find_spec(LARGE) is None:
            continue
        # With the lines of the page, for tracebacks.
        before = "\n" * text[: block.start(1)].count("\n")
        exec(compile(before + block[1], str(page), "exec"), names)
