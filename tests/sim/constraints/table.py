"""The comparison of kinds of targets, of two arms: every row exists, with the expected result."""

import re
import subprocess
import sys

ROBOTS = 2
TOUCHES = (30, 50, 100)
# Kind: true if it measures a length, and so determines the scale of the arm.
KINDS = {
    "1 sphere": False,
    "4 spheres": False,
    "4 spheres, lengths": True,
    "1 wire": True,
    "3 planes": False,
    "4 points": False,
    "4 points, lengths": True,
    "tracker": True,
}
HELD_MM = 0.2  # mean over the workspace after 100 touches of a kind that measures a length

ROW = re.compile(r"^(\S.*?) +(\d+)((?: +[\d.]+){5}) +(\d+)/(\d+)$")


def main(program):
    run = subprocess.run([program, "--robots", str(ROBOTS), "--seed", "3"],
                         capture_output=True, text=True, check=True, timeout=100)
    assert not run.stderr, "robots that could not be identified:\n" + run.stderr
    before = float(re.search(r"^not calibrated +([\d.]+)$", run.stdout, re.M).group(1))
    rows = {}
    for line in run.stdout.splitlines():
        if row := ROW.match(line):
            figures = [float(figure) for figure in row.group(3).split()]
            rows[row.group(1), int(row.group(2))] = figures, int(row.group(4)), int(row.group(5))
    wanted = {(kind, touches) for kind in KINDS for touches in TOUCHES}
    assert rows.keys() == wanted, f"rows missing or unknown: {sorted(rows.keys() ^ wanted)}"
    for (kind, touches), ((m2, m2_max, m3, m3_max, _), published, of) in rows.items():
        name = f"{kind}, {touches} touches"
        assert of == ROBOTS and published == ROBOTS, f"{name}: {published} of {of} let through"
        assert m2 < m2_max and m3 < m3_max, f"{name}: a mean beyond its largest"
        assert m3 < before, f"{name}: {m3} mm, no better than not calibrated ({before})"
        if touches == TOUCHES[-1]:
            held = m3 < HELD_MM
            assert held == KINDS[kind], f"{name}: {m3} mm over the workspace"


if __name__ == "__main__":
    main(sys.argv[1])
