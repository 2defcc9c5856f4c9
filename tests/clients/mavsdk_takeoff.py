"""From the ground and back with stock MAVSDK: arming, takeoff, a mission inside a fence, return, landing."""

import argparse
import math

from mavsdk.plugins.action import Action, ActionError
from mavsdk.plugins.geofence import FenceType, Geofence, GeofenceData, Point, Polygon
from mavsdk.plugins.mission import Mission, MissionItem, MissionPlan
from mavsdk.plugins.telemetry import Telemetry

from checks import Checks, wait_until
from mavsdk_failure import connected


def ahead(home, north_m, east_m):
    lat = home.latitude_deg + north_m / 111_000.0
    return lat, home.longitude_deg + east_m / (111_000.0 * math.cos(math.radians(lat)))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--connect", default="udpin://127.0.0.1:14540")
    args = parser.parse_args()
    c = Checks("MAVSDK, from the ground")
    mavsdk, system = connected(c, args.connect)
    t, action, seen, texts = Telemetry(system), Action(system), {}, []
    for kind in ["position", "home", "in_air", "landed_state", "armed", "flight_mode", "health_all_ok"]:
        getattr(t, f"subscribe_{kind}")(lambda data, _=None, kind=kind: seen.__setitem__(kind, data))
    t.subscribe_status_text(lambda text, _=None: texts.append(text.text))
    c.expect("ready", wait_until(lambda: seen.get("health_all_ok") and len(seen) == 7, 30.0), seen)
    c.expect("on the ground and disarmed", not seen["in_air"] and not seen["armed"], seen)
    c.expect("home is on the ground", abs(seen["home"].absolute_altitude_m - 700.0) < 10.0, seen["home"])

    fence = Geofence(system)
    corners = [Point(*ahead(seen["home"], north, east)) for north, east in [
        (-9e3, -9e3), (9e3, -9e3), (9e3, 9e3), (-9e3, 9e3)]]
    # Raises if it is refused.
    fence.upload_geofence(GeofenceData([Polygon(corners, FenceType.INCLUSION)], []))

    action.arm()
    c.expect("armed", wait_until(lambda: seen["armed"], 5.0))
    action.set_takeoff_altitude(80.0)
    action.takeoff()
    c.expect("takes off", wait_until(lambda: seen["in_air"], 60.0), seen)
    climbed = wait_until(lambda: seen["position"].relative_altitude_m > 70.0, 120.0)
    c.expect("climbs to the altitude", climbed, seen["position"])
    c.expect("holds there", wait_until(lambda: seen["flight_mode"].name == "HOLD", 60.0), seen["flight_mode"])
    try:
        action.disarm()
        c.expect("disarming in the air is refused", False)
    except ActionError as error:
        c.expect("disarming in the air is refused", True, error.result)

    mission = Mission(system)
    items = [MissionItem(*ahead(seen["home"], north, east), relative_altitude_m=100.0, speed_m_s=25.0, is_fly_through=True)
             for north, east in [(800.0, 800.0), (800.0, -400.0)]]
    mission.upload_mission(MissionPlan(items))
    mission.start_mission()
    c.expect("mission: begins", wait_until(lambda: seen["flight_mode"].name == "MISSION", 5.0))
    c.expect("mission: complete", wait_until(mission.is_mission_finished, 200.0))

    action.return_to_launch()
    c.expect("returns", wait_until(lambda: seen["flight_mode"].name == "RETURN_TO_LAUNCH", 5.0), seen["flight_mode"])
    c.expect("lands", wait_until(lambda: not seen["in_air"], 300.0), seen)
    c.expect("disarms itself", wait_until(lambda: not seen["armed"], 60.0), seen)
    c.expect("the fence was never breached", not any("breached" in text for text in texts), texts[-3:])
    mavsdk.destroy()
    c.end()


if __name__ == "__main__":
    main()
