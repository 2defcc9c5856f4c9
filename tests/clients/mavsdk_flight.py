"""A flight with stock MAVSDK: health, every telemetry of a plane, parameters, mission, go to, offboard."""

import argparse
import math
import time

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.action import Action, ActionError, OrbitYawBehavior
from mavsdk.plugins.failure import Failure, FailureError, FailureResult, FailureType, FailureUnit
from mavsdk.plugins.ftp import Ftp
from mavsdk.plugins.info import Info
from mavsdk.plugins.mission import Mission, MissionItem, MissionPlan
from mavsdk.plugins.mission_raw import MissionItem as RawItem
from mavsdk.plugins.mission_raw import MissionRaw
from mavsdk.plugins.offboard import Attitude, Offboard, PositionGlobalYaw, PositionNedYaw, VelocityNedYaw
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import Telemetry

from checks import Checks, wait_until

# Every kind of telemetry that MAVSDK offers and a plane with these sensors has.
KINDS = [
    "position", "home", "in_air", "landed_state", "armed", "attitude_quaternion", "attitude_euler",
    "attitude_angular_velocity_body", "velocity_ned", "gps_info", "raw_gps", "battery", "flight_mode",
    "health", "rc_status", "actuator_output_status", "odometry", "position_velocity_ned",
    "fixedwing_metrics", "imu", "health_all_ok", "unix_epoch_time", "scaled_pressure", "heading",
    "altitude", "wind",
]


def telemetry(c, t):
    seen = {}
    for kind in KINDS:
        getattr(t, f"subscribe_{kind}")(lambda data, _=None, kind=kind: seen.__setitem__(kind, data))
    wait_until(lambda: len(seen) == len(KINDS), 5.0)
    for kind in KINDS:
        c.expect(f"telemetry: {kind}", kind in seen)
    t.subscribe_status_text(lambda text, _=None: seen.setdefault("texts", []).append(text.text))
    # 264 m/s through the air at 5000 m.
    c.expect("telemetry: calibrated airspeed", abs(seen["fixedwing_metrics"].airspeed_m_s - 212.0) < 12.0,
             seen["fixedwing_metrics"].airspeed_m_s)
    c.expect("telemetry: in the air and armed", seen["in_air"] and seen["armed"])
    return seen


def ahead(position, north_m, east_m):
    lat = position.latitude_deg + north_m / 111_000.0
    return lat, position.longitude_deg + east_m / (111_000.0 * math.cos(math.radians(lat)))


def fly_mission(c, system, seen):
    mission = Mission(system)
    position = seen["position"]
    items = []
    for north, east, altitude, speed in [(15e3, 0, 5100, 264), (30e3, 10e3, 5300, 268), (50e3, 10e3, 5300, 264)]:
        lat, lon = ahead(position, north, east)
        items.append(MissionItem(
            latitude_deg=lat, longitude_deg=lon, relative_altitude_m=float(altitude), speed_m_s=float(speed),
            is_fly_through=True, acceptance_radius_m=800.0))
    plan = MissionPlan(items)
    mission.upload_mission(plan)
    c.expect("mission: uploaded", True)
    got = mission.download_mission()
    got = got[1] if isinstance(got, tuple) else got
    c.expect("mission: downloaded whole", len(got.mission_items) == len(items), len(got.mission_items))
    progress = []
    mission.subscribe_mission_progress(lambda p, _=None: progress.append((p.current, p.total)))
    mission.start_mission()
    c.expect("mission: started", wait_until(lambda: seen["flight_mode"].name == "MISSION", 3.0),
             seen["flight_mode"])
    c.expect("mission: progress to the second item",
             wait_until(lambda: any(current >= 1 for current, _ in progress), 60.0), progress[-1:])
    mission.pause_mission()
    c.expect("mission: paused", wait_until(lambda: seen["flight_mode"].name == "HOLD", 3.0))
    mission.set_current_mission_item(2)
    mission.start_mission()
    c.expect("mission: resumed at the third item",
             wait_until(lambda: seen["flight_mode"].name == "MISSION", 3.0)
             and wait_until(lambda: progress and progress[-1][0] == 2, 3.0), progress[-1:])
    mission.clear_mission()
    c.expect("mission: cleared", True)


def actions(c, action, seen):
    lat, lon = ahead(seen["position"], 20e3, 5e3)
    action.goto_location(lat, lon, 5200.0, 0.0)
    c.expect("action: go to", wait_until(lambda: seen["flight_mode"].name == "HOLD", 3.0))
    action.goto_location_fixedwing(lat, lon, 5200.0, 9000.0)
    c.expect("action: go to with a radius", True)
    action.goto_location_fixedwing(lat, lon, 5200.0, -10_000.0)
    c.expect("action: go to, turning left", True)
    action.do_orbit(9000.0, 264.0, OrbitYawBehavior.UNCONTROLLED, lat, lon, 5200.0)
    c.expect("action: orbit", True)
    action.set_current_speed(260.0)
    c.expect("action: speed", True)
    action.hold()
    c.expect("action: hold", wait_until(lambda: seen["flight_mode"].name == "HOLD", 3.0))
    action.return_to_launch()
    c.expect("action: return", wait_until(lambda: seen["flight_mode"].name == "RETURN_TO_LAUNCH", 3.0),
             seen["flight_mode"])
    action.hold()
    action.arm()
    c.expect("action: arm (it is)", True)
    for name, call in [("disarm in the air", action.disarm), ("take-off in the air", action.takeoff)]:
        try:
            call()
            c.expect(f"action: {name} is refused", False)
        except ActionError as error:
            c.expect(f"action: {name} is refused", True, error.result)
    c.expect("action: return altitude is read", action.get_return_to_launch_altitude() > 0)


