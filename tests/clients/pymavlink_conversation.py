"""The whole conversation with stock pymavlink: parameters, commands, modes, a mission, offboard, sticks."""

import argparse
import math
import time

from checks import Checks
from pymavlink import mavutil
from station import ACCEPTED, DENIED, FAILED, NAN, TEMPORARILY_REJECTED, UNSUPPORTED, UNSUPPORTED_FRAME, Station

POSITION, HOLD, MISSION, RETURN, OFFBOARD, ALTITUDE = (3, 0), (4, 3), (4, 4), (4, 5), (6, 0), (2, 0)
GLOBAL, GLOBAL_RELATIVE = 0, 3
GLOBAL_INT, GLOBAL_RELATIVE_INT = 5, 6


def place(station, north_m, east_m):
    """Latitude and longitude in 1e-7 deg, so far from where the aircraft is now."""
    now = station.latest["GLOBAL_POSITION_INT"]
    lat = now.lat + north_m / 111_000.0 * 1e7
    lon = now.lon + east_m / (111_000.0 * math.cos(math.radians(now.lat * 1e-7))) * 1e7
    return int(lat), int(lon)


def parameters(s, c):
    all_values = s.parameters()
    c.expect("parameters: the list is complete", len(all_values) > 60, len(all_values))
    c.expect("parameter: a write is echoed", abs(s.set_parameter("OBS_W0", 41.0) - 41.0) < 1e-6)
    mark = len(s.messages)
    old = s.set_parameter("OBS_W0", 1e9)
    c.expect("parameter: a refused write echoes the old value", abs(old - 41.0) < 1e-6, old)
    reason = lambda: s.of("PARAM_ERROR", mark) and any("OBS_W0" in t for t in s.texts(mark))
    c.expect("parameter: and says why", s.wait(reason, 5.0))
    c.expect("parameter: NaN is refused", abs(s.set_parameter("OBS_W0", NAN) - 41.0) < 1e-6)
    c.expect("parameter: integers travel byte-wise", s.set_parameter("FTC_MODE", 1, integer=True) == 1)
    compat = s.set_parameter("SYS_AUTOSTART", 7, integer=True)
    c.expect("parameter: a compatibility parameter is read-only", compat == all_values["SYS_AUTOSTART"])
    s.set_parameter("OBS_W0", all_values["OBS_W0"])


def commands(s, c):
    expect = lambda claim, expected, got: c.expect(claim, got == expected, f"result {got}")
    expect("change altitude (186)", ACCEPTED, s.command(186, [5100.0, 0.0]))
    expect("change altitude, outside the limits", DENIED, s.command(186, [90000.0, 0.0]))
    c.expect("and the text names the range", any("12000" in t for t in s.texts()), s.texts()[-1:])
    expect("guided change altitude in COMMAND_INT, above home (43001)", ACCEPTED,
           s.command(43001, [0.0, 0.0, 5.0, 0.0], frame=GLOBAL_RELATIVE, z=5000.0))
    expect("change speed (178), MAVProxy's form", ACCEPTED, s.command(178, [0.0, 208.0, 0.0]))
    expect("change speed, QGroundControl's form", ACCEPTED, s.command(178, [0.0, 212.0, -1.0, 0.0]))
    expect("change speed to NaN keeps it", ACCEPTED, s.command(178, [0.0, NAN, -1.0, 0.0]))
    expect("change speed to infinity", DENIED, s.command(178, [0.0, math.inf, -1.0, 0.0]))
    expect("change speed outside the limits", DENIED, s.command(178, [0.0, 900.0, -1.0, 0.0]))
    expect("guided change speed (43000)", ACCEPTED, s.command(43000, [0.0, 212.0, 0.0, 0, 0, 0, 0]))
    expect("guided change heading (43002)", ACCEPTED, s.command(43002, [0.0, 30.0, 1.0, 0, 0, 0, 0]))
    expect("a command in another system's name is not answered", None, other_target(s))
    expect("arm: it is armed", ACCEPTED, s.command(400, [1.0, 0.0]))
    expect("disarm in the air", TEMPORARILY_REJECTED, s.command(400, [0.0, 0.0]))
    expect("take-off in the air", TEMPORARILY_REJECTED, s.command(22))
    expect("pre-arm checks (401) of an armed aircraft", TEMPORARILY_REJECTED, s.command(401))
    expect("home (410)", ACCEPTED, s.command(410, [0.0] * 7))
    expect("capabilities (520)", ACCEPTED, s.command(520, [1.0]))
    expect("unknown command", UNSUPPORTED, s.command(12345))
    lat, lon = place(s, 20_000.0, 10_000.0)
    expect("go to, as MAVProxy says it (192, frame 3)", ACCEPTED,
           s.command(192, [-1.0, 1.0, 0.0, 0.0], frame=GLOBAL_RELATIVE, xy=(lat, lon), z=5200.0))
    c.expect("the mode is Hold then", s.wait(lambda: s.mode() == HOLD, 2.0), s.mode())
    expect("go to with a wrong frame", UNSUPPORTED_FRAME,
           s.command(192, [-1.0, 1.0, 0.0, 0.0], frame=1, xy=(lat, lon), z=5200.0))
    expect("pause, as QGroundControl says it", ACCEPTED, s.command(192, [-1.0, 1.0]))
    expect("orbit (34)", ACCEPTED,
           s.command(34, [9000.0, NAN, 0.0, 0.0], frame=GLOBAL, xy=(lat, lon), z=5200.0))
    expect("set home (179)", ACCEPTED, s.command(179, [1.0, 0, 0, 0, 0, 0, 0]))


