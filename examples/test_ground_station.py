"""Tests a ground station: it has to bring the aircraft home when a surface jams.

    pip install two-step[vehicle] pytest
    pytest examples/test_ground_station.py
"""

from threading import Thread

from pymavlink import mavutil


class Station:
    """The code under test, which is yours: it returns home when the autopilot compensates a fault."""

    def __init__(self, address):
        self.link = mavutil.mavlink_connection(address)
        self.link.wait_heartbeat()

    def watch(self):
        while "Compensator active" not in self.link.recv_match(type="STATUSTEXT", blocking=True).text:
            pass
        self.link.mav.command_long_send(
            self.link.target_system, self.link.target_component,
            mavutil.mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, 0, 0, 0, 0, 0, 0, 0, 0)


def test_the_station_returns_home_when_an_elevator_jams(two_step_vehicle):
    vehicle = two_step_vehicle(speed=10)
    station = Station(vehicle.address)
    Thread(target=station.watch, daemon=True).start()

    vehicle.fail("left elevator stuck at 30 deg")
    returned_s = vehicle.wait(lambda v: v["mode"] == "Return" and v.time_s, timeout_s=120, what="the mode Return")
    vehicle.wait(lambda v: v.time_s > returned_s + 60, what="a minute of flight")
    assert vehicle["plant"] == "flying"