def fly_offboard(c, system, seen):
    offboard = Offboard(system)
    offboard.set_attitude(Attitude(15.0, 0.0, 0.0, 0.6))
    time.sleep(0.2)
    offboard.start()
    c.expect("offboard: started", wait_until(lambda: seen["flight_mode"].name == "OFFBOARD", 3.0))
    rolled = wait_until(lambda: abs(seen["attitude_euler"].roll_deg - 15.0) < 2.0, 8.0)
    c.expect("offboard: the roll is flown", rolled, f"{seen['attitude_euler'].roll_deg:.1f} deg")
    lat, lon = ahead(seen["position"], 30e3, 0.0)
    north = seen["position_velocity_ned"].position.north_m + 30e3
    for name, send in [
        ("global position", lambda: offboard.set_position_global(
            PositionGlobalYaw(lat, lon, 5200.0, 0.0, PositionGlobalYaw.AltitudeType.AMSL))),
        ("local position", lambda: offboard.set_position_ned(PositionNedYaw(north, 0.0, -5200.0, 0.0))),
        ("velocity", lambda: offboard.set_velocity_ned(VelocityNedYaw(264.0, 0.0, 0.0, 0.0))),
    ]:
        send()
        time.sleep(1.0)
        c.expect(f"offboard: {name}", seen["flight_mode"].name == "OFFBOARD", seen["flight_mode"])
    offboard.stop()
    c.expect("offboard: stopped, Hold", wait_until(lambda: seen["flight_mode"].name == "HOLD", 3.0))


def parameters(c, system):
    param = Param(system)
    value = param.get_param_float("OBS_W0")
    param.set_param_float("OBS_W0", 41.0)
    c.expect("param: float set and read", abs(param.get_param_float("OBS_W0") - 41.0) < 1e-5)
    param.set_param_float("OBS_W0", value)
    c.expect("param: int read", param.get_param_int("SYS_FAILURE_EN") == 1)
    param.set_param_int("FTC_MODE", 1)
    everything = param.get_all_params()
    count = len(everything.int_params) + len(everything.float_params)
    c.expect("param: all", count > 60, count)
    began = time.monotonic()
    try:
        param.get_param_float("NO_SUCH")
        c.expect("param: one that is not there is refused", False)
    except Exception as error:
        took = time.monotonic() - began
        c.expect("param: one that is not there is refused", True, f"{error}, {took:.2f} s")


def raw(c, system, seen):
    mission = MissionRaw(system)
    lat, lon = ahead(seen["position"], 30e3, 0.0)
    nan = float("nan")
    items = [
        RawItem(seq, 6, 16, int(seq == 0), 1, 0.0, 0.0, 0.0, nan, int(lat * 1e7), int(lon * 1e7), 5100.0, 0)
        for seq in range(2)
    ]
    mission.upload_mission(items)
    got = mission.download_mission()
    got = got[1] if isinstance(got, tuple) else got
    c.expect("mission_raw: uploaded and downloaded", len(got) == 2, len(got))
    mission.clear_mission()


def files(c, system):
    names = [entry.name for entry in Ftp(system).list_directory("/").entries]
    c.expect("ftp: the description files are listed", "general.json" in names, names)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--connect", default="udpin://127.0.0.1:14540")
    args = parser.parse_args()
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    c = Checks(f"MAVSDK {mavsdk.version()}")
    mavsdk.add_any_connection(args.connect)
    began = time.monotonic()
    system = mavsdk.first_autopilot(20.0)
    if not c.expect("connects", system is not None, f"{time.monotonic() - began:.2f} s"):
        c.end()
    t = Telemetry(system)
    ok = []
    t.subscribe_health_all_ok(lambda good, _=None: ok.append(good))
    began = time.monotonic()
    healthy = wait_until(lambda: ok and ok[-1], 3.0)
    c.expect("health_all_ok within 3 s", healthy, f"{time.monotonic() - began:.2f} s")
    version = Info(system).get_version()
    c.expect("info: version", (version.flight_sw_major, version.flight_sw_minor) >= (1, 4),
             f"{version.flight_sw_major}.{version.flight_sw_minor}")
    seen = telemetry(c, t)
    t.set_rate_attitude_euler(5.0)
    c.expect("telemetry: a rate is set", True)
    parameters(c, system)
    fly_mission(c, system, seen)
    actions(c, Action(system), seen)
    fly_offboard(c, system, seen)
    failure = Failure(system)
    failure.inject(FailureUnit.SYSTEM_SERVO, FailureType.STUCK, 5)
    failure.inject(FailureUnit.SYSTEM_SERVO, FailureType.OK, 5)
    c.expect("failure: a servo sticks and is cleared", True)
    for unit, instance, result in [
        (FailureUnit.SENSOR_OPTICAL_FLOW, 0, FailureResult.UNSUPPORTED),
        (FailureUnit.SYSTEM_SERVO, 77, FailureResult.DENIED),
    ]:
        try:
            failure.inject(unit, FailureType.STUCK, instance)
            c.expect(f"failure: {unit.name} {instance} is {result.name}", False)
        except FailureError as error:
            c.expect(f"failure: {unit.name} {instance} is {result.name}", error.result == result, error.result)
    raw(c, system, seen)
    files(c, system)
    mavsdk.destroy()
    c.end()


if __name__ == "__main__":
    main()
