"""The judge detects violations: replies no correct daemon sends, each found by its own rule."""

import os
import struct
import unittest

import judge
import relay as r
from relay import FROM_SENSOR, PACKETS, REPLIES, TO_SENSOR, Passed

LIMITS = judge.Limits([100.0] * 6, 600.0, 8000.0)


def travel(cycles, jerk=7000.0):
    """Angles of an axis that accelerates within its limits, then keeps its speed."""
    at, speed, acceleration, out = 0.0, 0.0, 0.0, [0.0, 0.0]
    for i in range(cycles):
        acceleration = max(0.0, min(580.0, acceleration + (jerk if i < 40 else -jerk) * judge.CYCLE_S))
        speed += acceleration * judge.CYCLE_S
        at += speed * judge.CYCLE_S
        out.append(at)
    return out


class Wire:
    """Messages when a daemon sends these angles of A2: a packet and a reply each."""

    def __init__(self, angles, untaken=(), told=(), start=10.0):
        self.passed, late, lie = [], 0, 0
        for i, angle in enumerate(angles):
            t = judge.CYCLE_S * i
            text = (f'<Rob Type="KUKA"><ASPos A1="0" A2="{start}" A3="0" A4="0" A5="0" A6="0"/>'
                    '<Delay D="%d"/><IPOC>{}</IPOC></Rob>').format(1000 + 4 * i)
            came, handed = (text % late).encode(), (text % (late + lie)).encode()
            self.passed.append(Passed(PACKETS, t, came, [(t, handed)]))
            late, lie = late + (i in untaken), lie + (i in told)
            reply = (f'<Sen Type="ImFree"><AK A1="0.000000" A2="{angle:.6f}" A3="0" A4="0" A5="0" A6="0"/>'
                     f'<IPOC>{1000 + 4 * i}</IPOC></Sen>').encode()
            self.passed.append(Passed(REPLIES, t + 0.0005, reply, [(t + 0.0005, reply)]))

    def frame(self, line, t, *content):
        wire = r.encode(bytes(content))
        self.passed.append(Passed(line, t, wire, [(t, wire)]))

    def motion(self):
        return [what for _, what in judge.judge_motion(judge.replies(self.passed), LIMITS)]

    def stops(self):
        return [what for _, what in judge.judge_stops(self.passed, judge.replies(self.passed))]


def search(stops_after_s, cycles=200):
    """1 deg/s from 0.1 s on, and rest after that."""
    return [min(max(0.0, judge.CYCLE_S * i - 0.1), stops_after_s - 0.1) for i in range(cycles)]


