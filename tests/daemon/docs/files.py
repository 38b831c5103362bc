#!/usr/bin/env python3
"""files.py SOURCE: every file of the source tree named by a comment or a Markdown file exists: `name.h`,
`dir/name.cc`, and paths from the top level; in documents also relative to the document's folder (with or without .h,
.cc, .py)."""
import re
import sys
from pathlib import Path

from links import TOP, documents, exists

TEXT = r'"(?:\\.|[^"\\\n])*"'
COMMENT = {**dict.fromkeys((".h", ".cc", ".c", ".ts", ".tsx", ".mjs"), re.compile(TEXT + r"|(//.*|/\*[\s\S]*?\*/)")),
           **dict.fromkeys((".py", ".sh", ".cmake", ".toml", ".txt"), re.compile(TEXT + r"|((?<!\S)#.*)"))}
FILE = re.compile(r"(?<![\w.<*{}/+-])((?:[\w-]+/)*[\w-]{2,}\.(?:h|cc|c|py|ts|tsx|mjs|cmake))(?![\w*/]|\.\w)")
PATH = re.compile(r"(?<![\w.<*{}/-])((?:" + "|".join(TOP) + r")(?:/[\w-]+)+)(?![\w*{-]|\.\w|/[\w*{<])")
BESIDE = re.compile(r"`((?:[\w-]+/)+[\w-]+)`")
INSTALLED = re.compile(r"/usr/share/doc/cellcal/([\w/.-]+)")
# System headers, and placeholder names.
ELSEWHERE = {"linux/capability.h", "OUT.cc", "OUT.ts", "NAME_fuzz.cc", "generated/api.ts"}


def described(path):
    """Comments of a source file, or a whole document."""
    text = path.read_text()
    return text if path.suffix == ".md" else "\n".join(COMMENT[path.suffix].findall(text))


def files(source):
    for top in TOP:
        yield from (path for path in sorted((source / top).rglob("*")) if "node_modules" not in path.parts)


def faults(source):
    ends = set(ELSEWHERE)
    for path in files(source):
        parts = path.relative_to(source).parts
        ends |= {"/".join(parts[first:]) for first in range(len(parts))}
    for path in sorted((source / "systemd").glob("*.[st]*")):
        yield from (f"{path.relative_to(source)}: {name} does not exist"
                    for name in INSTALLED.findall(path.read_text()) if not (source / name).exists())
    read = [path for path in documents(source) if path.name != "CHANGELOG.md"]
    for path in read + [path for path in files(source) if path.suffix in COMMENT]:
        text = described(path)
        missing = {name for name in FILE.findall(text) if name not in ends}
        missing |= {name for name in PATH.findall(text) if not exists(source, name)}
        if path.suffix == ".md":
            missing |= {name for name in BESIDE.findall(text)
                        if (path.parent / name.split("/")[0]).is_dir() and not exists(path.parent, name) and not exists(source, name)}
        yield from (f"{path.relative_to(source)}: {name} does not exist" for name in sorted(missing))


if __name__ == "__main__":
    found = list(faults(Path(sys.argv[1])))
    print("\n".join(found) or "every named file exists")
    sys.exit(1 if found else 0)
