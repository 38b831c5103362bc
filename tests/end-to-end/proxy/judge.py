"""Requirements on every session, independent of its fault. Verified from the relayed messages and the daemon's files, by an
independent model of command and arm.

One reply is one cycle of the command: losses are not compensated (drivers/kuka/README.md), and the command is judged as
sent. The commanded angle is the sum of the controller's true start pose and the reply's correction."""

import csv
import math
import re
import tomllib
from dataclasses import dataclass

import relay as r
from relay import FROM_SENSOR, PACKETS, REPLIES, TO_SENSOR

CYCLE_S = 0.004
SLACK = 1.03            # of every limit
SEARCH_DEG_S = 3.0      # maximum of an axis, in a search: from this a stop may be hard
DEAD_MAN_S = 0.025      # silence of the sensor that stops a search
BRAKE_S = 0.020         # until a search is at rest
LATE_S = 0.010          # tolerated delay of this machine, from the terminal to the cycle
TOUCH_MM = 0.1
STILL_DEG = 1e-5


@dataclass
class Limits:
    speed: list  # of each axis, deg/s
    acceleration: float
    jerk: float


@dataclass
class Said:
    """A reply, and the packet that it answers."""
    at_s: float
    packet_s: float     # when that was delivered to the daemon; 0: unknown
    ipoc: int           # as delivered
    command: list       # deg
    start: tuple        # the controller's true start pose
    rounding: float     # half of the last decimal, deg
    taken: bool         # by the controller's own count of late replies
    late: int           # that count with the packet
    told: int           # and as delivered to the daemon


def delay_of(text):
    found = re.search(rb'<Delay D="(\d+)"', text)
    return int(found[1]) if found else 0


def replies(passed):
    """In the order sent by the daemon."""
    packets = [p for p in passed if p.line == PACKETS]
    for p, behind in zip(packets, packets[1:] + packets[-1:]):
        p.lost = delay_of(behind.data) > delay_of(p.data)
    handed = sorted(((when, part, p) for p in packets for when, part in p.sent), key=lambda h: h[0])
    first = {}  # packets of an IPOC; later ones are repetitions of the same packet
    for when, part, p in handed:
        first.setdefault(r.ipoc_of(part), (when, p, delay_of(part)))
    out, start, i = [], None, 0
    for it in (p for p in passed if p.line == REPLIES):
        while i < len(handed) and handed[i][0] <= it.came_s:
            start, i = tuple(r.numbers(handed[i][2].data, "ASPos")), i + 1
        correction, ipoc = r.numbers(it.data, "AK"), r.ipoc_of(it.data)
        if correction is None:
            continue  # no command to the arm
        when, of, told = first.get(ipoc, (0.0, None, 0))
        begun = tuple(r.numbers(of.data, "ASPos")) if of else start
        decimals = len(it.data.split(b'A1="')[1].split(b'"')[0].partition(b".")[2])
        out.append(Said(it.came_s, when, ipoc, [a + b for a, b in zip(begun, correction)], begun,
                        0.5 * 10.0 ** -decimals, bool(it.sent) and not (of and of.lost), delay_of(of.data) if of else 0, told))
    return out


def moves(a, b):
    return max(abs(x - y) for x, y in zip(a.command, b.command)) > STILL_DEG


@dataclass
class Held:
    """Possible state of the controller's command. All in deg and s."""
    command: list
    speed: list
    acceleration: list

    def key(self):
        """Identical for states that differ only by the rounding of sums."""
        return tuple(round(v, digits) for values, digits in ((self.command, 5), (self.speed, 2), (self.acceleration, 0))
                     for v in values)


def step(held, one, limits):
    """State after this reply, and its violation; "" if none."""
    speed = [(b - a) / CYCLE_S for a, b in zip(held.command, one.command)]
    change = [(b - a) / CYCLE_S for a, b in zip(held.speed, speed)]
    jerk = [(b - a) / CYCLE_S for a, b in zip(held.acceleration, change)]
    next_ = Held(one.command, speed, change)
    stops = (max(map(abs, held.speed)) <= SEARCH_DEG_S and
             all(abs(b) <= abs(a) + 1e-3 and a * b >= -1e-9 for a, b in zip(held.speed, speed)))
    q, wrong = one.rounding, ""
    for i in range(6):
        if abs(speed[i]) > SLACK * limits.speed[i] + 2 * q / CYCLE_S:
            return next_, f"A{i + 1} is asked for {speed[i]:.1f} deg/s"
        if abs(change[i]) > SLACK * limits.acceleration + 4 * q / CYCLE_S ** 2:
            wrong = wrong or f"A{i + 1} is asked for {change[i]:.0f} deg/s2"
        elif abs(jerk[i]) > SLACK * limits.jerk + 8 * q / CYCLE_S ** 3:
            wrong = wrong or f"A{i + 1} is asked for {jerk[i]:.0f} deg/s3"
    if wrong and stops:  # a search stops hard; the next motion begins without acceleration
        return Held(one.command, speed, [0.0] * 6), ""
    return next_, wrong


def may_hold(all_held, last, one, taken):
    """Possible states of the controller when this reply arrives, after the last one. A reply that it did not accept changes
    nothing; if the count delivered to the daemon indicates that, the daemon may continue from either. If a cycle actually passed
    without a reply, the arm has stopped: the command may continue at its previous speed or from rest, also from the last reply,
    since the daemon cannot know whether it was accepted."""
    held = taken if last.taken else []
    if not last.taken or one.told > last.told:
        held = held + all_held
    if one.late > last.late:
        held = held + [Held(at, [0.0] * 6, [0.0] * 6) for at in [last.command] + [h.command for h in held]]
    return list({h.key(): h for h in held}.values())