class JudgeTest(unittest.TestCase):
    def test_a_sound_travel_is_right(self):
        self.assertEqual(Wire(travel(100)).motion(), [])

    def test_a_reply_that_leaps_is_found(self):
        angles = travel(100)
        angles[50:] = [a + 0.05 for a in angles[50:]]
        self.assertRegex(Wire(angles).motion()[0], "A2 is asked for [0-9]+ deg/s2")

    def test_a_hard_stop_of_a_travel_is_found(self):
        angles = travel(60)
        self.assertRegex(Wire(angles + angles[-1:] * 20).motion()[0], "deg/s2")

    def test_a_jerk_beyond_its_limit_is_found(self):
        self.assertRegex(Wire(travel(100, jerk=12000.0)).motion()[0], "deg/s3")

    def test_a_speed_beyond_its_limit_is_found(self):
        angles = travel(60)
        self.assertRegex("; ".join(Wire([3 * a for a in angles]).motion()), "deg/s($|;)")

    def test_a_search_may_stop_hard(self):
        angles = [1e-3 * a for a in travel(60)]  # up to 0.06 deg/s
        self.assertEqual(Wire(angles + angles[-1:] * 20).motion(), [])

    def test_what_the_controller_did_not_take_is_said_again(self):
        angles = travel(100)
        held = angles[:51] + angles[50:]  # 50 repeated
        self.assertEqual(Wire(held, untaken=[50]).motion(), [])
        self.assertNotEqual(Wire(held).motion(), [], "all were taken: the arm stands for a cycle")

    def test_a_count_that_lies_to_the_daemon_is_no_fault_of_its(self):
        angles = travel(100)
        self.assertEqual(Wire(angles[:51] + angles[50:], told=[50]).motion(), [])

    def test_an_arm_that_stands_for_want_of_replies_may_begin_from_rest(self):
        angles = travel(60)
        standing = [angles[-1]] * 20
        self.assertEqual(Wire(angles + standing + [angles[-1] + a for a in travel(60)], untaken=range(61, 70)).motion(), [])

    def test_a_correction_that_a_new_session_begins_with_is_found(self):
        first, second = Wire([0.0] * 10), Wire([0.0] * 5 + [3.0] * 5, start=12.0)
        for p in second.passed:
            p.came_s += 1.0
            p.data = p.data.replace(b"<IPOC>1", b"<IPOC>2")
            p.sent = [(when + 1.0, part.replace(b"<IPOC>1", b"<IPOC>2")) for when, part in p.sent]
        first.passed += second.passed
        self.assertNotEqual(first.motion(), [])

    def test_a_search_that_goes_on_behind_its_trip_is_found(self):
        for stops_after_s, found in ((0.4, 0), (0.43, 1)):
            wire = Wire(search(stops_after_s))
            wire.frame(TO_SENSOR, 0.1, r.ARM, 0, 1, 0, 0, 0)
            for i in range(80):
                wire.frame(FROM_SENSOR, 0.1 + 0.01 * i, r.STATUS, i, *bytes(12))
            wire.frame(FROM_SENSOR, 0.395, r.TRIP, 99, *struct.pack("<HI", 1, 1))
            self.assertEqual(bool(wire.stops()), bool(found), wire.stops())

    def test_a_contact_of_an_arming_before_stops_no_search(self):
        wire = Wire(search(0.7))
        wire.frame(TO_SENSOR, 0.1, r.ARM, 0, 2, 0, 0, 0)
        for i in range(80):
            wire.frame(FROM_SENSOR, 0.1 + 0.01 * i, r.STATUS, i, *bytes(12))
        wire.frame(FROM_SENSOR, 0.395, r.CONTACT, 99, *struct.pack("<HHIHBBH", 1, 1, 1, 1, 0, 1, 1))
        self.assertEqual(wire.stops(), [])

    def test_a_search_that_goes_on_beside_a_silent_sensor_is_found(self):
        for stops_after_s, found in ((0.32, 0), (0.5, 1)):
            wire = Wire(search(stops_after_s))
            wire.frame(TO_SENSOR, 0.1, r.ARM, 0, 1, 0, 0, 0)
            for i in range(20):
                wire.frame(FROM_SENSOR, 0.1 + 0.01 * i, r.STATUS, i, *bytes(12))
            self.assertEqual(bool(wire.stops()), bool(found), wire.stops())

    def test_a_command_that_moves_behind_the_end_is_found(self):
        said = judge.replies(Wire(search(0.4)).passed)
        self.assertEqual(judge.judge_end(said, 0.45), [])
        self.assertNotEqual(judge.judge_end(said, 0.35), [])

    def test_a_touch_that_is_astray_is_found(self):
        arm = judge.Arm(os.environ["CELL"])
        right = [-22.049, -71.497, 88.244, 0.022, 47.841, 77.185]
        self.assertEqual(judge.judge_touches(arm, [right], [right, right]), [])
        for axis in range(5):
            wrong = list(right)
            wrong[axis] += 0.1
            self.assertEqual(len(judge.judge_touches(arm, [wrong], [right])), 1, axis)

    def test_the_sum_of_a_frame_is_the_protocols(self):
        self.assertEqual(r.crc16(b"123456789"), 0x29B1)
        for content in (b"\x81\x00\x00abc", b"\x83\x01" + bytes(6)):
            self.assertEqual(r.decode(r.encode(content)), content)
        self.assertIsNone(r.decode(b"\x03\x83\x01\x00"))


if __name__ == "__main__":
    unittest.main()
