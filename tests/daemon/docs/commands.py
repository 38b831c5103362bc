#!/usr/bin/env python3
"""commands.py SOURCE CELLCAL: every `cellcal COMMAND --option` in the documents is listed by --help."""
import re
import subprocess
import sys
from functools import lru_cache
from pathlib import Path

from links import documents

PRINTED = re.compile(r"(?:^ {4,}|[`'])(?:sudo )?cellcal ((?:--?[a-z]|[a-z][a-z-]* ?)[^`'\n#|]*)", re.M)
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
# Continued lines of an example are joined.
CONTINUED = re.compile(r" \\\n +")


def help_of(cellcal, *words):
    return subprocess.run([cellcal, *words, "--help"], capture_output=True, text=True, check=False).stdout


@lru_cache(maxsize=None)
def known(cellcal, *words):
    text = help_of(cellcal, *words)
    commands = re.findall(r"^  ([a-z][a-z-]*) ", text.split("Subcommands:")[1], re.M) if "Subcommands:" in text else []
    return set(commands), set(OPTION.findall(text))


def faults_of(cellcal, printed):
    words, options = [], set()
    commands, own = known(cellcal)
    options |= own | {"--socket", "--json"}
    for word in printed.split():
        if not re.fullmatch(r"[a-z][a-z-]*", word) or word not in commands:
            break
        words.append(word)
        commands, own = known(cellcal, *words)
        options |= own
    if not words and re.match(r"[a-z]", printed):
        yield "no such command"
    yield from (f"no option {option}" for option in OPTION.findall(printed) if words and option not in options)


if __name__ == "__main__":
    source, cellcal = Path(sys.argv[1]), sys.argv[2]
    wrong = []
    for path in documents(source):
        if path.name == "CHANGELOG.md":
            continue
        for printed in PRINTED.findall(CONTINUED.sub(" ", path.read_text())):
            wrong += [f"{path.relative_to(source)}: cellcal {printed.strip()}: {fault}" for fault in faults_of(cellcal, printed)]
    print("\n".join(wrong) or "every printed command exists")
    sys.exit(1 if wrong else 0)
