"""The kinds of faults, one per session: line, instant, strength, and permitted outcomes.

A kind's instant and strength are drawn from the session's seed. `ends` is the set of permitted outcomes: "done" (all
touches taken, uninterrupted or continued by itself) or the FailureKind of a failed session."""

import os
import re
import struct
from dataclasses import dataclass, field
from typing import Callable

import relay as r
from relay import FROM_SENSOR, PACKETS, REPLIES, TO_SENSOR

DONE = {"done"}
# Permitted outcomes with a disturbed link of the robot: named, with the disturbed part.
LINK = DONE | {"robot-silent", "computer-busy", "not-following", "move-refused", "stopped-elsewhere"}
LIED_TO = LINK | {"contact-fault", "contact-too-early"}
SENSOR = DONE | {"contact-silent", "contact-fault", "computer-busy", "link-not-ready"}
EVENTS = SENSOR | {"arm-refused", "too-many-revoked", "still-in-contact", "unexpected-contact", "contact-too-early",
                   "readings-disagree"}


@dataclass
class Dose:
    """Effect: on at most `most` messages for `lasts_s`. `change` returns what is sent on: pairs (delay in s, bytes)."""
    words: str
    lines: tuple = ()
    change: Callable = None
    most: int = 1
    lasts_s: float = 1e9
    act: Callable = None  # once, at the instant: (relay, fault, now)


@dataclass
class Kind:
    name: str
    at: str  # "travel", "search", "contact" (any phase after an arming), "start"
    dose: Callable = field(repr=False)  # of a random.Random
    ends: set = field(repr=False, default_factory=set)


class Fault:
    """One kind in one session."""

    def __init__(self, kind, rng, touches):
        self.kind, self.rng, self.dose = kind, rng, kind.dose(rng) if kind else Dose("")
        self.visit = rng.randrange(touches)
        self.arming = 3 * self.visit + (rng.choice([1, 1, 2, 3]) if kind and kind.at in ("search", "contact") else 0)
        self.offset_s = rng.uniform(0.02, 0.3)
        self.seen_s = self.begun_s = None
        self.done = 0

    def tick(self, relay, now):
        if self.kind is None or self.begun_s is not None:
            return
        at = self.kind.at
        if self.seen_s is None:
            there = (at == "start" or relay.armings >= self.arming and
                     (at == "contact" and relay.armed or at == relay.doing))
            if not there:
                return
            self.seen_s = now
        if at == "start" or now >= self.seen_s + (0.0 if at == "contact" else self.offset_s):
            self.begin(relay, now)

    def begin(self, relay, now):
        self.begun_s = now
        if self.dose.act:
            self.dose.act(relay, self, now)

    def touch(self, relay, line, data, now):
        self.tick(relay, now)
        dose = self.dose
        if (self.begun_s is None or line not in dose.lines or self.done >= dose.most
                or now > self.begun_s + dose.lasts_s):
            return [(0, data)]
        changed = dose.change(data)
        if changed is None:  # not of the intended kind
            return [(0, data)]
        self.done += 1
        return changed


class Pair:
    """Two kinds in one session, the second from up to 50 ms after the first."""

    def __init__(self, kinds, rng, touches):
        self.first, self.second = (Fault(kind, rng, touches) for kind in kinds)
        self.lag_s = rng.uniform(0.0, 0.05)
        self.dose = Dose(f"{self.first.dose.words}; {1e3 * self.lag_s:.0f} ms later {self.second.dose.words}")

    @property
    def begun_s(self):
        return self.first.begun_s  # it may end the session before the second

    def tick(self, relay, now):
        self.first.tick(relay, now)
        if self.first.begun_s and self.second.begun_s is None and now >= self.first.begun_s + self.lag_s:
            self.second.begin(relay, now)

    def touch(self, relay, line, data, now):
        self.tick(relay, now)
        out = []
        for delay_s, part in self.first.touch(relay, line, data, now):
            if self.second.begun_s is None:
                out.append((delay_s, part))
                continue
            for more_s, changed in self.second.touch(relay, line, part, now):
                overtakes = delay_s < 0 or more_s < 0
                out.append(((-1 if overtakes else 1) * (abs(delay_s) + abs(more_s)), changed))
        return out


