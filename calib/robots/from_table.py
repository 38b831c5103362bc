#!/usr/bin/env python3
"""Makes robot files (cellcal.robot/1) from a table of KUKA dimensions.

    from_table.py TABLE.csv [OUTPUT_FOLDER]

Columns of the table: model, source, c1, a1, c2, a2_up, c3, c4, b [mm], reach_wc [mm], and for each
axis A1..A6 its min and max [deg] and vel [deg/s]. c1 height of axis 2, a1 its reach, c2 upper arm,
a2_up height of the wrist axis above axis 3 in the zero pose, c3 forearm, c4 wrist to flange, b
sideways offset of the arm. All axes at zero: the arm lies stretched out along +x.

Rows that are known to be wrong are named and skipped; rows that cannot be put into the form below,
or that disagree with their own reach, are errors. Two rows of one robot from two sources become one
file, if they agree in every number.
"""
import csv
import math
import pathlib
import re
import sys

# Rows whose source is wrong, and why.
KNOWN_BAD = {
    "kr120r2500pro": "its limits and speeds are those of another robot (KR 16-2)",
    "kr210l150": "rounded dimensions and another joint zero",
    "kr210_r3100_ultra": "axis 1 turns the other way in the source",
}

# Manufacturing tolerance of a length grows about with the size of the casting: 0.5 mm per metre of
# reach gives 0.7 mm for the 1.4 m class, where priors of 0.7 mm and 0.6 mrad reproduce the 2-3 mm
# that uncalibrated arms are found to be wrong by. Mastering marks and axis squareness are angles and
# do not grow with the arm.
TOLERANCE_MM_PER_M = 0.5
TOLERANCE_DEG = 0.035

# From this payload in kg on, KUKA's arms have a counterbalance at A2. It and the rising stiffness of
# their gears are sought with these priors: a spring of 5 kN m deflects a gear of 3e6 N m/rad by 340 arcsec.
HEAVY_KG = 120
HEAVY = {
    "A2": "counterbalance_sigma_arcsec = 300.0\nstiffening_sigma_arcsec = 60.0\nstiffening_nm = 1000.0\n",
    "A3": "stiffening_sigma_arcsec = 60.0\nstiffening_nm = 1000.0\n",
}

# What a reader of one file must know beyond its numbers.
NOTES = {
    "kr5_arc": """\
# KR 5 arc or KR 5 R1400? Two descriptions of what the name plate calls "KR 5 R1400" are public, and
# they differ by 80 mm and 35 mm:
#   this file       forearm offset a3 = 120 mm, wrist to flange d6 = 115 mm
#   kr5_r1400.toml  forearm offset a3 =  40 mm, wrist to flange d6 =  80 mm
# Both round to a reach of 1400 mm, so the name does not decide it. On the real cell: select
# $TOOL = $NULLFRAME and $BASE = $NULLFRAME, move to A1..A6 = 0, -90, 90, 0, 90, 0 and read the
# Cartesian position on the pendant:
#   X 800.0, Z 1005.0 mm   this file
#   X 800.0, Z  960.0 mm   kr5_r1400.toml
# Anything else: neither; measure before calibrating.
""",
}


def canonical(model):
    """kr6r900_2 and kr6_r900_2 are the same robot: always with an underscore before the reach."""
    model = re.sub(r"^(kr\d+)(r\d+)", r"\1_\2", model)
    return re.sub(r"(\d)(sixx|pro)", r"\1_\2", model)


def display_name(model):
    """kr10_r1100_2 -> KUKA KR 10 R1100-2"""
    head, *rest = model.split("_")
    text = "KUKA KR " + head[2:]
    for word in rest:
        if re.fullmatch(r"r\d+", word):
            text += " R" + word[1:]
        elif word.isdigit():
            text += "-" + word
        elif word in ("arc", "sixx"):
            text += " " + word
        else:
            text += " " + word.upper()
    return text


