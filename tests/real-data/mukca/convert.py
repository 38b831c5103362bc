#!/usr/bin/env python3
"""Converts the original recordings to cell and touches files, one folder per robot and place.

    convert.py FOLDER_OF_ORIGINALS

The originals (data/ of https://github.com/platonics-delft/kinematics_calibration) are
ROBOT/PLACE/hole_{0,1}.csv, a row of seven joint angles [rad] per pose with the ball in socket 0 or
1. Sockets are named after the place, because the fixture was at a different position at each place.
"""
import csv
import math
import pathlib
import sys

# Folder of the originals -> folder here, robot file, joint names, tool (the URDF's fixed joints from
# the flange to ball_link), its mass, and the noise of one touch.
ROBOTS = {
    "kuka_14": ("iiwa14", "iiwa14.toml", [f"A{i}" for i in range(1, 8)],
                ([0.0, 0.0, 40.0], [0.0, 0.0, 0.0]), 0.0, 0.07),
    "panda_1": ("panda_1", "panda.toml", [f"panda_joint{i}" for i in range(1, 8)],
                ([0.02517094739, -0.08476622533, 133.52829790848], [-45.0, 0.0, 0.0]), 0.76, 0.15),
    "panda_3_bis": ("panda_3_bis", "panda.toml", [f"panda_joint{i}" for i in range(1, 8)],
                    ([0.02517094739, -0.08476622533, 133.52829790848], [-45.0, 0.0, 0.0]), 0.76, 0.1),
}

CELL = """\
# {original}/{place} of the MUKCa recordings (Franzese, Spahn, Kober, Della Santina, arXiv 2503.12584;
# MIT, see ../../LICENSE): a ball at the arm's tip sits in one of two sockets, 50 mm apart. Why each
# sigma is what it is stands in ../../../README.md.
format = "cellcal.cell/1"
robot = "{robot}"

[tool]
xyz_mm = {xyz}
abc_deg = {abc}
xyz_sigma_mm = [1.0, 1.0, 1.0]
mass_kg = {mass}

[[target]]
id = "{place}_0"
kind = "point"

[[target]]
id = "{place}_1"
kind = "point"

[[length]]
between = ["{place}_0", "{place}_1"]
mm = 50.0
sigma_mm = 0.05

[touch]
sigma_mm = {sigma}
radius_offset_sigma_mm = 0.0
"""


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        print(__doc__)
        sys.exit(2)
    here = pathlib.Path(__file__).parent
    for original, (folder, robot, joints, (xyz, abc), mass, sigma) in ROBOTS.items():
        for place in sorted((pathlib.Path(sys.argv[1]) / original).iterdir()):
            out = here / folder / place.name
            out.mkdir(parents=True, exist_ok=True)
            (out / "cell.toml").write_text(CELL.format(
                original=original, place=place.name, robot=robot, xyz=xyz, abc=abc,
                mass=mass, sigma=sigma))
            lines = [f"# {original}/{place.name} of the MUKCa recordings, arXiv 2503.12584; MIT, "
                     "see ../../LICENSE", ",".join(joints) + ",target,set"]
            for hole in (0, 1):
                with open(place / f"hole_{hole}.csv", newline="", encoding="utf-8") as rows:
                    for row in csv.reader(rows):
                        angles = [math.degrees(float(value)) for value in row]
                        if len(angles) != len(joints) or not all(map(math.isfinite, angles)):
                            sys.exit(f"{place}/hole_{hole}.csv: expected {len(joints)} finite numbers")
                        # 1e-7 deg is 1e-6 mm at 1 m.
                        lines.append(",".join(f"{angle:.7f}" for angle in angles)
                                     + f",{place.name}_{hole},fit")
            (out / "touches.csv").write_text("\n".join(lines) + "\n")
            print(f"{out}: {len(lines) - 2} touches")


if __name__ == "__main__":
    main()