def other_target(s):
    mark = len(s.messages)
    s.mav.command_long_send(9, 1, 186, 0, 5000.0, 0, 0, 0, 0, 0, 0)
    s.run(0.5)
    return s.of("COMMAND_ACK", mark)[0].result if s.of("COMMAND_ACK", mark) else None


def modes(s, c):
    for mode in (POSITION, HOLD, RETURN, POSITION):
        mark = len(s.messages)
        result = s.command(176, [1.0, float(mode[0]), float(mode[1])])
        took = s.wait(lambda: s.mode() == mode, 1.0)
        c.expect(f"mode {mode} by DO_SET_MODE, and the heartbeat shows it", result == ACCEPTED and took, result)
    s.link.target_system = 1
    s.mav.set_mode_send(1, 1, HOLD[0] << 16 | HOLD[1] << 24)
    c.expect("mode by SET_MODE", s.wait(lambda: s.mode() == HOLD, 1.0))
    c.expect("Offboard without setpoints is refused",
             s.command(176, [1.0, 6.0, 0.0]) == TEMPORARILY_REJECTED)
    c.expect("a mode that is not there is denied", s.command(176, [1.0, 1.0, 0.0]) == DENIED)
    c.expect("Mission without a plan is refused",
             s.command(176, [1.0, 4.0, 4.0]) in (TEMPORARILY_REJECTED, DENIED))


def upload(s, items, timeout_s=8.0):
    """Uploads (command, frame, params, x, y, z) and returns the result of MISSION_ACK."""
    mark, sent = len(s.messages), 0
    s.mav.mission_count_send(1, 1, len(items), 0)
    answered = set()
    give_up = time.monotonic() + timeout_s
    while time.monotonic() < give_up:
        s.pump()
        for m in s.messages[mark:]:
            kind = m.get_type()
            if kind in ("MISSION_REQUEST_INT", "MISSION_REQUEST") and id(m) not in answered:
                answered.add(id(m))
                command, frame, p, x, y, z = items[m.seq]
                s.mav.mission_item_int_send(1, 1, m.seq, frame, command, int(m.seq == 0), 1, *p, x, y, z, 0)
                sent += 1
        acks = s.of("MISSION_ACK", mark)
        if acks:
            return acks[0].type
    return None


