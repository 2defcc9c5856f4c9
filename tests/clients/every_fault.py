"""Every kind of fault on every effector, commanded with stock pymavlink and checked in the plant's truth.

The truth is read from the flight log with pyulog: the named effector does what its kind means, and no other
effector has a fault. One flight for each effector, so that one broken flight does not spoil the next.
"""

import argparse
import glob
import json
import math
import os
import time

import numpy as np
from pyulog import ULog

from checks import Checks, wait_until
from station import ACCEPTED, DENIED, NAN, Station

SERVO, MOTOR = 102, 101
OK, OFF, STUCK, GARBAGE, WRONG, SLOW, DELAYED, INTERMITTENT, DRIFT = range(9)
USER_1, REBOOT = 31010, 246
ANGLE, LEFT, BIAS, RATE, DELAY, AMPLITUDE, PRESENT, DRIFT_RATE, LIMIT, SIDE = range(1, 11)

EFFECTORS = ["left_aileron", "right_aileron", "left_elevator", "right_elevator", "rudder", "nozzle_pitch",
             "nozzle_yaw", "engine"]
ACTS_S, RESTS_S = 0.8, 0.6
PERIOD_S = 0.2

# name, FAILURE_TYPE, kind of value, value for surfaces (deg), value for the engine (percent), code in the log
KINDS = [
    ("stuck", STUCK, None, 0, 0, 1),
    ("stuck at", STUCK, ANGLE, 3.0, None, 2),
    ("loss", WRONG, LEFT, 40.0, 40.0, 6),
    ("off", OFF, None, 0, 0, {"surface": 7, "engine": 15}),
    ("slow", SLOW, RATE, 2.0, 1.0, 8),
    ("delayed", DELAYED, DELAY, 0.2, 0.2, 9),
    ("intermittent", INTERMITTENT, PRESENT, 50.0, 50.0, 10),
    ("oscillating", GARBAGE, AMPLITUDE, 2.0, 5.0, 11),
    ("drifting", DRIFT, DRIFT_RATE, 2.0, -5.0, 12),
    ("biased", WRONG, BIAS, 2.0, -10.0, 13),
    ("limited", WRONG, LIMIT, 0.5, 20.0, 14),
    ("hard over +", WRONG, SIDE, 1.0, None, 4),
    ("hard over -", WRONG, SIDE, -1.0, None, 5),
]


class Truth:
    """The rows of one flight's log that a claim looks at."""

    def __init__(self, path, effector):
        log = ULog(path)
        self.truth = log.get_dataset("truth").data
        commands = log.get_dataset("commands").data
        unit = "n" if effector == "engine" else "rad"
        self.t = self.truth["timestamp"] / 1e6
        self.position = self.truth[f"position_{effector}_{unit}"]
        self.effect = self.truth[f"effect_{effector}_{unit}"]
        self.command = np.interp(self.t, commands["timestamp"] / 1e6, commands[f"{effector}_{unit}"])
        self.code = self.truth[f"fault_{effector}"]
        plant = json.loads(log.msg_info_dict["plant_header"])
        self.servo = plant["setup"]["airframe"]["servos"][EFFECTORS.index(effector)]
        self.others = [self.truth[f"fault_{other}"] for other in EFFECTORS if other != effector]

    def healthy(self, rows, command=None):
        """Position of a healthy effector in these rows, from its position before them."""
        command = self.command if command is None else command
        lag, fastest = self.servo["lag_s"], self.servo["rate_limit"] or math.inf
        position = self.position[rows.start - 1]
        positions = []
        for row in range(rows.start, rows.stop):
            left = self.t[row] - self.t[row - 1]
            while left > 1e-9:
                step = min(left, 1e-3)
                rate = max(-fastest, min(fastest, (command[row - 1] - position) / lag))
                position += rate * step
                left -= step
            positions.append(position)
        return np.array(positions)

    def while_acting(self, code):
        """Rows in which this fault is active: the one stretch of its code, or None."""
        rows = np.flatnonzero(self.code == code)
        if len(rows) == 0 or rows[-1] - rows[0] + 1 != len(rows):
            return None
        return slice(rows[0], rows[-1] + 1)


