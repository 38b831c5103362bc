#!/usr/bin/python3
"""Runs the solvers of tests/bench/compare, each in its own process, and prints the table.

usage: compare_table.py COMPARE_PEERS [TOUCHES...]
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile

# One thread each: otherwise the number of cores would be compared.
ONE_THREAD = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
SOLVERS = ("cellcal", "cellcal-full", "autodiff", "scipy")


def run(command):
    """The process's output and its peak memory in MB."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, env=ONE_THREAD) as process:
        answer = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{' '.join(command)} failed")
    return json.loads(answer), usage.ru_maxrss / 1024.0


def main():
    peers = [sys.argv[1], "compare_peers"]
    scipy = os.path.join(os.path.dirname(os.path.abspath(__file__)), "compare_scipy.py")
    counts = [int(word) for word in sys.argv[2:]] or [50, 100, 400, 10000, 100000]
    print(" touches  solver           runs   median ms    worst ms   peak MB  iterations"
          "  off mm or mrad  times scipy")
    for count in counts:
        runs = 20 if count <= 1000 else 5 if count <= 10000 else 3
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([*peers, "write", folder, "--touches", str(count)], check=True)
            answers = {}
            for solver in SOLVERS:
                command = ([sys.executable, scipy, folder, str(runs)] if solver == "scipy"
                           else [*peers, solver, folder, "--runs", str(runs)])
                answers[solver] = run(command)
        reference = answers["scipy"][0]
        base = statistics.median(reference["seconds"])
        for solver in SOLVERS:
            answer, peak = answers[solver]
            median = statistics.median(answer["seconds"])
            same = len(answer["x"]) == len(reference["x"])
            off = max(abs(a - b) for a, b in zip(answer["x"], reference["x"])) if same else 0.0
            print(f"{count:8d}  {solver:14s} {runs:6d} {1e3 * median:11.2f}"
                  f" {1e3 * max(answer['seconds']):11.2f} {peak:9.0f}"
                  f" {answer['iterations'] or '-':>11}"
                  f" {f'{1e3 * off:.1e}' if same else '-':>15} {base / median:12.1f}", flush=True)


if __name__ == "__main__":
    main()
