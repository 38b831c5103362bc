#!/usr/bin/env python3
"""Makes a robot file (cellcal.robot/1) from a URDF.

    from_urdf.py ROBOT.urdf --root LINK --flange LINK [-o ROBOT.toml]
                 [--joint-names A1,A2,...] [--name TEXT] [--source TEXT]
                 [--tolerance-length-mm X] [--tolerance-angle-deg X]
                 [--masses CSV --compliance X --compliant-joints A2,A3,...]
                 [--tool LINK]      print the fixed transform flange -> LINK as a [tool] table
    from_urdf.py ROBOT.urdf --root LINK --flange LINK --check ROBOT.toml
                 compare an existing robot file with the URDF; exit status 1 if they differ

The chain from root to flange may hold revolute, continuous and fixed joints. Each moving joint
becomes Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta): Denavit-Hartenberg along the common normal of its
axis and the next one's, or, where the two are parallel within PARALLEL_DEG, Hayati's form with beta
in place of d. What lies before the first axis and after the last goes into [base] and [flange].

Masses: a CSV with columns joint, mass_kg, x_mm, y_mm, z_mm: the mass that each joint moves and its
centre in the root's frame with all joints at zero. With them, the joints named as compliant give
under gravity's torque, with a prior of X rad/(N m).

Every file written is read back and compared with the URDF's own forward kinematics at random
joint angles; a difference above 1e-9 mm is an error. Nothing beyond Python's library is needed.
"""
import argparse
import csv
import math
import pathlib
import random
import sys
import tomllib
import xml.etree.ElementTree as ElementTree

# Below this angle between consecutive axes the common normal runs away (its foot moves by
# 1/sin(angle)), and an error of the angle looks like a huge error of d: use Hayati's form.
PARALLEL_DEG = 5.0
# Two axes nearer than this intersect; the direction of their common normal is then free.
INTERSECT_MM = 1e-9
AGREE_MM = 1e-9
AGREE_RAD = 1e-12
CHECK_POSES = 1000

# Per joint where nothing better is known: 0.5 mm per metre between base and flange with all lengths
# laid end to end, and what a mastering mark and a machined squareness are good for.
TOLERANCE_MM_PER_M = 0.5
TOLERANCE_MM_LEAST = 0.3
TOLERANCE_DEG = 0.035


# --- small linear algebra; a frame is (R as three rows, p), lengths in mm ---------------------

def rows(*values):
    return [list(values[0:3]), list(values[3:6]), list(values[6:9])]


IDENTITY = (rows(1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0), [0.0, 0.0, 0.0])


def rotate(matrix, vector):
    return [math.fsum(row[k] * vector[k] for k in range(3)) for row in matrix]


def compose(*frames):
    result = IDENTITY
    for matrix, position in frames:
        moved = rotate(result[0], position)
        result = ([[math.fsum(row[k] * matrix[k][j] for k in range(3)) for j in range(3)]
                   for row in result[0]], [result[1][k] + moved[k] for k in range(3)])
    return result


def inverse(frame):
    matrix, position = frame
    transposed = [[matrix[j][i] for j in range(3)] for i in range(3)]
    return transposed, [-x for x in rotate(transposed, position)]


def dot(a, b):
    return math.fsum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def norm(a):
    return math.hypot(*a)


def turn(axis, angle):
    """Rotation about a unit axis (Rodrigues)."""
    x, y, z = axis
    c, s, v = math.cos(angle), math.sin(angle), 1.0 - math.cos(angle)
    return rows(x * x * v + c, x * y * v - z * s, x * z * v + y * s,
                x * y * v + z * s, y * y * v + c, y * z * v - x * s,
                x * z * v - y * s, y * z * v + x * s, z * z * v + c), [0.0, 0.0, 0.0]


def shift(x, y, z):
    return IDENTITY[0], [x, y, z]


X, Y, Z = [1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]


# --- reading ----------------------------------------------------------------------------------

def numbers(text, where):
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != 3 or not all(map(math.isfinite, values)):
        sys.exit(f"{where}: expected three finite numbers, found '{text}'")
    return values