def does(name, truth, rows, size, thrust_max):
    """Whether an effector behaves as the kind of its fault requires, and the observed behaviour."""
    engine = thrust_max is not None
    scale = thrust_max / 100.0 if engine else math.pi / 180.0
    t, p, e, u = truth.t[rows], truth.position[rows], truth.effect[rows], truth.command[rows]
    step = np.diff(p) / np.diff(t)
    size_si = size * scale
    if name == "stuck":
        before = truth.position[rows.start - 1]
        return bool(np.all(p == p[0])) and abs(p[0] - before) < 0.5 * scale and p[0] != 0.0, (before, p[0])
    if name == "stuck at":
        return bool(np.all(p == p[0])) and abs(p[0] - size_si) < 1e-9, p[0] / scale
    if name == "loss":
        return bool(np.allclose(e, 0.01 * size * p, rtol=1e-9, atol=0)), (e[-1], p[-1])
    if name == "off" and engine:
        return bool(np.all(step <= 0)) and e[-1] < 0.7 * e[0], (e[0], e[-1])
    if name == "off":
        return bool(np.all(e == 0.0)), e[-1]
    if name == "slow":
        fastest = np.max(np.abs(step))
        return 0.0 < fastest <= size_si * (1 + 1e-6), fastest / scale
    if name == "delayed":
        # No command acts twice: until the first command of the delay is due the one before it applies. The fault
        # came with the answer to the tick before its first row.
        onset, ticks = rows.start - 1, round(size / (truth.t[1] - truth.t[0]))
        held = truth.command.copy()
        held[onset:onset + ticks] = truth.command[onset - 1]
        held[onset + ticks:] = truth.command[onset:-ticks]
        off = np.abs(p - truth.healthy(rows, held)).max()
        undelayed = np.abs(p - truth.healthy(rows)).max()
        return off < 0.03 * undelayed, (off / scale, undelayed / scale)
    if name == "intermittent":
        still = float(np.mean(step == 0.0))
        return 0.35 < still < 0.65, still
    if name == "oscillating":
        swing = (p.max() - p.min()) / 2
        return swing > 0.8 * abs(size_si), swing / scale
    if name == "drifting":
        off = p[-1] - truth.healthy(rows)[-1]
        return abs(off - size_si * (t[-1] - t[0])) < 0.05 * abs(size_si), off / scale
    if name == "biased":
        off = float(np.mean(p - truth.healthy(rows)))
        return abs(off - size_si) < 0.05 * abs(size_si), off / scale
    if name == "limited":
        beyond = np.max(np.abs(p)) - abs(size_si)
        return beyond <= 1e-9, beyond / scale
    side = 1.0 if name == "hard over +" else -1.0
    return bool(np.all(side * step >= 0.0)) and side * (p[-1] - p[0]) > 5.0 * scale, (p[0] / scale, p[-1] / scale)


def inject(s, unit, instance, kind, value_kind, value):
    values = [NAN, NAN] if value_kind is None else [value_kind, value]
    return s.command(USER_1, [unit, kind, instance, *values, NAN, NAN])


def now(s):
    return s.latest["ATTITUDE"].time_boot_ms / 1e3


def wait_s(s, seconds):
    end = now(s) + seconds
    return s.wait(lambda: now(s) >= end, 20.0)


def fly(c, s, effector):
    """Injects every fault into one effector, one after the other, in a separate flight."""
    c.expect(f"{effector}: a new flight", s.command(REBOOT, [1, 0, 0, 0, 0, 0, 0]) == ACCEPTED)
    s.wait(lambda: now(s) < 5.0, 10.0)
    wait_s(s, 1.0)
    engine = effector == "engine"
    unit, instance = (MOTOR, 1) if engine else (SERVO, EFFECTORS.index(effector) + 1)
    done = []
    for name, kind, value_kind, value, percent, code in KINDS:
        size = percent if engine else value
        code = code["engine" if engine else "surface"] if isinstance(code, dict) else code
        if size is None:
            value = 10.0 if name == "stuck at" else value
            c.expect(f"{effector} {name}: denied", inject(s, unit, instance, kind, value_kind, value) == DENIED)
            continue
        result = inject(s, unit, instance, kind, value_kind, size)
        if not c.expect(f"{effector} {name}: accepted", result == ACCEPTED, result):
            continue
        done.append((name, code, size))
        wait_s(s, ACTS_S)
        if s.command(USER_1, [unit, OK, instance, NAN, NAN, NAN, NAN]) != ACCEPTED:
            c.expect(f"{effector} {name}: cleared", False)
        wait_s(s, RESTS_S)
    return done


def judge(c, path, effector, done):
    truth = Truth(path, effector)
    c.expect(f"{effector}: no other effector has a fault", not any(np.any(other) for other in truth.others))
    thrust_max = None
    if effector == "engine":
        thrust_max = truth.servo["max"]
    for name, code, size in done:
        rows = truth.while_acting(code)
        if not c.expect(f"{effector} {name}: acts once", rows is not None):
            continue
        holds, seen = does(name, truth, rows, size, thrust_max)
        c.expect(f"{effector} {name}: does what it says", holds, seen)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--connect", default="udpin:127.0.0.1:14550")
    parser.add_argument("--log-dir", required=True)
    args = parser.parse_args()
    c = Checks("every fault on every effector")
    s = Station(args.connect)
    if not c.expect("connects", s.connect()):
        c.end()
    # Always on, so that the nozzle moves also without a fault.
    c.expect("the compensator is always on", s.set_parameter("FTC_MODE", 2, integer=True) == 2)
    c.expect("the period of the intermittent fault", s.set_parameter("FLT_PERIOD_S", PERIOD_S) is not None)
    logs = lambda: sorted(glob.glob(os.path.join(args.log_dir, "*.ulg")), key=os.path.getmtime)
    flown = []
    for effector in EFFECTORS:
        before = set(logs())
        done = fly(c, s, effector)
        new = [path for path in logs() if path not in before]
        if c.expect(f"{effector}: one log", len(new) == 1, len(new)):
            flown.append((effector, new[0], done))
    # One more flight closes the last log.
    s.command(REBOOT, [1, 0, 0, 0, 0, 0, 0])
    wait_until(lambda: len(logs()) > len(EFFECTORS) + 1, 5.0)
    time.sleep(1.0)
    for effector, path, done in flown:
        judge(c, path, effector, done)
    c.end()


if __name__ == "__main__":
    main()
