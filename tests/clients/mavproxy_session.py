"""A session with stock MAVProxy: parameters, long commands, a mission loaded and listed, modes."""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import threading
import time

from checks import Checks, wait_until

MISSION = """QGC WPL 110
0\t1\t3\t16\t0\t0\t0\t0\t35.10\t-117.90\t5100\t1
1\t0\t3\t16\t0\t0\t0\t0\t35.30\t-117.80\t5300\t1
2\t0\t3\t17\t0\t0\t9000\t0\t35.50\t-117.80\t5300\t1
"""


# As ArduPilot's ground stations write it: home as item 0, and a jump that counts it.
WITH_HOME = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t35.00\t-118.00\t0\t1
1\t0\t3\t16\t0\t0\t0\t0\t35.10\t-117.90\t5100\t1
2\t0\t3\t16\t0\t0\t0\t0\t35.30\t-117.80\t5300\t1
3\t0\t3\t177\t1\t2\t0\t0\t0\t0\t0\t1
"""


class Session:
    """MAVProxy with its prompt on pipes."""

    def __init__(self, master, folder):
        program = os.path.join(os.path.dirname(sys.executable), "mavproxy.py")
        self.process = subprocess.Popen(
            [sys.executable, program, f"--master={master}", "--no-state", "--source-system=255"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, cwd=folder,
        )
        self.output = ""
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        while data := os.read(self.process.stdout.fileno(), 4096):
            self.output += data.decode(errors="replace").replace("\r", "\n")

    def send_line(self, line):
        self.process.stdin.write(f"{line}\n".encode())
        self.process.stdin.flush()

    def wait_for(self, pattern, timeout_s=5.0, since=0):
        return wait_until(lambda: re.search(pattern, self.output[since:]), timeout_s)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--connect", default="udpin:127.0.0.1:14550")
    args = parser.parse_args()
    c = Checks("MAVProxy")
    with tempfile.TemporaryDirectory() as folder:
        s = Session(args.connect, folder)
        c.expect("connects", s.wait_for(r"Detected vehicle 1:1", 20.0))
        began = time.monotonic()
        got = s.wait_for(r"Received (\d+) parameters", 60.0)
        c.expect("all parameters", got, f"after {time.monotonic() - began:.2f} s")
        for line, answer in [
            ("long INJECT_FAILURE 102 2 5", r"Got COMMAND_ACK: INJECT_FAILURE: ACCEPTED"),
            ("long INJECT_FAILURE 102 0 5", r"Got COMMAND_ACK: INJECT_FAILURE: ACCEPTED"),
            ("long INJECT_FAILURE 4 1 0", r"Got COMMAND_ACK: INJECT_FAILURE: ACCEPTED"),
            ("long INJECT_FAILURE 4 0 0", r"Got COMMAND_ACK: INJECT_FAILURE: ACCEPTED"),
            ("long INJECT_FAILURE 5 1 0", r"Got COMMAND_ACK: INJECT_FAILURE: UNSUPPORTED"),
            ("long DO_SET_MODE 1 3 0", r"Got COMMAND_ACK: DO_SET_MODE: ACCEPTED"),
            # A text in two messages, joined without blanks between them.
            ("param set FW_AIRSPD_MAX 99999", r"FW_AIRSPD_MAX = 99999 is outside 5 to 500 m/s"),
            ("long DO_SET_MODE 1 4 3", r"Got COMMAND_ACK: DO_SET_MODE: ACCEPTED"),
            ("long DO_CHANGE_SPEED 0 262 0", r"Got COMMAND_ACK: DO_CHANGE_SPEED: ACCEPTED"),
            ("setspeed 212", r"Got COMMAND_ACK: DO_CHANGE_SPEED: ACCEPTED"),
            ("param show OBS_W0", r"OBS_W0\s+50"),
            ("param set OBS_W0 41", None),
            ("param show OBS_W0", r"OBS_W0\s+41"),
            ("param show FTC_MODE", r"FTC_MODE\s+1"),
        ]:
            mark = len(s.output)
            s.send_line(line)
            if answer is None:
                # Its answer is the value of the next line.
                time.sleep(1.0)
                continue
            c.expect(line, s.wait_for(answer, 5.0, mark), s.output[mark:].strip()[-100:].replace("\n", " "))
            time.sleep(0.3)
        c.expect("the mode is reported", s.wait_for(r"Mode LOITER"))
        path = os.path.join(folder, "mission.txt")
        with open(path, "w", encoding="ascii") as file:
            file.write(MISSION)
        mark = len(s.output)
        s.send_line(f"wp load {path}")
        c.expect("a mission is loaded", s.wait_for(r"Sent waypoint 2|sent all 3 waypoints|MISSION_ACCEPTED|Flight plan received|Got MISSION_ACK: TYPE_MISSION: ACCEPTED", 10.0, mark), s.output[mark:][-200:])
        mark = len(s.output)
        s.send_line("wp list")
        c.expect("and listed", s.wait_for(r"2 \d+.*35\.5|Saved 3 waypoints|17 .*35\.5", 10.0, mark), s.output[mark:][-300:])
        path = os.path.join(folder, "home.txt")
        with open(path, "w", encoding="ascii") as file:
            file.write(WITH_HOME)
        mark = len(s.output)
        s.send_line(f"wp load {path}")
        c.expect("home as item 0 is taken", s.wait_for(r"item 0: taken as home", 10.0, mark), s.output[mark:][-300:])
        mark = len(s.output)
        s.send_line("wp list")
        c.expect("and given back, with its jump", s.wait_for(r"16 0 35\.0[^\n]*\n(.*\n){2}177 3 .*p1=1", 10.0, mark), s.output[mark:][-400:])
        mark = len(s.output)
        s.send_line("long DO_SET_MODE 1 4 4")
        c.expect("and flown", s.wait_for(r"Mode MISSION", 5.0, mark))
        mark = len(s.output)
        s.send_line("guided 35.2 -117.9 5000")
        c.expect("guided", s.wait_for(r"DO_REPOSITION: ACCEPTED", 5.0, mark), s.output[mark:][-200:])
        mark = len(s.output)
        s.send_line("changealt 5200")
        c.expect("changealt", s.wait_for(r"DO_CHANGE_ALTITUDE: ACCEPTED", 5.0, mark), s.output[mark:][-200:])
        time.sleep(2.0)
        s.send_line("exit")
        for words in ["fence breach", "Traceback", "no link", "link 1 down", "UNKNOWN_", "unknown message",
                      "ERROR", "timed out", "Unable"]:
            c.expect(f"never says {words!r}", words not in s.output)
        try:
            s.process.wait(5.0)
        except subprocess.TimeoutExpired:
            s.process.kill()
        if c.failed:
            print(s.output)
    c.end()


if __name__ == "__main__":
    main()
