"""State and quality of the estimate with stock pymavlink: an aircraft with tactical sensors, which loses its satellites."""

import argparse
import math

from checks import Checks
from station import ACCEPTED, Station

ESTIMATOR_STATUS, GPS, OFF = 230, 4, 1
ATTITUDE_BIT, POSITION_BIT, GPS_BIT = 1, 16, 32


def interval(c, s):
    c.expect("interval of 10 Hz", s.command(511, [230.0, 100_000.0]) == ACCEPTED)
    s.run(0.3)
    mark = len(s.messages)
    s.run(2.0)
    count = len(s.of("ESTIMATOR_STATUS", mark))
    c.expect("about twenty in two seconds", 10 <= count <= 25, count)


def estimate(c, s):
    c.expect("it can be requested", s.command(512, [230.0]) == ACCEPTED)
    s.wait_for("ESTIMATOR_STATUS")
    now = s.latest["ESTIMATOR_STATUS"]
    c.expect("attitude and position are good", now.flags & (ATTITUDE_BIT | POSITION_BIT) == (ATTITUDE_BIT | POSITION_BIT), now.flags)
    ratios = [now.vel_ratio, now.pos_horiz_ratio, now.pos_vert_ratio, now.mag_ratio, now.tas_ratio]
    c.expect("innovations are within their gates, and not all zero", all(0.0 <= r < 1.0 for r in ratios) and any(ratios), ratios)
    c.expect("nothing measures the height above the ground", math.isnan(now.hagl_ratio), now.hagl_ratio)
    accuracy = now.pos_horiz_accuracy
    c.expect("the position is good to some metres", 0.5 < accuracy < 5.0, accuracy)
    return accuracy


def outage(c, s, before):
    is_healthy = lambda: s.latest["SYS_STATUS"].onboard_control_sensors_health & GPS_BIT != 0
    c.expect("the receiver is healthy", s.wait(is_healthy, 3.0))
    c.expect("the satellites are lost", s.command(420, [float(GPS), float(OFF), 0.0]) == ACCEPTED)
    c.expect("the receiver is not healthy", s.wait(lambda: not is_healthy(), 10.0))
    worse = lambda: s.latest["ESTIMATOR_STATUS"].pos_horiz_accuracy > before + 0.5
    c.expect("the position becomes less accurate", s.wait(worse, 20.0), s.latest["ESTIMATOR_STATUS"].pos_horiz_accuracy)
    c.expect("the attitude stays good", s.latest["ESTIMATOR_STATUS"].flags & ATTITUDE_BIT != 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--connect", default="udpin:127.0.0.1:14550")
    s = Station(parser.parse_args().connect)
    c = Checks("estimator status")
    c.expect("the aircraft is there", s.wait(lambda: "ESTIMATOR_STATUS" in s.latest and "SYS_STATUS" in s.latest, 10.0))
    interval(c, s)
    outage(c, s, estimate(c, s))
    c.end()


if __name__ == "__main__":
    main()
