#!/usr/bin/env python3
"""Executes the notebooks of python/notebooks and writes them as pages, target/notebooks/NAME.md, with their pictures inside.

`docs/book.py` puts them into the book below docs/notebooks/NAME.md. It needs the package two_step and
python/notebooks/requirements.txt; a notebook of the repository that has outputs is refused.
"""
import base64
import io
import re
import sys
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from PIL import Image

ROOT = Path(__file__).resolve().parent.parent


def page(notebook):
    """The cells with their results; the title stands on the page of the book."""
    parts, heading = [], ""
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            heading = re.search(r"^#+ (.*)", cell.source, re.MULTILINE)[1]
            text = re.sub(r"\A# .*\n", "", cell.source)
            # Links lead from python/notebooks to the pages, and from one notebook to another.
            text = text.replace("](../../docs/", "](../")
            parts.append(re.sub(r"\]\((\w+)\.ipynb\)", r"](\1.md)", text))
        else:
            parts.append(f"```python\n{cell.source}\n```")
            parts += [shown(output, heading) for output in cell.outputs]
    return "\n\n".join(filter(None, parts)) + "\n"


def shown(output, heading):
    if output.output_type == "stream":
        # Standard error has the progress of a campaign.
        return f"```text\n{output.text.rstrip()}\n```" if output.name == "stdout" else ""
    data = output.data
    if "image/png" in data:
        return f"![{heading}](data:image/png;base64,{small(data['image/png'])})"
    if "text/html" in data:
        table = re.search(r"<table.*?</table>", data["text/html"], re.DOTALL)[0]
        return re.sub(r"\n\s*", "\n", table)
    return f"```text\n{data['text/plain']}\n```"


def small(png):
    """A figure has few colours; mdBook puts each picture into its page twice."""
    shrunk = io.BytesIO()
    Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB").quantize(128).save(shrunk, "PNG", optimize=True)
    return base64.b64encode(shrunk.getvalue()).decode()


def main():
    out = ROOT / "target/notebooks"
    out.mkdir(parents=True, exist_ok=True)
    for path in sorted((ROOT / "python/notebooks").glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        nbformat.validate(notebook)
        if any(cell.get("outputs") or cell.get("execution_count") for cell in notebook.cells):
            sys.exit(f"{path}: the notebook has outputs; clear them before it is kept")
        began = time.monotonic()
        NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": path.parent}}).execute()
        (out / path.with_suffix(".md").name).write_text(page(notebook))
        print(f"{path.name}: {time.monotonic() - began:.0f} s")


main()
