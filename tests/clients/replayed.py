"""A flight with stock pymavlink attached, whose commands come at random moments of the wall clock, is recorded and
replayed: the same run hash."""

import argparse
import glob
import os
import random
import re
import subprocess
import time

from checks import Checks, wait_until
from station import ACCEPTED, DENIED, NAN, TEMPORARILY_REJECTED, Station

INJECT, USER_1, USER_2, REBOOT = 420, 31010, 31011, 246
CHANGE_ALTITUDE, CHANGE_SPEED, SET_MODE = 186, 178, 176
WALL_S = 15.0
ANSWERS = (ACCEPTED, TEMPORARILY_REJECTED, DENIED)


def anything(draw):
    """One command that an operator might send."""
    servo = draw.randint(1, 7)
    return draw.choice([
        lambda: (USER_1, [102, 2, servo, 1, draw.uniform(-3, 3), NAN, NAN]),
        lambda: (USER_1, [102, 4, servo, 2, draw.uniform(20, 90), draw.uniform(0, 2), NAN]),
        lambda: (INJECT, [102, draw.choice([3, 5, 6, 7]), servo, NAN, NAN, NAN, NAN]),
        lambda: (INJECT, [102, 0, 0, NAN, NAN, NAN, NAN]),
        lambda: (INJECT, [102, 0, servo, NAN, NAN, NAN, NAN]),
        lambda: (CHANGE_ALTITUDE, [draw.uniform(4_800, 5_300), 0]),
        lambda: (CHANGE_SPEED, [0, draw.uniform(204, 216), -1]),
        lambda: (SET_MODE, [1, 4, draw.choice([3, 11])]),
        lambda: (USER_2, [0]),
        lambda: (USER_2, [2, draw.randint(1, 200)]),
        lambda: (USER_2, [1]),
    ])()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--connect", default="udpin:127.0.0.1:14550")
    parser.add_argument("--log-dir", required=True)
    parser.add_argument("--sitl", required=True)
    args = parser.parse_args()
    seed = time.time_ns()
    draw = random.Random(seed)
    c = Checks(f"a flight with random commands, flown again (seed {seed})")
    s = Station(args.connect)
    if not c.expect("connects", s.connect()):
        c.end()
    log = glob.glob(os.path.join(args.log_dir, "*.ulg"))
    c.expect("one log", len(log) == 1, len(log))
    end = time.monotonic() + WALL_S
    sent, answered = 0, 0
    while time.monotonic() < end:
        s.run(draw.uniform(0.0, 0.3))
        if draw.random() < 0.2:
            s.set_parameter("OBS_W0", draw.uniform(40, 55))
            continue
        command, params = anything(draw)
        sent += 1
        answered += s.command(command, params) in ANSWERS
    s.command(USER_2, [1])
    s.run(0.5)
    c.expect("each command has one answer", answered == sent, f"{answered} of {sent}")
    c.expect("many commands", sent > 20, sent)
    c.expect("the next flight ends the log", s.command(REBOOT, [1, 0, 0, 0, 0, 0, 0]) == ACCEPTED)
    wait_until(lambda: len(glob.glob(os.path.join(args.log_dir, "*.ulg"))) == 2, 5.0)
    time.sleep(1.0)
    replay = subprocess.run([args.sitl, "replay", log[0]], capture_output=True, text=True, timeout=120)
    printed = replay.stdout + replay.stderr
    c.expect("flown again to the same hash", replay.returncode == 0 and re.search("same run hash", printed), printed[-300:])
    c.end()


if __name__ == "__main__":
    main()