# Effects on messages.

def lost(_):
    return []


def later(seconds):
    return lambda data: [(seconds, data)]


def twice(seconds):
    return lambda data: [(0, data), (-seconds, data)] if seconds else [(0, data), (0, data)]


def overtaken(seconds):
    return lambda data: [(-seconds, data)]


def replaced(pattern, by):
    return lambda data: [(0, re.sub(pattern, by, data, count=1))]


def value(element, axes, to):
    """Applies `to` to the text of these attributes."""
    def change(data):
        def inside(tag):
            out = tag[0]
            for axis in axes:
                out = re.sub(rb'(%s=")([^"]*)(")' % axis.encode(), lambda m: m[1] + to(m[2]) + m[3], out)
            return out
        return re.sub(b"<%s [^>]*/>" % element.encode(), inside, data, count=1)
    return change


def added(by, decimals=4):
    return lambda text: b"%.*f" % (decimals, float(text) + by)


def shifted(elements, axes, by):
    def change(data):
        for element in elements:
            data = value(element, axes, added(by))(data)
        return [(0, data)]
    return change


def damaged_and_late(rng, seconds):
    """Every third message late, the next one damaged: the reply before it was not accepted."""
    count, axis = [0], rng.choice(ALL)

    def change(data):
        count[0] += 1
        if count[0] % 3 == 1:
            return [(seconds, data)]
        return [(0, value("AIPos", [axis], lambda _: b"nan")(data) if count[0] % 3 == 2 else data)]
    return change


def ipoc(to):
    return lambda data: [(0, re.sub(rb"(<IPOC>)(\d+)", lambda m: m[1] + b"%d" % to(int(m[2])), data))]


def frozen():
    first = []

    def to(number):
        first or first.append(number)
        return first[0]
    return ipoc(to)


