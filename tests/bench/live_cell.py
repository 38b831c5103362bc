"""cellcald and the emulated cell as processes on real wires, for benchmarks: UDP, a pseudo-terminal, the API's socket."""

import http.client
import json
import os
import signal
import socket
import subprocess
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BIN = f"{ROOT}/build/release"
CELLCAL = f"{BIN}/daemon/cli/cellcal"
CELLCALD = f"{BIN}/daemon/main/cellcald"
PLANT = f"{BIN}/daemon/plant/desk/cellcal-plant"
EMULATOR = f"{BIN}/sim/emulator/cellcal-emulator"
CELL = f"{ROOT}/sim/cell/demo/cell.toml"
CONFIG = """
format = "cellcal.daemon/1"
backend = "rsi"
state_dir = "{dir}/state"
socket = "{dir}/cellcald.sock"
[motion]
speed_percent = {speed_percent}
acceleration_deg_s2 = 600
jerk_deg_s3 = 8000
[rsi]
bind = "127.0.0.1"
port = {port}
correction_limit_deg = 360
{stop_path}[contact]
device = "{device}"
"""


class Connection(http.client.HTTPConnection):
    def __init__(self, path):
        super().__init__("localhost", timeout=60)
        self.path = path

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(60)
        self.sock.connect(self.path)


def ask(path, method, target):
    """JSON of the answer."""
    connection = Connection(path)
    try:
        connection.request(method, target)
        return json.loads(connection.getresponse().read())
    finally:
        connection.close()


def status(path):
    return ask(path, "GET", "/v1/status")


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def build(*targets):
    for step in ([f"{ROOT}/tests/install"], ["cmake", "--preset", "release"],
                 ["cmake", "--build", "--preset", "release", "--target", *targets]):
        subprocess.run(step, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)


def machine():
    return f"{os.cpu_count()} cores, {os.uname().sysname} {os.uname().release}, load before {os.getloadavg()[0]:.1f}"


STOP_PATH = """contact_tag = "Contact.R"
[controller]
contact_level = "off"
"""


class LiveCell:
    """Both processes in a folder of their own; the daemon's log is the file 'log'."""

    def __init__(self, folder, speed_percent=80, cellcald=CELLCALD, emulator=EMULATOR, more="",
                 ethernet=False, stop_path=False):
        self.folder, self.port, self.sock = folder, free_port(), f"{folder}/cellcald.sock"
        self.programs, self.stop_path = (cellcald, emulator), stop_path
        self.udp = f"127.0.0.1:{free_port()}" if ethernet else None
        device = f"udp:{self.udp}" if ethernet else f"{folder}/contact"
        with open(f"{folder}/cellcald.toml", "w") as f:
            f.write(CONFIG.format(dir=folder, device=device, port=self.port, speed_percent=speed_percent,
                                  stop_path=STOP_PATH if stop_path else "") + more)

    def start_daemon(self, environment=None):
        with open(f"{self.folder}/log", "w") as log:
            process = subprocess.Popen([self.programs[0], "--config", f"{self.folder}/cellcald.toml"],
                                       stderr=log, stdout=log, env={**os.environ, **(environment or {})})
        while not os.path.exists(self.sock) and process.poll() is None:
            time.sleep(0.05)
        return process

    def start_emulator(self):
        """A controller and a sensor just switched on."""
        device = f"{self.folder}/contact"
        if os.path.lexists(device):
            os.unlink(device)
        process = subprocess.Popen(
            [self.programs[1], "--cell", CELL, "--seed", "12", "--deflection", "0.002", "--pc",
             f"127.0.0.1:{self.port}", "--device-link", device, "--joint-noise-deg", "0.001",
             "--clamp-deg", "360", "--restart-after", "1", *(["--udp", self.udp] if self.udp else []),
             *(["--contact-tag", "Contact.R"] if self.stop_path else [])],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        while not (self.udp or os.path.exists(device)) and process.poll() is None:
            time.sleep(0.02)
        return process

    def client(self, *arguments):
        return subprocess.Popen([CELLCAL, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                                env=dict(os.environ, CELLCAL_SOCKET=self.sock))

    def log(self):
        with open(f"{self.folder}/log") as log:
            return log.read()


class Beside:
    """Processes that run until ended, each in a group of its own, so that a running compiler ends with its loop."""

    def __init__(self):
        self.processes = []

    def start(self, command, count=1, **more):
        for _ in range(count):
            self.processes.append(subprocess.Popen(command, start_new_session=True, stdout=subprocess.DEVNULL,
                                                   stderr=subprocess.DEVNULL, **more))

    def end(self):
        for process in self.processes:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        self.processes = []
