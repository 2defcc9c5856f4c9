"""Connection, waiting and judging, shared by the flight scripts.

Only stock pymavlink: what works here works from any ground station. All times called `t` are simulation
time in seconds (time_boot_ms), so the scripts do the same at any speed of the simulation.
"""

import argparse
import math
import os
import struct
import sys
import time
import traceback

os.environ["MAVLINK20"] = "1"

try:
    from pymavlink import mavutil  # noqa: E402  (MAVLINK20 must be set before)
except ImportError:
    print(f"this needs pymavlink: {sys.executable} -m pip install pymavlink", file=sys.stderr)
    sys.exit(2)

SURVIVED, LOST, FAILED = 0, 1, 2

# MAV_CMD
DO_SET_MODE = 176
DO_CHANGE_ALTITUDE = 186
REBOOT = 246
USER_1 = 31010
SET_MESSAGE_INTERVAL = 511

# FAILURE_UNIT, FAILURE_TYPE, servo instances, kind of value (USER_1 p4)
SERVO = 102
STUCK = 2
LEFT_ELEVATOR = 3
RUDDER = 5
ANGLE_DEG = 1

RESULTS = {
    0: "ACCEPTED",
    1: "TEMPORARILY_REJECTED",
    2: "DENIED",
    3: "UNSUPPORTED",
    4: "FAILED",
    5: "IN_PROGRESS",
    6: "CANCELLED",
    7: "COMMAND_LONG_ONLY",
}

# The one definition of a lost aircraft, at any time of the flight.
LIMITS_DEG = {"roll": 90.0, "alpha": 25.0, "beta": 20.0, "pitch": 74.5}
ALTITUDE_MIN_M = 500.0

HOLD = (4, 3)
OFFBOARD = (6, 0)

RETRY_S = 0.5
TRIES = 6


class Failed(Exception):
    """Something that the script cannot go on with."""


def arguments(description, watch_s):
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument(
        "--connect",
        default="udpin:127.0.0.1:14550",
        help="pymavlink connection [default: %(default)s]",
    )
    parser.add_argument(
        "--timeout",
        type=float,
        default=20.0,
        metavar="S",
        help="wall seconds to wait for a connection or for time to move [default: %(default)s]",
    )
    parser.add_argument(
        "--watch",
        type=float,
        default=watch_s,
        metavar="S",
        help="simulation seconds to watch after the fault [default: %(default)s]",
    )
    parser.add_argument("--restart", action="store_true", help="start the flight anew first")
    return parser.parse_args()