def read_chain(path, root, tip):
    """Joints from root to tip as (name, type, frame, axis, min, max, speed)."""
    try:
        tree = ElementTree.parse(path)
    except (OSError, ElementTree.ParseError) as problem:
        sys.exit(f"{path}: {problem}")
    into = {}
    for joint in tree.getroot().findall("joint"):
        child = joint.find("child")
        if child is not None:
            into[child.get("link")] = joint
    chain, link, seen = [], tip, set()
    while link != root:
        if link not in into or link in seen:
            sys.exit(f"{path}: no chain of joints leads from link '{root}' to link '{tip}' "
                     f"(stopped at '{link}'); check --root and --flange")
        seen.add(link)
        joint = into[link]
        name, kind = joint.get("name"), joint.get("type")
        where = f"{path}: joint '{name}'"
        if kind not in ("revolute", "continuous", "fixed"):
            sys.exit(f"{where}: type '{kind}' cannot be put into a robot file")
        if joint.find("mimic") is not None:
            sys.exit(f"{where}: follows another joint (mimic); it cannot be put into a robot file")
        origin = joint.find("origin")
        xyz = numbers(origin.get("xyz", "0 0 0") if origin is not None else "0 0 0", where)
        rpy = numbers(origin.get("rpy", "0 0 0") if origin is not None else "0 0 0", where)
        frame = compose(shift(*(1000.0 * x for x in xyz)),
                        turn(Z, rpy[2]), turn(Y, rpy[1]), turn(X, rpy[0]))
        axis, low, high, speed = X, -2.0 * math.pi, 2.0 * math.pi, 0.0
        if kind != "fixed":
            if joint.find("axis") is not None:
                axis = numbers(joint.find("axis").get("xyz", ""), where)
            if norm(axis) < 1e-9:
                sys.exit(f"{where}: its axis has no direction")
            axis = [x / norm(axis) for x in axis]
            limit = joint.find("limit")
            if limit is None:
                sys.exit(f"{where}: has no <limit>; a robot file needs limits and speed")
            speed = float(limit.get("velocity", "0"))
            if kind == "revolute":
                low, high = float(limit.get("lower", "0")), float(limit.get("upper", "0"))
            if not (low < high and speed > 0.0):
                sys.exit(f"{where}: <limit> has no range or no velocity")
        chain.append((name, kind, frame, axis, low, high, speed))
        link = joint.find("parent").get("link")
    return chain[::-1]


def urdf_forward(chain, angles):
    frame, angles = IDENTITY, iter(angles)
    for _, kind, fixed, axis, *_ in chain:
        frame = compose(frame, fixed)
        if kind != "fixed":
            frame = compose(frame, turn(axis, next(angles)))
    return frame


# --- conversion -------------------------------------------------------------------------------

def joint_frame(theta, d, a, alpha, beta):
    return compose(turn(Z, theta), shift(0, 0, d), shift(a, 0, 0), turn(X, alpha), turn(Y, beta))


def link_parameters(point, direction, last):
    """(theta, d, a, alpha, beta, hayati) that bring the frame's z axis onto the line through
    `point` along `direction`, both seen in the frame whose z axis is the joint's own."""
    across = cross(Z, direction)
    if norm(across) < math.sin(math.radians(PARALLEL_DEG)):
        if last:  # no further axis: d may stay, and only it keeps the flange's height
            if math.hypot(point[0], point[1]) < INTERSECT_MM and norm(across) == 0.0:
                return 0.0, point[2], 0.0, math.atan2(0.0, direction[2]), 0.0, False
        # Hayati: the next frame sits where the next axis pierces this frame's xy plane.
        along = point[2] / direction[2]
        foot = [point[0] - along * direction[0], point[1] - along * direction[1]]
        a = math.hypot(*foot)
        theta = math.atan2(foot[1], foot[0]) if a > INTERSECT_MM else 0.0
        theta, a = (theta, a) if a > INTERSECT_MM else (0.0, 0.0)
        if abs(theta) > math.pi / 2 + 1e-12:  # small offsets, signed lengths
            theta, a = theta - math.copysign(math.pi, theta), -a
        v = rotate(turn(Z, -theta)[0], direction)
        return theta, 0.0, a, math.atan2(-v[1], v[2]), math.asin(v[0]), True
    normal = [x / norm(across) for x in across]
    theta = math.atan2(normal[1], normal[0])
    if theta > math.pi / 2 + 1e-12 or theta <= -math.pi / 2 + 1e-12:
        theta -= math.copysign(math.pi, theta)
        normal = [-x for x in normal]
    a = dot(point, normal)
    alpha = math.atan2(dot(cross(Z, direction), normal), direction[2])
    # Along the joint's axis to the foot of the common normal: point + t direction = a normal + d z.
    t = -dot(point, cross(Z, normal)) / dot(direction, cross(Z, normal))
    return theta, point[2] + t * direction[2], a if abs(a) > INTERSECT_MM else 0.0, alpha, 0.0, False