def mission(s, c):
    at = [place(s, n, e) for n, e in [(25_000, 0), (45_000, 20_000), (70_000, 20_000)]]
    leg = (0.0, 0.0, 0.0, NAN)
    items = [
        (16, GLOBAL_RELATIVE_INT, leg, *at[0], 5200.0),
        (178, 2, (0.0, 215.0, -1.0, 0.0), 0, 0, 0.0),
        (16, GLOBAL_RELATIVE_INT, leg, *at[1], 5400.0),
        (19, GLOBAL_INT, (10.0, 0.0, 9000.0, NAN), *at[2], 5400.0),
    ]
    c.expect("mission: upload", upload(s, items) == 0)
    bad = [(16, GLOBAL_INT, leg, *at[0], 90_000.0)]
    c.expect("mission: an altitude outside the limits is refused", upload(s, bad) not in (0, None))
    bad = [(9999, GLOBAL_INT, leg, *at[0], 0.0)]
    c.expect("mission: an unknown command is unsupported", upload(s, bad) == 3)
    mark = len(s.messages)
    s.mav.mission_request_list_send(1, 1, 0)
    count = s.wait_for("MISSION_COUNT") or s.of("MISSION_COUNT", mark)[-1]
    c.expect("mission: the good plan is still there", count.count == len(items), count.count)
    same = True
    for seq, (command, frame, p, x, y, z) in enumerate(items):
        s.mav.mission_request_int_send(1, 1, seq, 0)
        item = s.wait_for("MISSION_ITEM_INT", 2.0, lambda m: m.seq == seq)
        same &= item is not None and (item.command, item.frame, item.x, item.y) == (command, frame, x, y)
    s.mav.mission_ack_send(1, 1, 0, 0)
    c.expect("mission: the download is what was uploaded", same)
    result = s.command(300, [0.0, 0.0])
    c.expect("mission: start (300)", result == ACCEPTED, f"result {result}, {s.texts()[-2:]}")
    c.expect("mission: the mode is Mission", s.wait(lambda: s.mode() == MISSION, 2.0))
    reached = s.wait(lambda: any(m.seq == 0 for m in s.of("MISSION_ITEM_REACHED")), 60.0)
    c.expect("mission: the first waypoint is reached", reached)
    c.expect("mission: pause (193)", s.command(193, [0.0]) == ACCEPTED and s.wait(lambda: s.mode() == HOLD, 2.0))
    c.expect("mission: continue (193)",
             s.command(193, [1.0]) == ACCEPTED and s.wait(lambda: s.mode() == MISSION, 2.0))
    c.expect("mission: progress is reported", s.wait(lambda: s.latest["MISSION_CURRENT"].seq >= 2, 5.0))
    c.expect("mission: set the current item (224)", s.command(224, [3.0, 0.0]) == ACCEPTED)
    c.expect("mission: and it is", s.wait(lambda: s.latest["MISSION_CURRENT"].seq == 3, 3.0))
    c.expect("mission: a current item that is not there", s.command(224, [77.0, 0.0]) == FAILED)
    s.mav.mission_clear_all_send(1, 1, 0)
    ack = s.wait_for("MISSION_ACK")
    c.expect("mission: clear", ack is not None and ack.type == 0)
    c.expect("mission: without a plan the aircraft holds", s.wait(lambda: s.mode() == HOLD, 3.0), s.mode())


def offboard(s, c):
    def setpoints(seconds, send):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            send()
            s.pump(0.04)

    half = math.radians(12.0) / 2
    roll = lambda: s.mav.set_attitude_target_send(
        0, 1, 1, 7, [math.cos(half), math.sin(half), 0.0, 0.0], 0, 0, 0, 0.6)
    setpoints(0.3, roll)
    c.expect("offboard: enters with fresh setpoints", s.command(176, [1.0, 6.0, 0.0]) == ACCEPTED)
    setpoints(4.0, roll)
    angle = math.degrees(s.latest["ATTITUDE"].roll)
    c.expect("offboard: the roll is flown", abs(angle - 12.0) < 2.0, f"{angle:.1f} deg")
    lat, lon = place(s, 30_000.0, 0.0)
    position = lambda: s.mav.set_position_target_global_int_send(
        0, 1, 1, 6, 0xDF8, lat, lon, 5300.0, 0, 0, 0, 0, 0, 0, 0, 0)
    setpoints(2.0, position)
    c.expect("offboard: a position is flown", s.mode() == OFFBOARD and
             abs(s.latest["POSITION_TARGET_GLOBAL_INT"].lat_int - lat) < 100)
    s.run(1.5)
    c.expect("offboard: without setpoints back to Hold, with a text",
             s.mode() == HOLD and any("setpoint" in t.lower() for t in s.texts()), s.mode())


def sticks(s, c):
    def hold(seconds, send):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            send()
            s.pump(0.04)

    stick = lambda: s.mav.manual_control_send(1, 0, 500, 500, 0, 0)
    hold(0.3, stick)
    c.expect("sticks: Altitude is entered", s.command(176, [1.0, 2.0, 0.0]) == ACCEPTED)
    hold(4.0, stick)
    angle = math.degrees(s.latest["ATTITUDE"].roll)
    c.expect("sticks: half of the stick banks", s.mode() == ALTITUDE and angle > 10.0, f"{angle:.1f} deg")
    rc = lambda: s.mav.rc_channels_override_send(1, 1, 1500, 1500, 65535, 1500, 0, 0, 0, 0)
    hold(3.0, rc)
    angle = math.degrees(s.latest["ATTITUDE"].roll)
    c.expect("sticks: RC override levels", abs(angle) < 5.0, f"{angle:.1f} deg")
    s.run(1.5)
    c.expect("sticks: without them back to Hold", s.mode() == HOLD, s.mode())