def delay_counter(step, of=1):
    count = [0]

    def change(data):
        count[0] += 1
        return [(0, value("Delay", ["D"], lambda t: b"%d" % max(0, int(t) + step * (count[0] // of)))(data))]
    return change


def of_type(types, change):
    def only(data):
        content = r.decode(data)
        return change(data, content) if content and content[0] in types else None
    return only


def stamped(seconds):
    def change(_, content):
        offset = {r.TRIP: 4, r.CONTACT: 6}[content[0]]
        t = struct.unpack_from("<I", content, offset)[0]
        moved = struct.pack("<I", int(t + seconds * 2e6) & 0xFFFFFFFF)
        return [(0, r.encode(content[:offset] + moved + content[offset + 4:]))]
    return of_type((r.TRIP, r.CONTACT), change)


def flipped(rng):
    def change(data):
        at = rng.randrange(len(data))
        return [(0, data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1:])]
    return change


def shortened(rng):
    return lambda data: [(0, data[:rng.randrange(len(data))])]


def a_byte_less(rng):
    def change(data):
        at = rng.randrange(len(data))
        return [(0, data[:at] + data[at + 1:])]
    return change


def bad_sum(data):
    body = bytearray(data)
    body[-2] ^= 0x11 if body[-2] != 0x11 else 0x22
    return [(0, bytes(body))]


def garbage(rng, size):
    return bytes(rng.randrange(256) for _ in range(size))


# Effects on the cell.

def foreign_sender(rng):
    def act(relay, _, now):
        other = relay.udp()
        packet = next(p.data for p in reversed(relay.passed) if p.line == PACKETS)
        lie = shifted(["AIPos", "ASPos"], ["A1", "A2"], rng.choice([-30, 5, 30]))(packet)[0][1]
        for i in range(200):
            relay.at(now + 0.004 * i + 0.001, lambda: other.sendto(lie, relay.daemon))
        relay.at(now + 1.0, other.close)
    return act


def second_controller(rng):
    """From the same address and port, as through a gateway: a separate session between the packets."""
    base = rng.randrange(10**6, 10**7)

    def act(relay, _, now):
        packet = next(p.data for p in reversed(relay.passed) if p.line == PACKETS)
        for i in range(rng.choice([1, 25, 100])):
            strange = ipoc(lambda _, i=i: base + 4 * i)(shifted(["AIPos", "ASPos"], ["A1"], 20)(packet)[0][1])[0][1]
            relay.at(now + 0.004 * i + 0.001, lambda strange=strange: relay.far.sendto(strange, relay.daemon))
    return act


def flood(rng):
    noise = garbage(rng, 400)

    def act(relay, _, now):
        for i in range(100):
            relay.at(now + 0.005 * i, lambda: relay.send(FROM_SENSOR, noise))
    return act


def flood_of_datagrams(rng):
    noise = garbage(rng, 600)

    def act(relay, _, now):
        for i in range(100):
            relay.at(now + 0.003 * i, lambda: relay.send(PACKETS, noise))
    return act


def pulled(back_after_s):
    def act(relay, _, now):
        relay.unplug()
        if back_after_s:
            relay.at(now + back_after_s, relay.plug)
    return act


def operator(*commands):
    """Commands of the emulator's operator: pairs (after s, command)."""
    def act(relay, _, now):
        def tell(command):
            fd = os.open(f"{relay.folder}/operator", os.O_RDWR | os.O_NONBLOCK)
            os.write(fd, command.encode() + b"\n")
            os.close(fd)
        for after_s, command in commands:
            relay.at(now + after_s, lambda command=command: tell(command))
    return act


def sensor_restarts(_):
    """A different boot_id from now on, announced immediately."""
    def change(data):
        content = r.decode(data)
        if not content:
            return None
        if content[0] == r.IDENT:
            boot = struct.unpack_from("<I", content, 10)[0] + 7
            return [(0, r.encode(content[:10] + struct.pack("<I", boot) + content[14:]))]
        return [(0, data)]

    def act(relay, _, now):
        ident = next((r.decode(p.data) for p in reversed(relay.passed)
                      if p.line == FROM_SENSOR and (r.decode(p.data) or b"\0")[0] == r.IDENT), None)
        if ident:
            # A nonce of 0: unsolicited, announced after a reset.
            new = struct.pack("<I", struct.unpack_from("<I", ident, 10)[0] + 7)
            said = ident[:10] + new + ident[14:19] + bytes(4) + ident[23:]
            relay.at(now, lambda: relay.send(FROM_SENSOR, r.encode(said)))
    return Dose("boot_id + 7", (FROM_SENSOR,), change, 10**9, act=act)


MANY = 10**9
ALL = ["A%d" % i for i in range(1, 7)]


def on(line, change, words="", most=1, lasts_s=1e9):
    lines = line if isinstance(line, tuple) else (line,)
    return lambda rng: Dose(words, lines, change(rng), most, lasts_s)


def drawn(choices, make):
    """Draws the strength from these choices."""
    return lambda rng: make(rng.choice(choices), rng)


def counted(line, change, counts):
    return drawn(counts, lambda n, rng: Dose(f"{n} messages", (line,), change(rng), n))


def timed(line, change, ms, lasts_s=0.3):
    return drawn(ms, lambda n, rng: Dose(f"{n} ms for {lasts_s} s", (line,), change(n / 1e3), MANY, lasts_s))


def spoiled(element, text):
    return lambda rng: value(element, [rng.choice(ALL)], lambda _: text)


def once_or(line, change, counts=(1, 10)):
    """`change` of a generator returns the function for a message's new text."""
    return drawn(counts, lambda n, rng: Dose(f"{n} messages", (line,),
                                             (lambda c: lambda data: [(0, c(data))])(change(rng)), n))


def shifts(elements, axes_of, by, counts=(1, 75, MANY)):
    def dose(rng):
        axes, deg, n = axes_of(rng), rng.choice(by), rng.choice(counts)
        return Dose(f"{deg:+} deg at {','.join(axes)}, {n if n < MANY else 'all'} messages", (PACKETS,),
                    shifted(elements, axes, deg), n)
    return dose


def acts(make, words=""):
    return lambda rng: Dose(words, act=make(rng))


def one_axis(rng):
    return [rng.choice(ALL)]


def at_both(name, dose, ends, instants=("travel", "search")):
    return [Kind(f"{name}, {at}", at, dose, ends) for at in instants]


def kinds():
    remove = lambda pattern: lambda _: lambda data: re.sub(pattern, b"", data)
    k = []
    # Packets of the controller.
    k += at_both("packets lost", counted(PACKETS, lambda _: lost, [1, 3, 20, 75]), LINK)
    k += [Kind("packets lost for good", "travel", on(PACKETS, lambda _: lost, most=MANY),
               {"robot-silent", "computer-busy"})]
    k += at_both("packets duplicated", counted(PACKETS, lambda rng: twice(rng.choice([0, 0.0005, 0.006])), [1, 25, 75]), LINK)
    k += at_both("packets reordered", counted(PACKETS, lambda rng: overtaken(rng.choice([0.005, 0.010, 0.030])), [1, 5]), LINK)
    k += at_both("packets delayed", timed(PACKETS, later, [20, 50, 200]), LINK)
    k += [Kind("packets truncated", "travel", counted(PACKETS, shortened, [1, 3, 75]), LINK),
          Kind("packets flipped", "search", counted(PACKETS, flipped, [1, 10, 75]), LIED_TO),
          Kind("packets of garbage", "travel", once_or(PACKETS, lambda rng: lambda d: garbage(rng, len(d))), LINK),
          Kind("packets oversized", "travel", once_or(PACKETS, lambda _: lambda d: d.replace(b"<IPOC>", b"<X a=\"" + b"9" * 9000 + b"\"/><IPOC>")), LINK),
          Kind("flood of datagrams", "search", acts(flood_of_datagrams), LINK),
          Kind("foreign sender", "travel", acts(foreign_sender), DONE | {"computer-busy"}),
          Kind("second controller", "travel", acts(second_controller), LIED_TO)]
    k += at_both("AIPos missing", once_or(PACKETS, remove(rb"<AIPos [^>]*/>"), (1, 10, 75)), LINK)
    k += [Kind("ASPos missing", "travel", once_or(PACKETS, remove(rb"<ASPos [^>]*/>"), (1, 10, MANY)), LINK),
          Kind("IPOC missing", "travel", once_or(PACKETS, remove(rb"<IPOC>.*</IPOC>"), (1, 10, 75)), LINK),
          Kind("Delay missing", "travel", once_or(PACKETS, remove(rb"<Delay [^>]*/>"), (1, 10, MANY)), LINK)]
    k += at_both("AIPos 'nan'", once_or(PACKETS, spoiled("AIPos", b"nan"), (1, 10, 75)), LINK)
    k += [Kind("AIPos 'nan' and late", "travel", drawn([6, 10], lambda ms, rng: Dose(
        f"{ms} ms, every third", (PACKETS,), damaged_and_late(rng, ms / 1e3), MANY, 0.3)), LINK)]
    k += [Kind("AIPos '9e99'", "travel", once_or(PACKETS, spoiled("AIPos", b"9e99"), (1, 10, 75)), LINK),
          Kind("AIPos empty", "search", once_or(PACKETS, spoiled("AIPos", b""), (1, 10, 75)), LINK),
          Kind("ASPos 'nan'", "travel", once_or(PACKETS, spoiled("ASPos", b"nan"), (1, 10, 75)), LINK)]
    k += at_both("ASPos shifted, one axis", shifts(["ASPos"], one_axis, [-30, -1, 0.03, 5, 90]), LINK)
    k += [Kind("ASPos shifted, all axes", "travel", shifts(["ASPos"], lambda _: ALL, [-5, 0.1, 10]), LINK),
          Kind("ASPos shifted, A6 by 360", "travel", shifts(["ASPos"], lambda _: ["A6"], [-360, 360]), LINK)]
    k += at_both("AIPos shifted", shifts(["AIPos"], one_axis, [-30, -1, 0.2, 5]), LINK)
    k += at_both("AIPos and ASPos shifted alike", shifts(["AIPos", "ASPos"], one_axis, [-30, -1, 0.2, 5]), LINK)
    k += at_both("IPOC back", drawn([4, 8, 400], lambda n, _: Dose(f"-{n} once", (PACKETS,), ipoc(lambda v: v - n))), LINK)
    k += [Kind("IPOC ahead", "travel", drawn([4, 40, 1000], lambda n, _: Dose(f"+{n} once", (PACKETS,), ipoc(lambda v: v + n))), LINK),
          Kind("IPOC jumps for good", "travel", drawn([-10**6, 1000, 10**6], lambda n, _: Dose(f"{n:+} for good", (PACKETS, ), ipoc(lambda v: max(0, v + n)), MANY)), LINK),
          Kind("IPOC frozen", "search", drawn([5, 25, 75], lambda n, _: Dose(f"{n} messages", (PACKETS,), frozen(), n)), LINK)]
    k += at_both("Delay rises", drawn([(1, MANY, 1), (1, 1, 1), (5, 1, 1), (1, MANY, 10)], lambda n, _: Dose(
        f"{n[0]:+} every {n[2]}", (PACKETS,), delay_counter(n[0], n[2]), n[1])), LINK)
    k += [Kind("Delay falls", "travel", drawn([1, 75], lambda n, _: Dose(f"-1 in {n} messages", (PACKETS,), delay_counter(-1), n)), LINK)]
    # Replies to the controller.
    k += at_both("replies lost", counted(REPLIES, lambda _: lost, [1, 3, 20, 75]), LINK)
    k += [Kind("replies lost for good", "travel", on(REPLIES, lambda _: lost, most=MANY),
               {"robot-silent", "computer-busy", "not-following"})]
    k += at_both("replies delayed", timed(REPLIES, later, [5, 20, 50, 200]), LINK)
    k += [Kind("replies duplicated", "travel", counted(REPLIES, lambda rng: twice(rng.choice([0, 0.006])), [1, 75]), LINK),
          Kind("replies truncated", "search", counted(REPLIES, shortened, [1, 3]), LINK)]
    # The controller itself.
    k += at_both("session restarted", drawn([0.02, 0.3], lambda s, _: Dose(f"{s} s later", act=operator(
        (0, "cancel"), (s, "reset")))), {"robot-silent", "not-following", "stopped-elsewhere", "computer-busy"} | DONE)
    k += [Kind("emergency stop", "travel", lambda _: Dose("", act=operator((0, "estop"))), LINK - DONE),
          Kind("cable unplugged", "search", drawn([0.05, 1.0], lambda s, _: Dose(
              f"for {s} s", act=operator((0, "unplug"), (s, "plug")))), LINK),
          Kind("drives blocked", "travel", lambda _: Dose("", act=operator((0, "block on"))), LINK - DONE)]
    # Bytes and frames of the sensor.
    k += at_both("serial bytes lost", counted(FROM_SENSOR, a_byte_less, [1, 5, 30]), SENSOR)
    k += at_both("serial bytes flipped", counted(FROM_SENSOR, flipped, [1, 5, 30]), SENSOR)
    k += [Kind("serial frames lost", "search", counted(FROM_SENSOR, lambda _: lost, [1, 3, 30]), EVENTS),
          Kind("serial frames duplicated", "search", counted(FROM_SENSOR, lambda _: twice(0), [1, 30]), EVENTS)]
    k += at_both("serial delayed", timed(FROM_SENSOR, later, [30, 60, 200]), SENSOR)
    k += [Kind("serial CRC broken", "search", on(FROM_SENSOR, lambda _: bad_sum, most=MANY, lasts_s=0.2), SENSOR),
          Kind("serial flood of garbage", "search", acts(flood), SENSOR),
          Kind("serial noise at rest", "start", on(FROM_SENSOR, flipped, most=10), SENSOR)]
    lose = lambda *types: lambda _: of_type(types, lambda *_: [])
    damage = lambda *types: lambda _: of_type(types, lambda data, _: bad_sum(data))
    k += [Kind("trips lost", "contact", counted(FROM_SENSOR, lose(r.TRIP), [1, 3, MANY]), EVENTS),
          Kind("trips damaged", "contact", counted(FROM_SENSOR, damage(r.TRIP), [1, 3, MANY]), EVENTS),
          Kind("contacts lost", "contact", counted(FROM_SENSOR, lose(r.CONTACT), [1, 3, MANY]), EVENTS),
          Kind("trips and contacts lost", "contact", counted(FROM_SENSOR, lose(r.TRIP, r.CONTACT), [2, MANY]), EVENTS),
          Kind("openings lost", "contact", counted(FROM_SENSOR, lose(r.RELEASE), [1, 3, MANY]), EVENTS)]
    k += at_both("heartbeats missing", drawn([30, 60, 400], lambda ms, _: Dose(
        f"{ms} ms", (FROM_SENSOR,), of_type((r.STATUS,), lambda *_: []), MANY, ms / 1e3)), SENSOR)
    k += [Kind("contact stamped early", "contact", drawn([10, 30, 100, 200], lambda ms, _: Dose(
              f"{ms} ms", (FROM_SENSOR,), stamped(-ms / 1e3), MANY)), EVENTS),
          Kind("contact stamped late", "contact", drawn([10, 30, 100, 200], lambda ms, _: Dose(
              f"{ms} ms", (FROM_SENSOR,), stamped(ms / 1e3), MANY)), EVENTS),
          Kind("one contact stamped early", "contact", drawn([10, 30, 100], lambda ms, _: Dose(
              f"{ms} ms", (FROM_SENSOR,), stamped(-ms / 1e3), 2)), EVENTS),
          Kind("sequence repeated", "search", on(FROM_SENSOR, lambda _: lambda data: (
              lambda c: [(0, r.encode(c[:1] + b"\x07" + c[2:]))] if c else None)(r.decode(data)), most=30), SENSOR)]
    k += at_both("sensor restarts", sensor_restarts, SENSOR)
    k += at_both("serial pulled", drawn([0, 0.05, 1.0], lambda s, _: Dose(
        f"back after {s} s" if s else "for good", act=pulled(s))), SENSOR | {"device"})
    # To the sensor.
    k += [Kind("to sensor: damaged", "search", counted(TO_SENSOR, flipped, [1, 5, 50]), EVENTS),
          Kind("to sensor: lost", "search", on(TO_SENSOR, lambda _: lost, most=MANY, lasts_s=0.3), EVENTS),
          Kind("to sensor: delayed", "search", timed(TO_SENSOR, later, [30, 60, 200]), EVENTS),
          Kind("self-tests lost", "start", on(TO_SENSOR, lose(r.SELFTEST), most=MANY), SENSOR),
          Kind("acknowledgements lost", "contact", on(TO_SENSOR, lose(0x05), most=MANY), EVENTS),
          Kind("clock answers lost", "travel", on(FROM_SENSOR, lose(r.PONG), most=MANY), SENSOR)]
    return k


# Kinds whose undetected faults would be most harmful.
SUBSET = ["ASPos shifted, one axis, travel", "AIPos 'nan', travel", "AIPos 'nan' and late", "replies delayed, search",
          "trips lost", "one contact stamped early", "heartbeats missing, search"]
