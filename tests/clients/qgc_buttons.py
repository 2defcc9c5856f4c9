"""Presses the buttons of QGroundControl 5.0's Fly View from the ground and back, as its source text sends them: Takeoff (mode, then
arming), Start Mission, Return; before that it uploads a plan with a fence as its Plan View does."""

import argparse
import math

from checks import Checks
from station import ACCEPTED, NAN, TEMPORARILY_REJECTED, Station

TAKEOFF, HOLD, MISSION, RETURN = (4, 2), (4, 3), (4, 4), (4, 5)
CUSTOM_MODE = 1
ARM = 400
PLAN, FENCE = 0, 1
IN_AIR, ON_GROUND = 2, 1


def upload(s, items, kind):
    """Items (command, frame, four numbers, latitude, longitude, altitude); the type of the acknowledgement."""
    mark = len(s.messages)
    s.mav.mission_count_send(1, 1, len(items), kind)
    sent = set()

    def done():
        for request in s.of("MISSION_REQUEST_INT", mark) + s.of("MISSION_REQUEST", mark):
            if request.mission_type == kind and request.seq not in sent:
                sent.add(request.seq)
                command, frame, numbers, latitude, longitude, altitude = items[request.seq]
                s.mav.mission_item_int_send(
                    1, 1, request.seq, frame, command, int(request.seq == 0), 1, *numbers,
                    round(latitude * 1e7), round(longitude * 1e7), altitude, kind)
        return s.of("MISSION_ACK", mark)

    return s.of("MISSION_ACK", mark)[0].type if s.wait(done, 10.0) else None


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--connect", default="udpin:127.0.0.1:14550")
    args = parser.parse_args()
    c, s = Checks("QGroundControl's buttons"), Station(args.connect)
    c.expect("connected", s.connect())
    is_armed = lambda: bool(s.latest["HEARTBEAT"].base_mode & 128)
    landed = lambda: s.latest["EXTENDED_SYS_STATE"].landed_state if "EXTENDED_SYS_STATE" in s.latest else None
    c.expect("on the ground and disarmed", s.wait(lambda: landed() == ON_GROUND and not is_armed(), 20.0), landed())

    def mode_button(mode, name):
        """The mode is sent up to three times, until a heartbeat has it."""
        for _ in range(3):
            s.mav.set_mode_send(1, CUSTOM_MODE, mode[0] << 16 | mode[1] << 24)
            if s.wait(lambda: s.mode() == mode, 2.0):
                return c.expect(name, True)
        return c.expect(name, False, s.texts()[-3:])

    home = s.latest["HOME_POSITION"]
    latitude, longitude = home.latitude / 1e7, home.longitude / 1e7

    def at(north_m, east_m):
        return latitude + north_m / 111_000.0, longitude + east_m / (111_000.0 * math.cos(math.radians(latitude)))

    corners = [(-9e3, -9e3), (9e3, -9e3), (9e3, 9e3), (-9e3, 9e3)]
    c.expect("the fence is taken", upload(s, [(5001, 0, (4, 1, 0, 0), *at(*corner), 0.0) for corner in corners], FENCE) == 0)
    # In the frame of relative altitudes, as Plan View writes them.
    places = [(800.0, 800.0), (800.0, -400.0)]
    items = [(22, 3, (15.0, 0, 0, NAN), *at(500.0, 500.0), 90.0)]
    items += [(16, 3, (0, 0, 0, NAN), *at(*place), 100.0) for place in places]
    c.expect("the plan is taken", upload(s, items, PLAN) == 0, s.texts()[-3:])

    # A station arms as soon as it may; until then the reason is on the screen.
    ready = lambda: s.latest["SYS_STATUS"].onboard_control_sensors_health & 0x10000000
    c.expect("ready to arm", s.wait(lambda: "SYS_STATUS" in s.latest and ready(), 60.0), s.texts()[-3:])
    c.expect("another runway is set", s.set_parameter("GND_RWY_HDG", 200.0) == 200.0)
    c.expect("arming is refused there", s.command(ARM, [1]) == TEMPORARILY_REJECTED, s.texts()[-3:])
    c.expect("with both headings", any(text.endswith("heading is 40 deg, GND_RWY_HDG 200") for text in s.texts()), s.texts()[-3:])
    c.expect("this runway is set", s.set_parameter("GND_RWY_HDG", 40.0) == 40.0)
    # It aligns anew.
    mark = len(s.messages)
    c.expect("ready again", s.wait(lambda: len(s.of("SYS_STATUS", mark)) > 1 and ready(), 60.0), s.texts()[-3:])
    mode_button(TAKEOFF, "Takeoff: the mode")
    c.expect("Takeoff: arming", s.command(ARM, [1]) == ACCEPTED, s.texts()[-3:])
    c.expect("in the air", s.wait(lambda: landed() == IN_AIR, 60.0), landed())
    c.expect("holds at the altitude", s.wait(lambda: s.mode() == HOLD, 200.0), s.mode())
    mode_button(MISSION, "Start Mission")
    reached = lambda: [m.seq for m in s.of("MISSION_ITEM_REACHED")]
    c.expect("the plan is flown", s.wait(lambda: len(items) - 1 in reached(), 300.0), reached())
    mode_button(RETURN, "Return")
    c.expect("lands", s.wait(lambda: landed() == ON_GROUND, 400.0), landed())
    c.expect("disarms itself", s.wait(lambda: not is_armed(), 60.0))
    c.expect("the fence was never breached", not any("breached" in text for text in s.texts()))
    c.end()


if __name__ == "__main__":
    main()
