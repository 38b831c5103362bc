#!/usr/bin/env python3
"""links.py SOURCE: every link of the Markdown files leads to a file and heading of the source tree, every path that they
name in backticks from the top level on exists (with or without .h, .cc, .py), a source file named alone is in the
document's folder or below it and not named twice in a row, and README.md has 90 lines at most."""
import re
import sys
from pathlib import Path

LARGEST_README = 90
TOP = ("calib", "daemon", "drivers", "sim", "systemd", "tests")
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
ALONE = re.compile(r"`([\w-]+\.(?:h|cc))`")
TWICE = re.compile(r"`([^`\s]+)`, `\1`")
NAMED = re.compile(r"`((?:" + "|".join(TOP) + r")/[^`\s]*)`")


def documents(source):
    for path in sorted([source / "README.md", source / "CHANGELOG.md", *(p for top in TOP for p in (source / top).rglob("*.md"))]):
        if "node_modules" not in path.parts:
            yield path


def without_code(text):
    return re.sub(r"^(```.*?^```|(?: {4,}).*?$)", "", text, flags=re.M | re.S)


def anchors(path):
    """As GitHub makes them of headings."""
    headings = re.findall(r"^#+ (.*)$", path.read_text(), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def wrong_links(path, text):
    for target in LINK.findall(text):
        if re.match(r"[a-z]+:", target):
            continue
        file, _, anchor = target.partition("#")
        there = (path.parent / file).resolve() if file else path
        if not there.exists():
            yield f"link to {target}"
        elif anchor and anchor not in anchors(there):
            yield f"link to {target}: no such heading"


def exists(source, name):
    if any(letter in name for letter in "*{"):
        for choice in re.findall(r"\{([^}]*)\}", name):
            name = name.replace("{" + choice + "}", "*")
        return any(source.glob(name))
    return any((source / (name.rstrip("/") + end)).exists() for end in ("", ".h", ".cc", ".py"))


def faults(source):
    for path in documents(source):
        text = path.read_text()
        shown = path.relative_to(source)
        yield from (f"{shown}: {fault}" for fault in wrong_links(path, without_code(text)))
        if path.name != "CHANGELOG.md":
            yield from (f"{shown}: {name} does not exist" for name in NAMED.findall(text) if not exists(source, name))
            yield from (f"{shown}: no {name} in its folder" for name in ALONE.findall(text) if not any(path.parent.rglob(name)))
            yield from (f"{shown}: {name} twice" for name in TWICE.findall(text))
    lines = len((source / "README.md").read_text().splitlines())
    if lines > LARGEST_README:
        yield f"README.md: {lines} lines (limit {LARGEST_README})"


if __name__ == "__main__":
    found = list(faults(Path(sys.argv[1])))
    print("\n".join(found) or "all links and paths exist")
    sys.exit(1 if found else 0)