def convert(chain):
    """[base], joints as (theta0, d, a, alpha, beta, hayati), [flange]."""
    axes, frame = [], IDENTITY  # each axis as a line in the base frame, all joints at zero
    for _, kind, fixed, axis, *_ in chain:
        frame = compose(frame, fixed)
        if kind != "fixed":
            axes.append((frame[1], rotate(frame[0], axis), frame))
    if not axes:
        sys.exit("the chain has no moving joint")
    tip = frame
    # First frame: the URDF's own at the first joint, turned the short way so that z is its axis.
    _, _, first = axes[0]
    local = rotate(inverse(first)[0], axes[0][1])
    across = cross(Z, local)
    angle = math.atan2(norm(across), local[2])
    unit = [x / norm(across) for x in across] if norm(across) > 1e-12 else X
    base = here = compose(first, turn(unit, angle))
    joints = []
    for index in range(len(axes)):
        last = index + 1 == len(axes)
        point, direction = (tip[1], [row[2] for row in tip[0]]) if last else axes[index + 1][:2]
        back = inverse(here)
        seen = compose(back, shift(*point))[1]
        parameters = link_parameters(seen, rotate(back[0], direction), last)
        joints.append(parameters)
        here = compose(here, joint_frame(*parameters[:5]))
    return base, joints, compose(inverse(here), tip)


def abc_deg(matrix):
    """A, B, C of R = Rz(A) Ry(B) Rx(C)."""
    b = math.atan2(-matrix[2][0], math.hypot(matrix[0][0], matrix[1][0]))
    if math.cos(b) < 1e-9:  # A and C turn about the same axis: C = 0
        return [math.degrees(math.atan2(-matrix[0][1], matrix[1][1])), math.degrees(b), 0.0]
    return [math.degrees(math.atan2(matrix[1][0], matrix[0][0])), math.degrees(b),
            math.degrees(math.atan2(matrix[2][1], matrix[2][2]))]


def tidy(value):
    """Rounds off what double arithmetic left behind; 1e-11 is far below what the check allows."""
    value = round(value, 11) + 0.0
    return repr(value)


def frame_table(name, frame):
    xyz, abc = (", ".join(map(tidy, values)) for values in (frame[1], abc_deg(frame[0])))
    return f"\n[{name}]\nxyz_mm = [{xyz}]\nabc_deg = [{abc}]\n"


def is_identity(frame):
    return all(float(tidy(v)) == 0.0 for v in frame[1] + abc_deg(frame[0]))


def read_masses(path, names):
    """{joint name: (mass [kg], centre [mm])}"""
    masses = {}
    try:
        with open(path, newline="", encoding="utf-8") as lines:
            for row in csv.DictReader(line for line in lines if not line.startswith("#")):
                masses[row["joint"]] = (float(row["mass_kg"]),
                                        [float(row[key]) for key in ("x_mm", "y_mm", "z_mm")])
    except (OSError, KeyError, TypeError, ValueError) as problem:
        sys.exit(f"{path}: {problem!r}; expected joint,mass_kg,x_mm,y_mm,z_mm")
    if sorted(masses) != sorted(names):
        sys.exit(f"{path}: its joints are {sorted(masses)}, the robot's {sorted(names)}")
    return masses


def mass_lines(name, here, masses, compliant, args):
    if name not in masses:
        return ""
    mass, centre = masses[name]
    com = ", ".join(repr(round(x, 3) + 0.0) for x in compose(inverse(here), shift(*centre))[1])
    text = f"mass_kg = {mass}\ncom_mm = [{com}]\n"
    if name in compliant:
        text += f"compliance_sigma_rad_per_nm = {args.compliance}\n"
    return text


def robot_file(chain, args):
    base, joints, flange = convert(chain)
    moving = [joint for joint in chain if joint[1] != "fixed"]
    names = args.joint_names.split(",") if args.joint_names else [joint[0] for joint in moving]
    if len(names) != len(moving) or len(set(names)) != len(names):
        sys.exit(f"--joint-names: the chain has {len(moving)} moving joints, all names differ")
    reach_m = sum(math.hypot(d, a) for _, d, a, *_ in joints) / 1000.0
    tolerance = (args.tolerance_length_mm
                 or max(TOLERANCE_MM_LEAST, round(TOLERANCE_MM_PER_M * reach_m, 2)))
    masses = read_masses(args.masses, names) if args.masses else {}
    compliant = args.compliant_joints.split(",") if args.compliant_joints else []
    if not set(compliant) <= set(masses) or (compliant and not args.compliance):
        sys.exit("--compliant-joints: needs --compliance, and --masses with each of these joints")
    out = [f"""# Made by from_urdf.py from {pathlib.Path(args.urdf).name}, {args.root} to {args.flange}; \
agrees with it within {AGREE_MM} mm.
format = "cellcal.robot/1"
name = "{args.name or pathlib.Path(args.urdf).stem}"
source = "{args.source or pathlib.Path(args.urdf).name}"
gravity = [0.0, 0.0, -9.81]        # standing on the floor

[tolerance]
length_mm = {tolerance}
angle_deg = {args.tolerance_angle_deg or TOLERANCE_DEG}
"""]
    if not is_identity(base):
        out.append(frame_table("base", base))
    if not is_identity(flange):
        out.append(frame_table("flange", flange))
    here = base
    for name, joint, parameters in zip(names, moving, joints):
        theta, d, a, alpha, beta, hayati = parameters
        here = compose(here, joint_frame(*parameters[:5]))
        errors = '"theta", "a", "alpha", "beta"' if hayati else '"theta", "d", "a", "alpha"'
        _, _, _, _, low, high, speed = joint
        out.append(f"""
[[joint]]
name = "{name}"
sign = 1
offset_deg = {tidy(math.degrees(theta))}
d_mm = {tidy(d)}
a_mm = {tidy(a)}
alpha_deg = {tidy(math.degrees(alpha))}
beta_deg = {tidy(math.degrees(beta))}
errors = [{errors}]
min_deg = {round(math.degrees(low), 4)}
max_deg = {round(math.degrees(high), 4)}
max_speed_deg_s = {round(math.degrees(speed), 4)}
{mass_lines(name, here, masses, compliant, args)}""")
    return "".join(out)


