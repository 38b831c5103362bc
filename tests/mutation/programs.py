"""The test programs, test by test: faults reached by each, and faults detected."""

import os
import re
import resource
import subprocess
import tempfile
import time
from dataclasses import dataclass, field

_QUICK_S = 0.1     # shorter tests run together; longer ones individually, the shortest first
_CONFIRM_S = 0.05  # longer tests may be delayed by the machine: they must fail twice
_FEWEST_CPU_S, _FEWEST_WALL_S, _TIMES = 3, 10, 20
_MEMORY = 4 << 30
_FAILED = re.compile(r"^\[  FAILED  \] (\S+?),? ", re.M)


@dataclass
class Test:
    program: str
    name: str
    takes_s: float = 0.0
    meets: set = field(default_factory=set)


@dataclass
class Outcome:
    passed: bool
    by: str = ""


def tests_in(program):
    """Tests of a GoogleTest program; of another none."""
    listed = subprocess.run([program, "--gtest_list_tests"], capture_output=True, text=True, timeout=60)
    found, suite = [], ""
    for line in listed.stdout.split("\n") if not listed.returncode else []:
        name = line.split("#")[0].rstrip()
        if line.startswith("  "):
            found.append(Test(str(program), suite + name.strip()))
        elif name.endswith("."):
            suite = name
    return [t for t in found if ".DISABLED_" not in t.name and not t.name.startswith("DISABLED_")]


def _run(program, names, fault, reached, expected_s):
    env = dict(os.environ, CELLCAL_FAULT=str(fault), GTEST_COLOR="no")
    env.pop("CELLCAL_FAULTS_REACHED", None)
    if reached:
        env["CELLCAL_FAULTS_REACHED"] = reached
    cpu_s = int(_FEWEST_CPU_S + _TIMES * expected_s)

    def limits():
        os.setsid()
        resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s + 1))
        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    with tempfile.TemporaryFile() as out:
        child = subprocess.Popen([program, f"--gtest_filter={':'.join(names)}", "--gtest_fail_fast",
                                  "--gtest_brief=1"], env=env, stdin=subprocess.DEVNULL, stdout=out,
                                 stderr=subprocess.DEVNULL, preexec_fn=limits)
        try:
            status = child.wait(_FEWEST_WALL_S + _TIMES * expected_s)
        except subprocess.TimeoutExpired:
            status = "hangs"
        finally:
            try:
                os.killpg(child.pid, 9)  # with its child processes
            except ProcessLookupError:
                pass
            child.wait()
        out.seek(0)
        text = out.read().decode(errors="replace")
    if status == 0:
        return Outcome(True)
    failed = _FAILED.search(text)
    return Outcome(False, failed.group(1) if failed else "it hangs" if status == "hangs" else "it dies")


def learn(tests, size, longest_s, say):
    """Runs each test without a fault. Returns those that pass and are short enough, and the faults
    that are not applicable: no such operator between these types."""
    kept, impossible = [], set()
    with tempfile.NamedTemporaryFile() as board:
        for test in tests:
            board.seek(0)
            board.truncate(0)
            board.truncate(size)
            began = time.monotonic()
            outcome = _run(test.program, [test.name], 0, board.name, longest_s / _TIMES)
            test.takes_s = time.monotonic() - began
            if not outcome.passed or test.takes_s > longest_s:
                why = f"takes {test.takes_s:.1f} s" if outcome.passed else "fails without a fault"
                say(f"left out: {test.name} {why}")
                continue
            board.seek(0)
            for number, what in enumerate(board.read()):
                if what == 1:
                    test.meets.add(number)
                elif what == 2:
                    impossible.add(number)
            kept.append(test)
    return kept, impossible - {n for t in kept for n in t.meets}


def noticed(fault, tests):
    """Name of the test that detects it, 'it hangs', 'it dies', or an empty string."""
    meeting = sorted((t for t in tests if fault.number in t.meets), key=lambda t: t.takes_s)
    quick = {}
    for test in meeting:
        if test.takes_s < _QUICK_S:
            quick.setdefault(test.program, []).append(test)
    rows = list(quick.values()) + [[t] for t in meeting if t.takes_s >= _QUICK_S]
    for row in rows:
        names, program, takes_s = [t.name for t in row], row[0].program, sum(t.takes_s for t in row)
        outcome = _run(program, names, fault.number, "", takes_s)
        if outcome.passed:
            continue
        by = [t for t in row if t.name == outcome.by] or row
        if max(t.takes_s for t in by) < _CONFIRM_S:
            return outcome.by
        if not _run(program, [t.name for t in by], fault.number, "", takes_s).passed:
            return outcome.by
    return ""
