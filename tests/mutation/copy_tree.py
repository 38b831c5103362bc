"""A copy of the project with faults, built in a folder of its own. The user's files are only read."""

import os
import re
import subprocess
import sys
from pathlib import Path

from sites import Sites, enums_of, placed, rewritten

_MESSAGE = re.compile(r"^([^:\s]+):(\d+):\d+: (?:fatal )?(error|note):", re.M)
_ROUNDS = 30


class CopyTree:
    def __init__(self, root, files, folder):
        self.root, self.files = root, files
        self.tree = folder / "tree"
        self.build = self.tree / "build/release"
        self.dropped = {path: set() for path in files}
        names = self._names()
        headers = [p for p in names if p.endswith((".h", ".cc")) and not p.startswith("tests/")]
        enums = enums_of((p, (root / p).read_text()) for p in headers)
        self.sites = {path: Sites(path, (root / path).read_text(), enums) for path in files}
        number = 0
        for sites in self.sites.values():
            number += -number % 1000  # numbers in one file depend little on other files: less to compile
            for site in sites.sites:
                for fault in site.faults:
                    number += 1
                    fault.number = number
        self.size = number + 1
        self._copy(names)

    def _names(self):
        listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=self.root, check=True,
                                capture_output=True, text=True).stdout
        return [p for p in listed.split("\n") if p and (self.root / p).is_file()]

    def _copy(self, names):
        kept = set(names)
        for old in self.tree.rglob("*") if self.tree.exists() else []:
            path = str(old.relative_to(self.tree))
            if old.is_file() and not path.startswith("build/") and path not in kept:
                old.unlink()
        for path in names:
            if path in self.sites:
                continue
            data = (self.root / path).read_bytes()
            if path == "CMakeLists.txt":
                data += self._options().encode()
            self._write(path, data, (self.root / path).stat().st_mode)
        self._write_faults()

    def _options(self):
        """Those of the files with faults. The target of a file may be another folder's: they are set in all."""
        sources = " ".join(f"${{PROJECT_SOURCE_DIR}}/{path}" for path in self.files if path.endswith(".cc"))
        return f"""
function(mutated folder)
  set_source_files_properties({sources} DIRECTORY ${{folder}} PROPERTIES COMPILE_OPTIONS
    "-w;-Wno-error;-Wno-narrowing;-fpermissive;-O2;-UNDEBUG;-D_GLIBCXX_ASSERTIONS;-include;{self.tree}/tests/mutation/fault.h")
  get_property(below DIRECTORY ${{folder}} PROPERTY SUBDIRECTORIES)
  foreach(one ${{below}})
    mutated(${{one}})
  endforeach()
endfunction()
mutated(.)
"""

    def programs(self, folders):
        """The test programs that have sources in these folders."""
        rows = [line.split(" ") for line in (self.build / "test_programs").read_text().splitlines()]
        return sorted({self.build / program for source, program in rows
                       if any(Path(source).is_relative_to(folder) for folder in folders)})

    def _write(self, path, data, mode=0o644):
        target = self.tree / path
        if target.exists() and target.read_bytes() == data:
            return
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)
        target.chmod(mode)

    def _write_faults(self):
        for path, sites in self.sites.items():
            text = rewritten(sites, self.dropped[path])
            if path.endswith(".h"):
                # The blank hides this include from checks of the dependencies between modules.
                text = f'# include "tests/mutation/fault.h"\n#pragma GCC system_header\n#line 1\n{text}'
            self._write(path, text.encode())

    def faults(self):
        return [f for path, sites in self.sites.items() for f in placed(sites, self.dropped[path])]

    def make(self, folders):
        """Builds the test programs of these folders; faults that do not compile are omitted."""
        env = dict(os.environ, CCACHE_BASEDIR=str(self.tree), CCACHE_NOHASHDIR="1")
        configured = subprocess.run(["cmake", "--preset", "release", "-DCELLCAL_WHOLE_MODULES=OFF"], cwd=self.tree, env=env,
                                    capture_output=True, text=True)
        if configured.returncode:
            sys.exit(f"mutation: cmake failed in {self.tree}\n{configured.stdout}{configured.stderr}")
        targets = [str(program.relative_to(self.build)) for program in self.programs(folders)]
        for _ in range(_ROUNDS):
            made = subprocess.run(["cmake", "--build", "build/release", "--target", *targets, "--", "-k", "0"],
                                  cwd=self.tree, env=env, capture_output=True, text=True)
            if made.returncode == 0:
                return
            if not self._drop(made.stdout):
                sys.exit(f"mutation: the copy does not build\n{made.stdout[-6000:]}{made.stderr}")
            self._write_faults()
        sys.exit(f"mutation: the copy does not build after {_ROUNDS} tries")

    def _drop(self, output):
        """Removes the faults of lines named by compiler errors; returns True if there were any."""
        groups = []
        for path, line, kind in _MESSAGE.findall(output):
            if kind == "error":
                groups.append([])
            path = os.path.relpath(os.path.realpath(self.build / path), os.path.realpath(self.tree))
            if groups and path in self.sites:
                groups[-1].append((path, int(line)))
        changed = False
        for places in groups:
            changed = any([self._drop_line(*place) for place in places[:1]]) or \
                any([self._drop_line(*place) for place in places[1:]]) or \
                any(self._drop_line(path, line - up) for path, line in places for up in (1, 2, 3)) or changed
        return changed

    def _drop_line(self, path, line):
        sites = self.sites[path]
        held = {e.line for e in sites.constants}
        for site in sites.sites:
            held |= {e.line for e in site.make([f.number for f in site.faults])}
        if line not in held or line in self.dropped[path]:
            return False
        self.dropped[path].add(line)
        return True
