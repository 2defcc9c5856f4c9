#!/usr/bin/env python3
"""For mdBook (book.toml): links to files of the repository that are no pages of the book become their paths, and the results of
notebooks that `docs/notebooks.py` has executed follow on their pages.

`python3 docs/book.py check target/book` finds links of the built book that lead nowhere.
"""
import html
import json
import re
import sys
import urllib.parse
from pathlib import Path

def rewrite(item):
    """Rewrites a chapter and all below it."""
    chapter = item.get("Chapter") if isinstance(item, dict) else None
    if not chapter:
        return
    executed = Path("target", chapter["path"])
    if chapter["path"].startswith("notebooks/") and executed.exists():
        chapter["content"] += "\n" + executed.read_text()
    # As many steps up as the page has folders, its own included, lead out of the book.
    up = "../" * len(Path(chapter["path"]).parts)
    outside = rf"\[([^\]\[]*)\]\({re.escape(up)}([^)#\s]+)(?:#[^)\s]*)?\)"
    chapter["content"] = re.sub(outside, as_path, chapter["content"])
    for below in chapter["sub_items"]:
        rewrite(below)


def as_path(link):
    text, path = link[1], link[2]
    return text if path in text else f"{text} (`{path}`)"


def dead_links(book):
    pages = {page: page.read_text() for page in book.rglob("*.html")}
    anchors = {page: set(re.findall(r'\b(?:id|name)="([^"]+)"', text)) for page, text in pages.items()}
    for page, text in pages.items():
        if page.name in ("toc.html", "404.html", "print.html"):
            continue
        for link in re.findall(r'(?:href|src)="([^"]+)"', text):
            link = urllib.parse.unquote(html.unescape(link))
            if re.match(r"[a-z]+:", link):
                continue
            path, _, anchor = link.partition("#")
            target = (page.parent / path).resolve() if path else page
            if not target.exists() or (anchor and anchor not in anchors.get(target, {anchor})):
                yield f"{page.relative_to(book)}: {link}"


if sys.argv[1:2] == ["supports"]:
    sys.exit(0)
if sys.argv[1:2] == ["check"]:
    found = list(dead_links(Path(sys.argv[2]).resolve()))
    print("\n".join(found) or "every link of the book leads somewhere")
    sys.exit(bool(found))
_, book = json.load(sys.stdin)
for item in book.get("items") or book["sections"]:
    rewrite(item)
json.dump(book, sys.stdout)
