#!/usr/bin/env python3
"""The equations of calib's READMEs and the code that cites them.

Each number is defined once, in the README of a room; they run from 1 without a gap; each stands in the
index of calib/README.md; and each file that the index names cites one of its row's numbers, as `// (25)`.
Nothing cites a number that is not there.
"""
import re
import sys
from pathlib import Path

INDEX_HEADING = "## 5. Index of equations"
# (25), and of a range both ends: "(17) - (19)"
NUMBERS = re.compile(r"\((\d+)\)(?: - \((\d+)\))?")


def numbers(text):
    found = set()
    for first, last in NUMBERS.findall(text):
        found.update(range(int(first), int(last or first) + 1))
    return found


def comments(path):
    return "\n".join(line[line.index("//"):] for line in path.read_text().splitlines() if "//" in line)


def faults(calib):
    defined = {}
    for readme in sorted(calib.glob("*/README.md")):
        for number in re.findall(r"^ +\((\d+)\)  ", readme.read_text(), re.M):
            if int(number) in defined:
                yield f"({number}) is in {defined[int(number)]} and in {readme}"
            defined[int(number)] = readme
    every = set(range(1, max(defined) + 1))
    yield from (f"({n}) is in no README" for n in sorted(every - set(defined)))

    cited = {source: numbers(comments(source)) for source in calib.rglob("*.cc")}
    for source, own in cited.items():
        yield from (f"{source} cites ({n}), which is in no README" for n in sorted(own - every))

    index = (calib / "README.md").read_text().split(INDEX_HEADING)[1].split("\n## ")[0]
    indexed = set()
    for row in re.findall(r"^\| (\(.*?) \|.*\| (.*) \|$", index, re.M):
        own, files = numbers(row[0]), re.findall(r"`([a-z_]+/[a-z_/]+)`", row[1])
        indexed |= own
        sources = [calib / (name + ".cc") for name in files]
        yield from (f"the index names {s}, which is not there" for s in sources if s not in cited)
        sources = [s for s in sources if s in cited]
        yield from (f"{s} cites none of {row[0]}" for s in sources if not own & cited[s])
        missing = own - set().union(*(cited[s] for s in sources))
        yield from (f"({n}) is cited by none of {', '.join(files)}" for n in sorted(missing))
    yield from (f"({n}) is not in the index" for n in sorted(every - indexed))


if __name__ == "__main__":
    all_faults = list(faults(Path(sys.argv[1])))
    print("\n".join(all_faults) or "every equation is cited where the index says")
    sys.exit(1 if all_faults else 0)
