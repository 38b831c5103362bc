"""A technician's dry run: controller files from a configuration, a controller that loads them, and
'cellcal doctor' over real wires: passed, and failed with the correct message."""

import json
import os
import re
import socket
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.dirname(__file__))
from wires import CELL, Wires, free_port, wait_for  # noqa: E402

# Longer than any stall of a shared machine, short enough for a test.
OBSERVE, WAIT = "2", "5"


class Doctor(Wires):
    def setUp(self):
        super().setUp()
        self.config = f"{self.dir}/cellcald.toml"
        with open(self.config, "a") as f:
            f.write("[controller]\nrsi_version = 4\n")

    def change(self, old, new):
        with open(self.config) as f:
            text = f.read()
        self.assertIn(old, text)
        with open(self.config, "w") as f:
            f.write(text.replace(old, new))

    def use_eki(self):
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            port = s.getsockname()[1]
        self.change('backend = "rsi"', 'backend = "eki"')
        with open(self.config, "a") as f:
            f.write(f'[eki]\naddress = "127.0.0.1"\nport = {port}\nsilence_ms = 1000\n')

    def make_files(self):
        made = subprocess.run([os.environ["CELLCAL"], "kuka-files", "--config", self.config, "-o",
                               f"{self.dir}/krc"], capture_output=True, text=True, timeout=60)
        self.assertEqual(made.returncode, 0, made.stderr)

    def edit(self, name, old, new):
        with open(f"{self.dir}/krc/{name}", newline="") as f:
            text = f.read()
        self.assertIn(old, text)
        with open(f"{self.dir}/krc/{name}", "w", newline="") as f:
            f.write(text.replace(old, new))

    def start(self, *arguments):
        """The emulated cell alone: configured by its files, not by this test."""
        process = subprocess.Popen(
            [os.environ["EMULATOR"], "--cell", CELL, "--device-link", f"{self.dir}/contact",
             *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.started.append(process)
        wait_for(lambda: os.path.exists(f"{self.dir}/contact") or process.poll() is not None,
                 "emulated cell")
        self.addCleanup(process.stderr.close)
        return process

    def rsi_controller(self, *more, context="cellcal_rsi.rsix"):
        # An operator who restarts RSI, as stated in the technician's checklist.
        return self.start("--rsi-xml", f"{self.dir}/krc/cellcal_rsi_ethernet.xml", "--rsi-context",
                          f"{self.dir}/krc/{context}", "--restart-after", "0.5", *more)

    def eki_controller(self, *more):
        return self.start("--wire", "eki", "--eki-xml", f"{self.dir}/krc/CellcalEki.xml", *more)

    def doctor(self, *more, files=True):
        outcome = subprocess.run(
            [os.environ["CELLCAL"], "doctor", "--config", self.config, "--cell", CELL, "--for",
             OBSERVE, "--wait", WAIT, "--json", *(["--files", f"{self.dir}/krc"] if files else []),
             *more], capture_output=True, text=True, timeout=120)
        self.assertIn(outcome.returncode, (0, 1), outcome.stderr)
        answer = json.loads(outcome.stdout)
        self.assertEqual(answer["green"], outcome.returncode == 0)
        if outcome.returncode == 1:
            self.assertEqual(len(outcome.stderr.splitlines()), 1, outcome.stderr)
        return answer

    def found(self, answer, check):
        found = [one for one in answer["checks"] if one["check"] == check]
        self.assertTrue(found, json.dumps(answer, indent=1))
        return found[0]

    def is_green(self, answer, *checks):
        self.assertTrue(answer["green"], json.dumps(answer, indent=1))
        for check in checks:
            self.assertIn(self.found(answer, check)["outcome"], ("ok", "warning"), check)

    def is_red(self, answer, check, words, advice="."):
        self.assertFalse(answer["green"], json.dumps(answer, indent=1))
        one = self.found(answer, check)
        self.assertEqual(one["outcome"], "failed", json.dumps(answer, indent=1))
        self.assertRegex(one["found"], words)
        self.assertRegex(one["advice"], advice)

    def never_moved(self, emulator, pattern):
        emulator.terminate()
        self.assertRegex(emulator.communicate(timeout=20)[0], pattern)

    CHECKS = ("configuration", "cell file", "controller files", "contact port", "contact sensor",
              "contact configuration", "contact circuit", "contact self-test", "contact clock",
              "contact line", "contact delivery")

    def test_a_technician_gets_to_a_green_doctor_over_rsi(self):
        self.make_files()
        emulator = self.rsi_controller()
        answer = self.doctor()
        self.is_green(answer, *self.CHECKS, "rsi port", "rsi packets", "rsi sender", "rsi cycle",
                      "rsi decimals", "rsi elements", "rsi replies", "rsi reply times",
                      "rsi joint angles", "rsi stop")
        # The demo's robot is a KR 5, which exists in two variants.
        self.assertIn("Z 960.0", self.found(answer, "robot geometry")["found"])
        self.assertIn("0.000, -90.000, 90.000",
                      self.found(answer, "rsi joint angles")["found"])
        self.has_model(answer, "ok", r"^0\.0\d mm from the robot file over 1 posture$")
        self.never_moved(emulator, r"RSI_MOVECORR ended \(STOP\)")

    def has_model(self, answer, outcome, words):
        one = self.found(answer, "controller's model")
        self.assertEqual(one["outcome"], outcome, one)
        self.assertRegex(one["found"], words)

    def test_absolute_accuracy_shows_in_millimetres_over_rsi(self):
        self.make_files()
        self.rsi_controller("--absolute-accuracy")
        self.has_model(self.doctor(), "warning",
                       r"^\d+\.\d\d mm from the robot file at A1 .*absolute accuracy")

    def test_another_robot_type_shows_in_millimetres_over_eki(self):
        self.use_eki()
        self.make_files()
        self.eki_controller("--stated-robot", "kr5_arc")
        self.has_model(self.doctor(), "warning",
                       r"^\d+\.\d\d mm from the robot file at A1 .*another robot type")

    def test_a_technician_gets_to_a_green_doctor_over_rsi_3(self):
        self.change("rsi_version = 4", "rsi_version = 3")
        self.make_files()
        self.rsi_controller(context="cellcal_rsi.rsi.xml")
        self.is_green(self.doctor(), "controller files", "rsi replies", "rsi stop")

    def test_a_technician_gets_to_a_green_doctor_over_rsi_6(self):
        self.change("rsi_version = 4", "rsi_version = 6")
        self.make_files()
        emulator = self.rsi_controller("--rsi-version", "6")
        self.is_green(self.doctor(), "controller files", "rsi replies", "rsi stop")
        self.never_moved(emulator, r"RSI_MOVECORR ended \(STOP\)")

    def test_a_session_measures_over_rsi_6(self):
        self.change("rsi_version = 4", "rsi_version = 6")
        self.make_files()
        self.rsi_controller("--rsi-version", "6")
        self.daemon()
        client = self.begin_session(4, 0)
        client.communicate(timeout=200)
        self.assertEqual(client.returncode, 3, self.log())  # too few touches to publish
        self.assertEqual(self.touches_on_disk(), 4)

    def test_a_context_of_another_release_is_refused(self):
        self.make_files()
        process = self.rsi_controller("--rsi-version", "6")
        self.assertEqual(process.wait(20), 1)
        self.assertIn("a context of RSI 4, the controller has RSI 6", process.stderr.read())
        self.change("rsi_version = 4", "rsi_version = 6")
        self.assertRegex(self.found(self.doctor(), "controller files")["found"],
                         "is a context of RSI 4, .*rsi_version is 6|is a call of RSI 3 to 5")

    def test_a_technician_gets_to_a_green_doctor_over_eki(self):
        self.use_eki()
        self.make_files()
        emulator = self.eki_controller()
        answer = self.doctor()
        self.is_green(answer, *self.CHECKS, "eki connection", "eki states", "eki elements",
                      "eki decimals", "eki readiness", "eki contact input", "eki joint angles")
        self.has_model(answer, "ok", r"^0\.0\d mm from the robot file over 1 posture$")
        self.never_moved(emulator, "emulator: 0 moves")

    def test_a_wrong_sentype_is_named(self):
        self.make_files()
        self.edit("cellcal_rsi_ethernet.xml", "<SENTYPE>ImFree", "<SENTYPE>KROSHU")
        self.rsi_controller()
        self.is_red(self.doctor(files=False), "rsi replies", "not accepted", 'SENTYPE .* "ImFree"')
        self.is_red(self.doctor(), "controller files", r"ethernet.xml:\d+: SENTYPE is \"KROSHU\"")

    def test_a_precision_of_one_decimal_is_named(self):
        self.make_files()
        self.edit("cellcal_rsi.rsix", 'Name="Precision" ParamId="7" ParamValue="5"',
                  'Name="Precision" ParamId="7" ParamValue="1"')
        self.rsi_controller("--joint-noise-deg", "0")
        answer = self.doctor()
        self.is_red(answer, "rsi decimals", "with 1 decimals", "Precision")
        self.is_red(answer, "controller files", r"cellcal_rsi.rsix:\d+: Precision is 1")

    def test_a_port_that_another_program_holds_is_named_with_it(self):
        self.make_files()
        self.rsi_controller()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
            taken.bind(("127.0.0.1", self.port))
            answer = self.doctor()
        self.is_red(answer, "rsi port", str(self.port), rf"stop \S+ \(process {os.getpid()}\)")
        self.assertEqual(self.found(answer, "contact line")["outcome"], "ok")

    def test_a_sensor_that_says_nothing_is_named(self):
        self.make_files()
        self.rsi_controller("--fault", "silent")
        answer = self.doctor()
        self.is_red(answer, "contact sensor", "nothing received from the contact sensor", "baud rate")
        # A busy machine may be late once: a warning.
        self.assertNotEqual(self.found(answer, "rsi replies")["outcome"], "failed")

    def test_a_baud_rate_that_does_not_fit_is_named_with_the_one_that_does(self):
        self.make_files()
        self.rsi_controller("--baud", "115200")
        answer = self.doctor()
        self.is_red(answer, "contact sensor",
                    "115200 baud at the sensor, 1000000 baud in the configuration",
                    r"set baud = 115200 under \[contact\]")
        self.assertEqual(self.found(answer, "contact circuit")["outcome"], "skipped")

    def test_a_missing_sensor_is_named(self):
        self.make_files()
        answer = self.doctor()
        self.is_red(answer, "contact port", "no such device")

    def test_a_broken_wire_is_named(self):
        self.make_files()
        self.rsi_controller("--fault", "wire-broken")
        self.is_red(self.doctor(), "contact circuit", "Check feed and sense wire \\(F, S\\)")

    def test_a_controller_that_sends_nothing_gets_a_checklist(self):
        self.make_files()
        self.edit("cellcal_rsi_ethernet.xml", f"<PORT>{self.port}", f"<PORT>{free_port()}")
        self.rsi_controller()
        answer = self.doctor(files=False)
        self.is_red(answer, "rsi packets", f"none in 5 s on UDP 127.0.0.1:{self.port}",
                    "(?s)CELLCAL_RSI.*RSI_ON.*IP_NUMBER.*192.168.0.x.*firewall.*TestServer")
        self.assertEqual(self.found(answer, "contact sensor")["outcome"], "ok")

    def test_a_controller_that_does_not_listen_for_eki_gets_a_checklist(self):
        self.use_eki()
        self.make_files()
        self.start()
        self.is_red(self.doctor(), "eki connection", "no connection to the controller",
                    "CELLCAL_SUB")

    def test_the_emulated_controller_refuses_a_context_as_a_real_one_does(self):
        self.make_files()
        self.edit("cellcal_rsi.rsix", 'OutObjId="Ethernet_1" OutIdx="5"',
                  'OutObjId="Ethernet_1" OutIdx="17"')
        process = self.rsi_controller()
        self.assertEqual(process.wait(20), 1)
        self.assertIn("RSI_CREATE: Invalid index - signal output", process.stderr.read())
        self.assertRegex(self.found(self.doctor(), "controller files")["found"],
                         r"cellcal_rsi.rsix:\d+: AxisCorr_1: input 6 comes from Ethernet_1 output 18")

    def test_a_session_that_runs_keeps_its_ports_and_its_figures_are_shown(self):
        self.make_files()
        self.rsi_controller()
        self.daemon()
        client = self.begin_session(4, 0)
        # Does not wait for a session ended by a stalled machine.
        wait_for(lambda: self.status()["touches"] >= 1 or client.poll() is not None, "one touch")
        self.assertIsNone(client.poll(), self.log())
        answer = self.doctor()
        self.assertRegex(self.found(answer, "daemon")["found"], "session 1 is running")
        # On a machine that stalls occasionally, the doctor reports that instead; the speed of this
        # machine is not tested.
        self.assertRegex(self.found(answer, "robot link")["found"],
                         r"cycle 4\.00 ms|^\d+ of the replies late")
        self.assertRegex(self.found(answer, "contact link")["found"],
                         r"firmware 1\.1\.0|^the last arming ended: this computer was busy")
        self.assertFalse([one for one in answer["checks"] if one["check"] == "rsi port"])
        links = self.status()["links"]
        self.assertTrue(links["open"])
        self.assertGreater(links["robot"]["replies"], 100)
        self.assertGreater(links["contact"]["frames"], 100)
        self.assertRegex(self.client("status").stdout, "(?s)robot link: cycle 4.*contact link: ")
        # The session was not disturbed.
        client.communicate(timeout=200)
        self.assertEqual(client.returncode, 3)
        self.assertEqual(self.touches_on_disk(), 4)


if __name__ == "__main__":
    # The tests of Wires are run separately.
    unittest.main(argv=sys.argv if len(sys.argv) > 1 else [sys.argv[0], "Doctor"])
