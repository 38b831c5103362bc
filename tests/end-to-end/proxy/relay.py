"""Relay between the emulated cell and the daemon, for RSI's datagrams and the contact line's frames. It applies one
fault to them, and records all messages with their times for the judge. Uses no code of cellcal."""

import gc
import heapq
import os
import pty
import re
import selectors
import socket
import struct
import termios
import threading
import time
import tty
from dataclasses import dataclass

PACKETS, REPLIES, FROM_SENSOR, TO_SENSOR = "packets", "replies", "from sensor", "to sensor"
ARM, DISARM, HELLO, KEEPALIVE, PING, SELFTEST = 0x03, 0x04, 0x01, 0x08, 0x06, 0x07
IDENT, STATUS, TRIP, CONTACT, PONG, REVOKED, RELEASE = 0x81, 0x82, 0x83, 0x84, 0x85, 0x88, 0x89
FAST_DEG_S = 8.0  # above every search


def crc16(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = ((crc << 1) ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


def decode(wire):
    """A frame with its delimiter -> type, sequence and payload; None if damaged."""
    out, i, body = bytearray(), 0, wire[:-1]
    while i < len(body):
        code = body[i]
        block = body[i + 1:i + code]
        if code == 0 or len(block) != code - 1:
            return None
        out += block
        i += code
        if code < 255 and i < len(body):
            out.append(0)
    if len(out) < 4 or crc16(out[:-2]) != struct.unpack("<H", out[-2:])[0]:
        return None
    return bytes(out[:-2])


def encode(content):
    """The reverse of decode(), with a valid checksum."""
    out = bytearray()
    for block in (content + struct.pack("<H", crc16(content))).split(b"\0"):
        out += bytes([len(block) + 1]) + block
    return bytes(out) + b"\0"


@dataclass
class Passed:
    """A message on a line: time, content, and the parts sent on."""
    line: str
    came_s: float
    data: bytes
    sent: list  # (when, bytes) sent on


def numbers(text, element):
    """A1 to A6 of an element of RSI's XML; None without them."""
    tag = re.search(f"<{element} ([^>]*)/>".encode(), text)
    if not tag:
        return None
    found = dict(re.findall(rb'A([1-6])="([^"]*)"', tag[1]))
    return [float(found[b"%d" % i]) for i in range(1, 7)] if len(found) == 6 else None


def ipoc_of(text):
    found = re.search(rb"<IPOC>(\d+)</IPOC>", text)
    return int(found[1]) if found else None


class Relay:
    """`fault` gets each message with its line: fault.touch(relay, line, data, now) returns the messages to send, as
    pairs of (delay in s, bytes); unchanged: [(0, data)]."""

    def __init__(self, folder, daemon_port, fault):
        self.folder, self.fault, self.daemon = folder, fault, ("127.0.0.1", daemon_port)
        self.near = self.udp()  # the controller sends here
        self.far = self.udp()   # the daemon answers here
        self.port = self.near.getsockname()[1]
        self.controller = None
        self.passed, self.due, self.number = [], [], 0
        self.not_before = dict.fromkeys((PACKETS, REPLIES, FROM_SENSOR, TO_SENSOR), 0.0)
        self.parts = {FROM_SENSOR: b"", TO_SENSOR: b""}
        self.over, self.worst_s, self.error = threading.Event(), 0.0, None
        # Values that determine a fault's instant.
        self.armings, self.armed, self.command, self.speed_deg_s = 0, False, None, 0.0
        self.master = self.slave = self.sensor = None
        self.selector = selectors.DefaultSelector()

    @staticmethod
    def udp():
        s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        s.bind(("127.0.0.1", 0))
        s.setblocking(False)
        return s

    def start(self):
        """The emulator's terminal must exist."""
        self.sensor = os.open(f"{self.folder}/sensor", os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self.sensor)
        mode = termios.tcgetattr(self.sensor)
        mode[4] = mode[5] = termios.B1000000
        termios.tcsetattr(self.sensor, termios.TCSANOW, mode)
        for source in (self.near, self.far, self.sensor):
            self.selector.register(source, selectors.EVENT_READ)
        self.plug()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def plug(self):
        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)
        os.set_blocking(self.master, False)
        link = f"{self.folder}/contact"
        if os.path.lexists(link):
            os.unlink(link)
        os.symlink(os.ttyname(self.slave), link)
        self.selector.register(self.master, selectors.EVENT_READ)

    def unplug(self):
        os.unlink(f"{self.folder}/contact")
        self.selector.unregister(self.master)
        os.close(self.master)
        os.close(self.slave)
        self.master = self.slave = None

    def stop(self):
        self.over.set()
        self.thread.join()
        for fd in (self.master, self.slave, self.sensor):
            fd is None or os.close(fd)
        self.near.close()
        self.far.close()

    def at(self, when_s, act):
        self.number += 1
        heapq.heappush(self.due, (when_s, self.number, act))

    def run(self):
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(5))
        except OSError:
            pass
        gc.freeze()
        gc.disable()
        try:
            while not self.over.is_set():
                self.turn()
        except Exception as error:  # the session is invalid, and reports it
            self.error = error
        gc.enable()

    def turn(self):
        wait = min(0.05, self.due[0][0] - time.monotonic()) if self.due else 0.05
        ready = self.selector.select(max(0.0, wait))
        while self.due and self.due[0][0] <= time.monotonic():
            when, _, act = heapq.heappop(self.due)
            self.worst_s = max(self.worst_s, time.monotonic() - when)
            act()
        for key, _ in ready:
            self.read(key.fileobj)
        self.fault.tick(self, time.monotonic())

    def read(self, source):
        try:
            if source is self.near:
                while True:
                    data, self.controller = self.near.recvfrom(16384)
                    self.take(PACKETS, data)
            elif source is self.far:
                while True:
                    self.take(REPLIES, self.far.recv(16384))
            else:
                line = FROM_SENSOR if source == self.sensor else TO_SENSOR
                frames = (self.parts[line] + os.read(source, 4096)).split(b"\0")
                self.parts[line] = frames.pop()
                for frame in frames:
                    self.take(line, frame + b"\0")
        except (BlockingIOError, ConnectionRefusedError):
            pass
        except OSError:  # a terminal that was unplugged
            if source is self.near or source is self.far:
                raise

    def take(self, line, data):
        now = time.monotonic()
        self.look(line, data)
        one = Passed(line, now, data, [])
        self.passed.append(one)
        for delay_s, part in self.fault.touch(self, line, data, now):
            self.hand_on(one, delay_s, part, now)

    def hand_on(self, one, delay_s, part, now):
        # Later messages wait for delayed ones, unless a fault reorders them (negative: overtaken).
        when = now + abs(delay_s)
        if delay_s >= 0:
            when = self.not_before[one.line] = max(when, self.not_before[one.line])

        def send():
            one.sent.append((time.monotonic(), part))
            self.send(one.line, part)

        if when <= now:
            send()
        else:
            self.at(when, send)

    def send(self, line, data):
        try:
            if line == PACKETS:
                self.far.sendto(data, self.daemon)
            elif line == REPLIES:
                self.near.sendto(data, self.controller)
            elif line == TO_SENSOR:
                os.write(self.sensor, data)
            elif self.master is not None:
                os.write(self.master, data)
        except (BlockingIOError, ConnectionRefusedError):
            pass

    def look(self, line, data):
        if line == REPLIES:
            command = numbers(data, "AK")
            if command and self.command:
                self.speed_deg_s = max(abs(a - b) for a, b in zip(command, self.command)) / 0.004
            self.command = command or self.command
        elif line in (TO_SENSOR, FROM_SENSOR):
            content = decode(data)
            kind = content[0] if content else None
            if kind == ARM:
                self.armed, self.armings = True, self.armings + 1
            elif kind in (DISARM, TRIP, CONTACT):
                self.armed = False

    @property
    def doing(self):
        if self.armed:
            return "search" if self.speed_deg_s > 0.05 else "rest"
        return "travel" if self.speed_deg_s > FAST_DEG_S else "rest"