def streams(s, c):
    c.expect("interval of ATTITUDE to 5 Hz (511)", s.command(511, [30.0, 200_000.0]) == ACCEPTED)
    s.run(0.5)
    mark = len(s.messages)
    s.run(2.0)
    count = len(s.of("ATTITUDE", mark))
    c.expect("and it comes so often", 7 <= count <= 13, f"{count} in 2 s")
    c.expect("interval requested (510)", s.command(510, [30.0]) == ACCEPTED
             and s.latest["MESSAGE_INTERVAL"].interval_us == 200_000)
    c.expect("switched off", s.command(511, [30.0, -1.0]) == ACCEPTED)
    s.run(0.3)
    mark = len(s.messages)
    s.run(1.0)
    c.expect("nothing comes then", not s.of("ATTITUDE", mark))
    c.expect("default again", s.command(511, [30.0, 0.0]) == ACCEPTED)
    c.expect("a message that is not there", s.command(511, [9999.0, 0.0]) in (DENIED, UNSUPPORTED))


def faults(s, c):
    result = s.command(420, [102.0, 2.0, 5.0, NAN])
    c.expect("fault: rudder stuck (420)", result == ACCEPTED, result)
    result = s.command(420, [102.0, 0.0, 5.0, NAN])
    c.expect("fault: cleared", result == ACCEPTED, result)
    result = s.command(420, [4.0, 1.0, 1.0, NAN])
    c.expect("fault: the satellites are off", result == ACCEPTED, result)
    result = s.command(31010, [8.0, 4.0, 1.0, 3.0, -500.0])
    c.expect("fault: a bias of the pitot tube, Pa (USER_1)", result == ACCEPTED, result)
    for unit in [4.0, 8.0]:
        result = s.command(420, [unit, 0.0, 1.0, NAN])
        c.expect("fault: the sensor is repaired", result == ACCEPTED, result)
    result = s.command(420, [1010.0, 1.0, 1.0, NAN])
    c.expect("fault: the left wing tip is torn off", result == ACCEPTED, result)
    result = s.command(31010, [1014.0, 1.0, 1.0, 12.0, 15.0])
    c.expect("fault: 15 % of the fin is torn off (USER_1)", result == ACCEPTED, result)
    result = s.command(31010, [1014.0, 1.0, 1.0, 12.0, 150.0])
    c.expect("fault: no more than a fin has", result == DENIED, result)
    for unit in [1010.0, 1014.0]:
        result = s.command(420, [unit, 0.0, 1.0, NAN])
        c.expect("fault: the aircraft is whole again", result == ACCEPTED, result)
    result = s.command(420, [5.0, 1.0, 0.0, NAN])
    c.expect("fault: a unit that cannot fail here", result == UNSUPPORTED, result)


def pace(s, c):
    boot = lambda: s.latest["ATTITUDE"].time_boot_ms
    c.expect("pause (31011)", s.command(31011, [0.0]) == ACCEPTED)
    s.run(0.5)
    before, mark = boot(), len(s.messages)
    s.run(2.5)
    c.expect("paused: time stands still and heartbeats go on",
             boot() == before and len(s.of("HEARTBEAT", mark)) >= 2, f"{boot() - before} ms")
    c.expect("single steps", s.command(31011, [2.0, 50.0]) == ACCEPTED)
    s.run(0.5)
    c.expect("50 periods are 100 ms", boot() - before == 100, f"{boot() - before} ms")
    c.expect("slow motion", s.command(31011, [3.0, 0.5]) == ACCEPTED and s.command(31011, [1.0]) == ACCEPTED)
    s.run(0.5)
    begin, wall = boot(), time.monotonic()
    s.run(3.0)
    factor = (boot() - begin) / 1e3 / (time.monotonic() - wall)
    c.expect("time runs at half the speed", 0.4 < factor < 0.6, f"x{factor:.2f}")
    c.expect("no word of a lost link", not any("lost" in t.lower() for t in s.texts(mark)))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--connect", default="udpin:127.0.0.1:14550")
    args = parser.parse_args()
    c = Checks(f"pymavlink {mavutil.mavlink.__name__}")
    s = Station(args.connect, dialect="all")
    if not c.expect("connects", s.connect()):
        c.end()
    for part in (parameters, commands, modes, streams, mission, offboard, sticks, faults, pace):
        print(f" {part.__name__}")
        part(s, c)
    c.expect("no malformed message", s.bad == 0 and not any(k.startswith("UNKNOWN") for k in s.latest))
    c.end()


if __name__ == "__main__":
    main()
