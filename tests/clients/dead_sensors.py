"""No value of a dead sensor is sent as alive: the table of docs/sensors.md, with stock pymavlink and MAVSDK."""

import argparse
import math
import pathlib
import time

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.failure import Failure, FailureType, FailureUnit
from mavsdk.plugins.telemetry import Telemetry

from checks import Checks, wait_until
from station import ACCEPTED, Station

DOCUMENT = pathlib.Path(__file__).parents[2] / "docs" / "sensors.md"
BEGIN, END = "<!-- dead sensors: read by tests/clients/dead_sensors.py -->", "<!-- end of dead sensors -->"
INJECT_FAILURE, OFF, STUCK, OK = 420, 1, 2, 0
# FAILURE_UNIT and name in texts of each sensor.
UNITS = {
    "gnss": (4, "GNSS"), "barometer": (3, "Barometer"), "pitot": (8, "Airspeed"), "vanes": (1001, "Vanes"),
    "accelerometer": (1, "Accelerometer"), "magnetometer": (2, "Magnetometer"), "attitude": (1000, "Attitude unit"),
    "engine monitor": (1002, "Engine monitor"), "gyro": (0, "Gyro"),
}
HEALTH = {"gyro": 1, "accelerometer": 2, "magnetometer": 4, "barometer": 8, "pitot": 16, "gnss": 32}
# A gyro that is lost loses an aircraft that estimates its states: checked early, and last.
NO_SPARE = "gyro"
# Nobody compares the samples of this one with the ones before.
UNWATCHED = "engine monitor"


def table(grade):
    """Rows of the table for a grade: sensor, message, fields, what they are."""
    text = DOCUMENT.read_text(encoding="utf-8")
    rows = text[text.index(BEGIN):text.index(END)].splitlines()
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows if row.startswith("|")]
    for sensor, message, fields, ideal, estimated in cells[2:]:
        value = ideal if grade == "ideal" else estimated
        yield sensor, message, fields.replace("`", "").split(", "), value


def is_value(found, expected):
    if expected == "known":
        return not math.isnan(found)
    return math.isnan(found) if expected == "NaN" else found == int(expected)


def check(c, s, rows, mark, label):
    for message, fields, expected in rows:
        if expected == "not sent":
            c.expect(f"{label}: no {message}", not s.of(message, mark))
            continue
        latest = s.of(message, mark)
        if not c.expect(f"{label}: {message} comes", bool(latest)):
            continue
        for field in fields:
            found = getattr(latest[-1], field)
            c.expect(f"{label}: {message}.{field} is {expected}", is_value(found, expected), found)


def lose(c, s, sensor, kind, rows):
    unit, name = UNITS[sensor]
    label = f"{sensor} {'off' if kind == OFF else 'stuck'}"
    mark = len(s.messages)
    c.expect(f"{label}: injected", s.command(INJECT_FAILURE, [float(unit), float(kind), 0.0]) == ACCEPTED)
    told = lambda text: lambda: any(m.text == text for m in s.of("STATUSTEXT", mark))
    c.expect(f"{label}: \"{name} lost\"", s.wait(told(f"{name} lost"), 10.0))
    s.run(0.3 if sensor == NO_SPARE else 1.2)
    after = len(s.messages)
    s.run(0.6 if sensor == NO_SPARE else 2.2)
    check(c, s, rows, after, label)
    if sensor in HEALTH:
        status = s.of("SYS_STATUS", after)[-1]
        c.expect(f"{label}: not healthy", status.onboard_control_sensors_health & HEALTH[sensor] == 0)
        healthy_only = status.onboard_control_sensors_health & ~status.onboard_control_sensors_present
        c.expect(f"{label}: nothing is healthy that is not present", healthy_only == 0, hex(healthy_only))
    return label, name, unit, mark, told


def repair(c, s, lost):
    label, name, unit, _, told = lost
    s.command(INJECT_FAILURE, [float(unit), float(OK), 0.0])
    c.expect(f"{label}: \"{name} is back\"", s.wait(told(f"{name} is back"), 15.0))


def pymavlink(c, connect, grade):
    s = Station(connect)
    c.expect("the aircraft is there", s.wait(lambda: "VFR_HUD" in s.latest and "GPS_RAW_INT" in s.latest, 10.0))
    for message in (65, 251):
        s.command(511, [float(message), 100_000.0])
    s.run(2.0)
    sensors = {}
    for sensor, message, fields, value in table(grade):
        if value != "-":
            sensors.setdefault(sensor, []).append((message, fields, value))
    kinds = (OFF,) if grade == "ideal" else (OFF, STUCK)
    for sensor in sorted(sensors, key=lambda sensor: sensor == NO_SPARE):
        for kind in kinds if sensor not in (NO_SPARE, UNWATCHED) else (OFF,):
            lost = lose(c, s, sensor, kind, sensors[sensor])
            if sensor != NO_SPARE:
                repair(c, s, lost)
    s.link.close()


def mavsdk(c, connect):
    client = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    client.add_any_connection(connect)
    system = client.first_autopilot(10.0)
    telemetry, failure, seen = Telemetry(system), Failure(system), {}
    for kind in ("gps_info", "raw_gps", "fixedwing_metrics", "health", "scaled_pressure"):
        getattr(telemetry, f"subscribe_{kind}")(lambda data, _=None, kind=kind: seen.__setitem__(kind, data))
    c.expect("MAVSDK: a fix", wait_until(lambda: "gps_info" in seen and seen["gps_info"].fix_type.value == 3, 10.0), seen.get("gps_info"))
    c.expect("MAVSDK: healthy", wait_until(lambda: "health" in seen and seen["health"].is_global_position_ok, 10.0))
    failure.inject(FailureUnit.SENSOR_GPS, FailureType.OFF, 0)
    c.expect("MAVSDK: no fix without satellites", wait_until(lambda: seen["gps_info"].fix_type.value <= 1, 10.0), seen["gps_info"])
    c.expect("MAVSDK: and not 16 of them", seen["gps_info"].num_satellites != 16, seen["gps_info"].num_satellites)
    c.expect("MAVSDK: dilution unknown", not seen["raw_gps"].hdop < 600.0, seen["raw_gps"].hdop)
    c.expect("MAVSDK: the position is not healthy", wait_until(lambda: not seen["health"].is_global_position_ok, 10.0))
    failure.inject(FailureUnit.SENSOR_GPS, FailureType.OK, 0)
    c.expect("MAVSDK: a fix again", wait_until(lambda: seen["gps_info"].fix_type.value == 3, 10.0))
    failure.inject(FailureUnit.SENSOR_AIRSPEED, FailureType.OFF, 0)
    c.expect("MAVSDK: no differential pressure without a pitot tube",
             wait_until(lambda: math.isnan(seen["scaled_pressure"].differential_pressure_hpa), 10.0), seen["scaled_pressure"])
    failure.inject(FailureUnit.SENSOR_AIRSPEED, FailureType.OK, 0)
    time.sleep(0.2)
    client.destroy()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--connect", default="udpin:127.0.0.1:14550")
    parser.add_argument("--grade", default="ideal")
    options = parser.parse_args()
    c = Checks(f"dead sensors, {options.grade}")
    mavsdk(c, options.connect.replace("udpin:", "udpin://"))
    pymavlink(c, options.connect, options.grade)
    c.end()


if __name__ == "__main__":
    main()