class Flight:
    """One aircraft, seen through MAVLink."""

    def __init__(self, connect, timeout_s):
        self.timeout_s = timeout_s
        try:
            self.link = mavutil.mavlink_connection(
                connect, source_system=255, source_component=190, dialect="common"
            )
        except OSError as error:
            raise Failed(f"cannot open {connect}: {error}") from error
        self.system = None  # that of the first autopilot heard
        self.t = None
        self.altitude_m = math.nan
        self.airspeed_m_s = math.nan
        self.climb_m_s = math.nan
        self.deg = {"roll": math.nan, "pitch": math.nan, "alpha": math.nan, "beta": math.nan}
        self.rates_deg_s = (math.nan, math.nan, math.nan)
        self.values = {}
        self.mode = None
        self.on_ground = False
        self.lost = None
        self.judging = False
        self.texts = []
        self.sent = {}
        self.acks = {}
        self.results = []
        self.roll_setpoint_deg = None
        self._text_parts = {}
        self._next_heartbeat = 0.0
        self._next_setpoint = 0.0
        self._wall_at_t = None
        self._first = None

    def connect(self):
        print("waiting for the aircraft ...")
        give_up = time.monotonic() + self.timeout_s
        while self.t is None or self.mode is None or math.isnan(self.altitude_m):
            if time.monotonic() > give_up:
                raise Failed(
                    f"no aircraft within {self.timeout_s:g} s: is `sitl` running, "
                    "and does no other program use the port?"
                )
            self.pump()
        self.link.target_system, self.link.target_component = self.system, 1
        # The air angles come as NAMED_VALUE_FLOAT, on request.
        self.link.mav.command_long_send(
            self.system, 1, SET_MESSAGE_INTERVAL, 0, 251, 100_000, 0, 0, 0, 0, 0
        )

    def pump(self, wait_s=0.02):
        """Takes what has come and sends what is due."""
        now = time.monotonic()
        if now >= self._next_heartbeat:
            self.link.mav.heartbeat_send(6, 8, 0, 0, 0)
            self._next_heartbeat = now + 1.0
        if self.roll_setpoint_deg is not None and now >= self._next_setpoint:
            self._send_setpoint()
            self._next_setpoint = now + 0.05
        message = self.link.recv_match(blocking=True, timeout=wait_s)
        while message is not None:
            self._take(message)
            message = self.link.recv_match(blocking=False)

    def _send_setpoint(self):
        half = math.radians(self.roll_setpoint_deg) / 2.0
        quaternion = [math.cos(half), math.sin(half), 0.0, 0.0]
        # 7: body rates are not given.
        self.link.mav.set_attitude_target_send(0, self.system, 1, 7, quaternion, 0.0, 0.0, 0.0, 0.0)

    def _take(self, message):
        kind = message.get_type()
        if self.system is None and kind == "HEARTBEAT" and message.get_srcComponent() == 1:
            self.system = message.get_srcSystem()
        if message.get_srcSystem() != self.system:
            return
        if kind == "HEARTBEAT":
            self.mode = (message.custom_mode >> 16 & 0xFF, message.custom_mode >> 24 & 0xFF)
        elif kind == "ATTITUDE":
            self._time(message.time_boot_ms / 1000.0)
            self.deg["roll"] = math.degrees(message.roll)
            self.deg["pitch"] = math.degrees(message.pitch)
            rates = (message.rollspeed, message.pitchspeed, message.yawspeed)
            self.rates_deg_s = tuple(math.degrees(rate) for rate in rates)
        elif kind == "VFR_HUD":
            self.altitude_m = message.alt
            self.airspeed_m_s = message.airspeed
            self.climb_m_s = message.climb
        elif kind == "EXTENDED_SYS_STATE":
            self.on_ground = message.landed_state == 1
        elif kind == "NAMED_VALUE_FLOAT":
            self.values[message.name] = message.value
            if message.name in ("alpha", "beta"):
                self.deg[message.name] = math.degrees(message.value)
        elif kind == "COMMAND_ACK":
            self.acks.setdefault(message.command, []).append(message.result)
        elif kind == "STATUSTEXT":
            self._text(message)
        self._judge()

    def _text(self, message):
        text = self._text_parts.pop(message.id, "") + message.text
        if message.id != 0 and len(message.text) == 50:
            self._text_parts[message.id] = text
            return
        text = text.rstrip()
        self.texts.append(text)
        self.say(f"autopilot says: {text}")

    def _time(self, t):
        self.t = t
        wall = time.monotonic()
        if self._first is None or t < self._first[1]:
            self._first = (wall, t)
        if self._wall_at_t is None or self._wall_at_t[1] != t:
            self._wall_at_t = (wall, t)
        elif wall - self._wall_at_t[0] > self.timeout_s:
            raise Failed(f"simulation time stands still at {t:.1f} s")

    def _judge(self):
        if not self.judging or self.lost is not None:
            return
        for name, limit in LIMITS_DEG.items():
            if abs(self.deg[name]) > limit:
                self.lost = f"{name} {self.deg[name]:.0f} deg at t = {self.t:.1f} s"
                return
        if self.altitude_m < ALTITUDE_MIN_M or self.on_ground:
            self.lost = f"altitude {self.altitude_m:.0f} m at t = {self.t:.1f} s"

    def say(self, text):
        t = "     -  " if self.t is None else f"{self.t:7.1f}s"
        print(f"[{t}] {text}", flush=True)

    def speed(self):
        """Simulation seconds per wall second, over half a second."""
        wall, t = time.monotonic(), self.t
        while time.monotonic() - wall < 0.5:
            self.pump()
        return max(0.0, (self.t - t) / (time.monotonic() - wall))

    def command(self, name, command, *params):
        """Sends a COMMAND_LONG, again when no answer comes; returns the result."""
        params = list(params) + [0.0] * (7 - len(params))
        before = len(self.acks.get(command, []))
        for _ in range(TRIES):
            self.link.mav.command_long_send(self.system, 1, command, 0, *params)
            self.sent[command] = self.sent.get(command, 0) + 1
            give_up = time.monotonic() + RETRY_S
            while time.monotonic() < give_up:
                self.pump(0.005)
                answers = self.acks.get(command, [])
                if len(answers) > before:
                    result = answers[before]
                    self.say(f"{name}: {RESULTS.get(result, result)}")
                    return result
        raise Failed(f"{name}: no acknowledgement after {TRIES} tries")

    def demand(self, name, command, *params):
        """A command that must be accepted."""
        result = self.command(name, command, *params)
        if result != 0:
            # The reason comes as a text right behind.
            self.wait_wall(0.3)
            raise Failed(f"{name} was not accepted: {RESULTS.get(result, result)}")

    def wait_wall(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.pump()

    def set_mode(self, name, mode):
        self.demand(f"mode {name}", DO_SET_MODE, 1, *mode)
        give_up = time.monotonic() + 2.0
        while self.mode != mode:
            if time.monotonic() > give_up:
                raise Failed(f"the heartbeat does not show mode {name}")
            self.pump()

    def restart(self):
        self.demand("restart the flight", REBOOT, 1)
        self.t = None
        self._first = None
        self.on_ground = False
        # What is still on its way belongs to the old flight.
        self.wait_wall(0.3)
        self.connect()

    def is_level(self, altitude_m):
        return (
            abs(self.deg["roll"]) < 3.0
            and abs(self.climb_m_s) < 3.0
            and abs(self.altitude_m - altitude_m) < 50.0
        )

    def start(self, restart):
        self.connect()
        if restart:
            self.restart()
        self.say(
            f"altitude {self.altitude_m:.0f} m, calibrated airspeed {self.airspeed_m_s:.0f} m/s, "
            f"roll {self.deg['roll']:.1f} deg, {self.speed():.1f} times real time"
        )
        if self.on_ground:
            raise Failed("the aircraft is on the ground: start the flight anew with --restart")
        if not self.is_level(5000.0):
            self.say("not in level flight at 5000 m: the numbers will differ; --restart starts anew")
        self.judging = True

    def break_surface(self, name, instance, angle_deg, lead_s):
        """Jams a servo at an exact simulation time a little ahead; returns that time."""
        lead_s = max(lead_s, 0.5 * self.speed())
        onset = round(self.t + lead_s, 1)
        # Times travel as 32-bit floats: this is the one that arrives.
        onset = struct.unpack("f", struct.pack("f", onset))[0]
        text = f"jam the {name} at {angle_deg:g} deg at t = {onset:.1f} s"
        self.demand(text, USER_1, SERVO, STUCK, instance, ANGLE_DEG, angle_deg, 0, onset)
        return onset

    def watch(self, until_t, every_s, line):
        """Prints a line now and then until the simulation time; stops soon after a loss."""
        next_line = self.t
        lost_at = None
        while self.t < until_t:
            self.pump()
            if self.lost is not None and lost_at is None:
                lost_at = self.t
                self.say(f"LOST: {self.lost}")
            if lost_at is not None and (self.on_ground or self.t > lost_at + 5.0):
                return
            if self.t >= next_line:
                self.say(line(self))
                next_line = self.t + every_s

    def check_acknowledgements(self):
        """Exactly one acknowledgement for each copy of each command."""
        self.wait_wall(0.5)
        for command, copies in self.sent.items():
            answers = len(self.acks.get(command, []))
            if answers != copies:
                raise Failed(f"command {command}: {copies} sent, {answers} acknowledged")
        print(f"acknowledgements: one for each of {sum(self.sent.values())} commands")

    def check_text(self, words):
        if not any(words in text for text in self.texts):
            raise Failed(f"the autopilot never said {words!r}")


def run(fly):
    """Runs a script and turns its end into an exit status."""
    try:
        lost = fly()
    except Failed as failure:
        print(f"FAILED: {failure}")
        sys.exit(FAILED)
    except KeyboardInterrupt:
        print("interrupted")
        sys.exit(FAILED)
    except Exception:
        # Python's own exit status for this would be 1, which means a lost aircraft.
        traceback.print_exc()
        sys.exit(FAILED)
    if lost is not None:
        print(f"the aircraft was LOST: {lost}")
        sys.exit(LOST)
    print("the aircraft SURVIVED")
    sys.exit(SURVIVED)
