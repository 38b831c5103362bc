#!/usr/bin/env python3
"""The equations and symbols of calib's READMEs and the code that cites them.

Each number is defined once, in the README of a module: (1), (2), ... without gaps, some followed by (27a), (27b), ...
of the same README. A file computes an equation if one of its comments begins with the number, as `// (25)`. The index of
calib/README.md names exactly these files, in the order of the numbers, and existing functions. Its table of modules has
each module's numbers. No text refers to an undefined number.

Each symbol has one row in the table of symbols, and every symbol of a numbered equation has one: letters, and names with
subscripts; plain words are not symbols.
"""
import re
import sys
from pathlib import Path

SYMBOLS_HEADING, INDEX_HEADING = "## 3. Symbols", "## 5. Index of equations"
NUMBER = r"\((\d{1,3}[a-z]?)\)"
# (25), (27a); both ends of a range: "(17) - (19)". Not the argument of "sqrt(12)".
MENTIONS = re.compile(r"(?<!\w)" + NUMBER + r"(?: - \((\d+)\))?")
COMPUTES = re.compile(r"//[/!<]*\s*((?:" + NUMBER + r",? ?)+)")
DEFINITION = re.compile(r"^ +" + NUMBER + r"  +(.*(?:\n {10,}\S.*)*)", re.M)
NAME = re.compile(r"(?<![A-Za-z0-9_])[A-Za-z][A-Za-z0-9]*(?:_[A-Za-z0-9]+)*")
# Symbols explained in the table's text, the word a, and products of two symbols.
NOTATION = {"N", "tr", "Rx", "Ry", "Rz", "Tx", "Ty", "Tz", "O2", "O3", "O4", "M_last", "M_now", "H_a", "H_b", "H_ab",
            "m_t", "c_a", "c_b", "lam_max", "a", "WJ", "Wr"}
# Indices: q_ik, sv_1, Z_one,last, Z_undone
WHICH = re.compile(r"_(?:[ijkln]{1,2}|\d|last|undone|stated)$")


def order(number):
    return int(re.match(r"\d+", number)[0]), number


def numbers(text):
    found = set()
    for first, last in MENTIONS.findall(text):
        found.update([first] if not last else map(str, range(int(first), int(last) + 1)))
    return found


def section(readme, heading):
    return readme.split(heading)[1].split("\n## ")[0]


def wrong_numbers(defined):
    """Gaps, and letters that do not follow their predecessor."""
    for number in sorted(defined, key=order):
        plain, letter = re.match(r"(\d+)(.?)", number).groups()
        before = plain if letter == "a" else plain + chr(ord(letter) - 1) if letter else str(int(plain) - 1)
        if before != "0" and before not in defined:
            yield f"({before}) is in no README, ({number}) is"
        elif letter and defined[before] != defined[number]:
            yield f"({number}) is not where ({before}) is"


def wrong_index(calib, index, computed, defined):
    named = {number: set() for number in defined}
    last = 0
    for own_text, files_text in re.findall(r"^\| (\(.*?) \|.*\| (.*) \|$", index, re.M):
        own = numbers(own_text)
        first = min((order(n)[0] for n in own), default=0)
        if first < last:
            yield f"the index has {own_text} behind ({last})"
        last, source = first, None
        for token in re.findall(r"`([^`]+)`", files_text):
            if "/" not in token:
                if source and not re.search(rf"\b{token}\b", "".join(f.read_text() for f in source)):
                    yield f"{source[0]} has no {token}, which the index names for {own_text}"
                continue
            source = [f for f in (calib / (token + ".cc"), calib / (token + ".h")) if f.is_file()]
            if not source:
                yield f"the index names {token}, which is not there"
            for number in own & set(defined):
                named[number].add(token)
        yield from (f"the index has ({n}), which is in no README" for n in sorted(own - set(defined)))
    for number in sorted(named, key=order):
        if not named[number]:
            yield f"({number}) is not in the index"
        files = {name for name, own in computed.items() if number in own}
        yield from (f"{f} has no comment that begins with ({number})" for f in sorted(named[number] - files))
        yield from (f"{f} computes ({number}), the index does not say so" for f in sorted(files - named[number]))


def wrong_modules(readme, defined):
    modules = dict(re.findall(r"^\| \[(\w+)\]\(\w+/README\.md\) \| (\(.*) \|$", readme, re.M))
    for module in sorted(set(modules) | set(defined.values())):
        own = {number for number, where in defined.items() if where == module}
        for number in sorted(own ^ numbers(modules.get(module, "")), key=order):
            yield f"({number}) of {module} is only in " + ("its README" if number in own else "the table of modules")


def base(symbol):
    return WHICH.sub("", re.sub("^sum_.*", "sum", symbol))


def wrong_symbols(table, equations):
    rows = re.findall(r"^\| ([^|]+) \|.*\|.*\|$", table, re.M)[1:]
    symbols = [s.split("(")[0].strip() for row in rows for s in re.split(r"[;,] ", row)]
    yield from (f"the table of symbols has {s} twice" for s in sorted(set(symbols)) if symbols.count(s) > 1)
    known = set(symbols) | NOTATION | {"sum"} | {base(name) for s in symbols for name in NAME.findall(s)}
    for number, text in sorted(equations.items(), key=lambda one: order(one[0])):
        text = re.sub(r"`[^`]*`|\d+(?:\.\d+)?e-?\d+", " ", text)
        for name in sorted(set(NAME.findall(text))):
            plain_word = len(name) > 1 and name.isalpha() and (name.islower() or name.istitle() and len(name) > 2)
            if not plain_word and not {name, base(name)} & known:
                yield f"{name} of ({number}) is not in the table of symbols"


def faults(calib):
    defined, equations, speaking = {}, {}, {calib / "README.md"}
    for path in sorted(calib.glob("*/README.md")):
        for number, text in DEFINITION.findall(path.read_text()):
            if number in defined:
                yield f"({number}) is in {defined[number]} and in {path.parent.name}"
            defined[number], equations[number] = path.parent.name, text
            speaking.add(path)
    yield from wrong_numbers(defined)

    computed = {}
    for path in sorted([*calib.rglob("*.cc"), *calib.rglob("*.h")]):
        name = str(path.relative_to(calib).with_suffix(""))
        comments = [line[line.index("//"):] for line in path.read_text().splitlines() if "//" in line]
        for comment in comments:
            begins = COMPUTES.match(comment)
            computed.setdefault(name, set()).update(numbers(begins[1]) if begins else ())
        spoken = numbers("\n".join(comments)) - set(defined)
        yield from (f"{path} cites ({n}), which is in no README" for n in sorted(spoken))
    for path in sorted(speaking):
        spoken = numbers(path.read_text()) - set(defined)
        yield from (f"{path} speaks of ({n}), which is in no README" for n in sorted(spoken))

    readme = (calib / "README.md").read_text()
    yield from wrong_index(calib, section(readme, INDEX_HEADING), computed, defined)
    yield from wrong_modules(readme, defined)
    yield from wrong_symbols(section(readme, SYMBOLS_HEADING), equations)


if __name__ == "__main__":
    all_faults = list(faults(Path(sys.argv[1])))
    print("\n".join(all_faults) or "every equation is cited where the index says, and every symbol explained")
    sys.exit(1 if all_faults else 0)