# --- checking ---------------------------------------------------------------------------------

def toml_frame(table):
    if table is None:
        return IDENTITY
    a, b, c = map(math.radians, table["abc_deg"])
    return compose(shift(*table["xyz_mm"]), turn(Z, a), turn(Y, b), turn(X, c))


def toml_forward(robot, angles):
    frame = toml_frame(robot.get("base"))
    for joint, angle in zip(robot["joint"], angles):
        theta = joint["sign"] * angle + math.radians(joint["offset_deg"])
        frame = compose(frame, joint_frame(theta, joint["d_mm"], joint["a_mm"],
                                           math.radians(joint["alpha_deg"]),
                                           math.radians(joint["beta_deg"])))
    return compose(frame, toml_frame(robot.get("flange")))


def compare(text, chain):
    """Worst difference over random joint angles as (mm, rad)."""
    robot = tomllib.loads(text)
    moving = [joint for joint in chain if joint[1] != "fixed"]
    if len(robot["joint"]) != len(moving):
        sys.exit(f"the robot file has {len(robot['joint'])} joints, the URDF {len(moving)}")
    generator, worst_mm, worst_rad = random.Random(1), 0.0, 0.0
    for _ in range(CHECK_POSES):
        angles = [generator.uniform(-math.pi, math.pi) for _ in moving]
        expected, found = urdf_forward(chain, angles), toml_forward(robot, angles)
        worst_mm = max(worst_mm, math.dist(expected[1], found[1]))
        worst_rad = max(worst_rad, max(math.dist(a, b) for a, b in zip(expected[0], found[0])))
    return worst_mm, worst_rad


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("urdf")
    parser.add_argument("--root", required=True)
    parser.add_argument("--flange", required=True)
    parser.add_argument("-o", "--output")
    parser.add_argument("--joint-names")
    parser.add_argument("--name")
    parser.add_argument("--source")
    parser.add_argument("--tolerance-length-mm", type=float)
    parser.add_argument("--tolerance-angle-deg", type=float)
    parser.add_argument("--masses")
    parser.add_argument("--compliance", type=float)
    parser.add_argument("--compliant-joints")
    parser.add_argument("--tool")
    parser.add_argument("--check")
    args = parser.parse_args()
    chain = read_chain(args.urdf, args.root, args.flange)
    if args.check:
        text = pathlib.Path(args.check).read_text(encoding="utf-8")
    else:
        text = robot_file(chain, args)
    worst_mm, worst_rad = compare(text, chain)
    print(f"{args.check or args.name or args.urdf}: agrees with {args.urdf} within "
          f"{worst_mm:.1e} mm, {worst_rad:.1e} rad over {CHECK_POSES} poses", file=sys.stderr)
    if worst_mm > AGREE_MM or worst_rad > AGREE_RAD:
        sys.exit(f"more than {AGREE_MM} mm or {AGREE_RAD} rad: the robot file does not describe "
                 "this URDF")
    if args.tool:
        tool = read_chain(args.urdf, args.flange, args.tool)
        if any(joint[1] != "fixed" for joint in tool):
            sys.exit(f"{args.urdf}: joints between '{args.flange}' and '{args.tool}' move")
        print(frame_table("tool", urdf_forward(tool, [])))
    if args.check:
        return
    if args.output:
        pathlib.Path(args.output).write_text(text, encoding="utf-8")
    elif not args.tool:
        print(text, end="")


if __name__ == "__main__":
    main()