def judge_motion(said, limits):
    """(a): speed, acceleration and jerk of every axis, reply by reply, also across the fault."""
    found, answered, last, all_held, taken = [], {}, None, [], []
    for one in said:
        if last and one.start == last.start and answered.get(one.ipoc) == one.command:
            continue  # a repeated packet gets the same reply; a controller accepts one of them
        if last is None or one.start != last.start:  # a session of the controller begins at rest
            correction = max(abs(a - b) for a, b in zip(one.command, one.start))
            if last is not None and correction > 0.05:
                found.append((one.at_s, f"the first reply of a session asks for {correction:.3f} deg at once"))
            answered, all_held = {}, [Held(one.command, [0.0] * 6, [0.0] * 6)]
            taken = all_held
        else:
            all_held = may_hold(all_held, last, one, taken)
            steps = [(held, *step(held, one, limits)) for held in all_held]
            right = [(held, next_) for held, next_, wrong in steps if not wrong]
            if not right:
                found.append((one.at_s, steps[0][2]))
                right = [(held, next_) for held, next_, _ in steps[:1]]
            all_held, taken = [held for held, _ in right], [next_ for _, next_ in right]
        answered[one.ipoc], last = one.command, one
    return found


def judge_stops(passed, said):
    """(b): a trip, a contact, and a silent sensor stop a search in the next reply. By the times at which the relay
    itself delivered the messages; LATE_S allows for delays of this machine."""
    found = []
    events = [(when, p.line, r.decode(part)) for p in passed if p.line in (FROM_SENSOR, TO_SENSOR) for when, part in p.sent]
    events += [(b.packet_s, REPLIES, (a, b)) for a, b in zip(said, said[1:]) if b.packet_s and a.start == b.start]
    armed, of, heard, stop_s, why, before = False, b"", 0.0, None, "", 0.0
    for at, line, it in sorted(events, key=lambda e: e[0]):
        if line == TO_SENSOR:
            if it and it[0] == r.ARM:
                armed, stop_s, of = True, None, it[2:4]
            elif it and it[0] == r.DISARM:
                armed, stop_s = False, None
        elif line == FROM_SENSOR and it:
            heard = at
            # An unacknowledged contact is repeated, also during the next arming.
            if armed and (it[0] == r.TRIP and it[2:4] == of or it[0] == r.CONTACT and it[4:6] == of):
                armed, stop_s, why = False, at, "the sensor's word"
        elif line == REPLIES:
            if armed and stop_s is None and heard and at - heard > DEAD_MAN_S:
                armed, stop_s, why = False, heard + DEAD_MAN_S, "the sensor's silence"
            a, b = it
            speed = max(abs(x - y) for x, y in zip(a.command, b.command)) / CYCLE_S
            if stop_s is not None and speed > 1e-2:
                after = at - stop_s
                # The retreat begins when the arm is at rest, at least 50 ms later.
                if LATE_S < after < LATE_S + 0.030 and speed >= before - 1e-2 and before > 0.05:
                    found.append((b.at_s, f"{after * 1e3:.0f} ms after {why} the search goes on at {speed:.2f} deg/s"))
            if stop_s is not None and at - stop_s > LATE_S + 0.030:
                stop_s = None
            before = speed
    return found


def judge_end(said, ended_s):
    """(c): no motion after the end."""
    behind = [one for one in said if one.at_s > ended_s]
    if not behind:
        return []
    before = [one for one in said if one.at_s <= ended_s][-1:]
    return [(b.at_s, f"{b.at_s - ended_s:.2f} s behind the end the command moves")
            for a, b in zip(before + behind, behind) if a.start == b.start and moves(a, b)]


class Arm:
    """Position of the tip, from the robot file's table and the cell file's tool."""

    def __init__(self, cell_file):
        with open(cell_file, "rb") as f:
            cell = tomllib.load(f)
        with open(f"{cell_file.rpartition('/')[0]}/{cell['robot']}", "rb") as f:
            self.joints = tomllib.load(f)["joint"]
        self.tool = cell["tool"]["xyz_mm"]

    def speeds_deg_s(self):
        return [joint["max_speed_deg_s"] for joint in self.joints]

    def tip_mm(self, axes_deg):
        tip = self.tool
        for joint, deg in reversed(list(zip(self.joints, axes_deg))):
            x, y, z = tip
            for angle, turn in ((joint["beta_deg"], "y"), (joint["alpha_deg"], "x")):
                c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
                x, y, z = (c * x + s * z, y, c * z - s * x) if turn == "y" else (x, c * y - s * z, s * y + c * z)
            x, z = x + joint["a_mm"], z + joint["d_mm"]
            theta = math.radians(joint["sign"] * deg + joint["offset_deg"])
            c, s = math.cos(theta), math.sin(theta)
            tip = c * x - s * y, s * x + c * y, z
        return tip


def touches(file):
    try:
        with open(file) as f:
            return [[float(row[f"A{i}"]) for i in range(1, 7)] for row in csv.DictReader(f)]
    except FileNotFoundError:
        return []


def judge_touches(arm, measured, reference):
    """(d): each touch agrees with that of the session without faults."""
    if len(measured) > len(reference):
        return [(0.0, "more touches than were planned")]
    off = [math.dist(arm.tip_mm(a), arm.tip_mm(b)) for a, b in zip(measured, reference)]
    return [(0.0, f"touch {i + 1} is {mm:.3f} mm from that of the session without faults")
            for i, mm in enumerate(off) if not mm <= TOUCH_MM]