def number(row, key):
    try:
        value = float(row[key])
    except (KeyError, TypeError, ValueError):
        sys.exit(f"{row.get('model')}: column {key} is missing or not a number")
    if not math.isfinite(value):
        sys.exit(f"{row['model']}: column {key} is not finite")
    return value


def check(row):
    n = lambda key: number(row, key)
    if n("b") != 0.0:
        sys.exit(f"{row['model']}: sideways offset b is not zero; this form has no place for it")
    reach = n("a1") + n("c2") + math.hypot(n("c3"), n("a2_up"))
    if abs(reach - n("reach_wc")) > 0.06:  # the table rounds to 0.1 mm
        sys.exit(f"{row['model']}: dimensions give a reach of {reach:.1f} mm, "
                 f"the table says {row['reach_wc']}")


def joints(row):
    """DH rows: sign, offset, d, a, alpha, errors. The second joint's axis is parallel to the
    third's, so its d is replaced by Hayati's beta."""
    n = lambda key: number(row, key)
    dh = '"theta", "d", "a", "alpha"'
    hayati = '"theta", "a", "alpha", "beta"'
    return [
        (-1, 0.0, n("c1"), n("a1"), -90.0, dh),
        (1, 0.0, 0.0, n("c2"), 0.0, hayati),
        (1, -90.0, 0.0, n("a2_up"), -90.0, dh),
        (-1, 0.0, n("c3"), 0.0, 90.0, dh),
        (1, 0.0, 0.0, 0.0, -90.0, dh),
        (-1, 180.0, n("c4"), 0.0, 0.0, dh),
    ]


def robot_file(name, rows):
    row = rows[0]
    source = " and ".join(r["source"] for r in rows)
    tolerance = round(TOLERANCE_MM_PER_M * number(row, "reach_wc") / 1000.0, 2)
    out = ["# Made by from_table.py; tolerances and the form are explained there.\n"]
    out.append(NOTES.get(name, ""))
    out.append(f'format = "cellcal.robot/1"\nname = "{display_name(name)}"\n')
    out.append(f'source = "{source}"\n')
    out.append("gravity = [0.0, 0.0, -9.81]        # standing on the floor\n\n")
    out.append(f"[tolerance]\nlength_mm = {tolerance}\nangle_deg = {TOLERANCE_DEG}\n")
    for index, (sign, offset, d, a, alpha, errors) in enumerate(joints(row), start=1):
        axis = f"A{index}"
        out.append(f"""
[[joint]]
name = "{axis}"
sign = {sign}
offset_deg = {offset}
d_mm = {d}
a_mm = {a}
alpha_deg = {alpha}
beta_deg = 0.0
errors = [{errors}]
min_deg = {number(row, axis + "min")}
max_deg = {number(row, axis + "max")}
max_speed_deg_s = {number(row, axis + "vel")}
{HEAVY.get(axis, "") if int(re.match(r"kr(\d+)", name)[1]) >= HEAVY_KG else ""}""")
    return "".join(out)


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        sys.exit(0 if len(sys.argv) == 2 and sys.argv[1].startswith("-") else 2)
    folder = pathlib.Path(sys.argv[2] if len(sys.argv) == 3 else pathlib.Path(__file__).parent)
    with open(sys.argv[1], newline="", encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    robots = {}
    for row in rows:
        if row["model"] in KNOWN_BAD:
            print(f"{row['model']}: skipped, {KNOWN_BAD[row['model']]}")
            continue
        check(row)
        same = robots.setdefault(canonical(row["model"]), [])
        differing = [key for key in row if key not in ("model", "source")
                     and same and row[key] != same[0][key]]
        if differing:
            sys.exit(f"{row['model']} and {same[0]['model']} differ in {', '.join(differing)}")
        same.append(row)
    for name, same in robots.items():
        (folder / f"{name}.toml").write_text(robot_file(name, same), encoding="utf-8")
    print(f"{len(robots)} robot files in {folder}")


if __name__ == "__main__":
    main()
