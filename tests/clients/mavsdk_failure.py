"""Stock MAVSDK injects and clears faults: success, unsupported, denied and disabled, each provoked."""

import argparse
import time

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.failure import Failure, FailureError, FailureResult, FailureType, FailureUnit
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import Telemetry

from checks import Checks, wait_until

SERVO, MOTOR = FailureUnit.SYSTEM_SERVO, FailureUnit.SYSTEM_MOTOR
T, R = FailureType, FailureResult

# Sensors, with their names in texts.
SENSORS = {
    FailureUnit.SENSOR_GYRO: "gyro",
    FailureUnit.SENSOR_ACCEL: "accelerometer",
    FailureUnit.SENSOR_MAG: "magnetometer",
    FailureUnit.SENSOR_BARO: "barometer",
    FailureUnit.SENSOR_GPS: "gnss",
    FailureUnit.SENSOR_AIRSPEED: "pitot",
}
# Units of the aircraft that cannot fail in this vehicle.
OTHER_UNITS = [unit for unit in FailureUnit if unit not in (SERVO, MOTOR, *SENSORS)]


def result_of(failure, unit, kind, instance):
    """MAVSDK's result for the acknowledgement."""
    try:
        failure.inject(unit, kind, instance)
        return R.SUCCESS
    except FailureError as error:
        return error.result


def connected(c, connect):
    """A new MAVSDK: it reads SYS_FAILURE_EN when it discovers the vehicle."""
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    mavsdk.add_any_connection(connect)
    system = mavsdk.first_autopilot(20.0)
    if not c.expect("connects", system is not None):
        c.end()
    return mavsdk, system


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--connect", default="udpin://127.0.0.1:14540")
    args = parser.parse_args()
    c = Checks("MAVSDK: failures")
    mavsdk, system = connected(c, args.connect)
    texts = []
    Telemetry(system).subscribe_status_text(lambda text, _=None: texts.append(text.text))
    failure, param = Failure(system), Param(system)

    def has_text(words):
        return wait_until(lambda: any(words in text for text in texts), 3.0)

    def expect(unit, kind, instance, wanted, words=None):
        texts.clear()
        result = result_of(failure, unit, kind, instance)
        claim = f"{unit.name} {kind.name} {instance}: {wanted.name}"
        c.expect(claim, result == wanted, result)
        if words is not None:
            c.expect(f"  and the text says {words!r}", has_text(words), texts)

    for kind in [T.STUCK, T.GARBAGE, T.WRONG, T.SLOW, T.DELAYED, T.INTERMITTENT, T.OFF]:
        expect(SERVO, kind, 7, R.SUCCESS, "Injected: nozzle yaw")
        expect(SERVO, T.OK, 7, R.SUCCESS, "Cleared: nozzle yaw")
    expect(MOTOR, T.WRONG, 1, R.SUCCESS, "Injected: engine")
    expect(MOTOR, T.OFF, 1, R.SUCCESS, "Injected: engine")
    expect(MOTOR, T.OK, 1, R.SUCCESS, "Cleared: engine")
    expect(SERVO, T.SLOW, 0, R.SUCCESS)
    expect(SERVO, T.OK, 0, R.SUCCESS)

    for unit, name in SENSORS.items():
        for kind in [T.OFF, T.STUCK, T.GARBAGE, T.WRONG, T.DELAYED, T.INTERMITTENT]:
            expect(unit, kind, 1, R.SUCCESS, f"Injected: {name}")
        expect(unit, T.SLOW, 1, R.DENIED, f"Fault refused: {name}")
        expect(unit, T.OK, 1, R.SUCCESS, f"Cleared: {name}")

    for unit in OTHER_UNITS:
        expect(unit, T.OFF, 1, R.UNSUPPORTED)
    texts.clear()
    result_of(failure, FailureUnit.SENSOR_OPTICAL_FLOW, T.OFF, 0)
    c.expect("the text says which unit has no failures", has_text("OPTICAL_FLOW"), texts)

    expect(SERVO, T.STUCK, 8, R.DENIED, "instance")
    expect(MOTOR, T.STUCK, 2, R.DENIED, "instance")

    # This MAVSDK has read 1, so it requests and is denied; the next one reads 0 and does not.
    param.set_param_int("SYS_FAILURE_EN", 0)
    expect(SERVO, T.STUCK, 5, R.DENIED, "SYS_FAILURE_EN 0")
    mavsdk.destroy()
    mavsdk, system = connected(c, args.connect)
    failure, param = Failure(system), Param(system)
    Telemetry(system).subscribe_status_text(lambda text, _=None: texts.append(text.text))
    time.sleep(1.0)
    expect(SERVO, T.STUCK, 5, R.DISABLED)
    param.set_param_int("SYS_FAILURE_EN", 1)
    mavsdk.destroy()
    mavsdk, system = connected(c, args.connect)
    failure = Failure(system)
    Telemetry(system).subscribe_status_text(lambda text, _=None: texts.append(text.text))
    time.sleep(1.0)
    expect(SERVO, T.STUCK, 5, R.SUCCESS, "Injected: rudder")
    expect(SERVO, T.OK, 5, R.SUCCESS, "Cleared: rudder")
    mavsdk.destroy()
    c.end()


if __name__ == "__main__":
    main()
