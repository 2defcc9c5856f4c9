#!/usr/bin/env python3
"""Case 2 of the paper by MAVLink: a turn with 15 deg of roll, and the rudder jams at +7 deg.

The roll reference is a stream of SET_ATTITUDE_TARGET at 20 Hz in OFFBOARD.
Exit status: 0 survived, 1 lost, 2 anything else (no aircraft, a wrong acknowledgement).
"""

import flight

ROLL_DEG = 15.0
ANGLE_DEG = 7.0
FAULT_AFTER_S = 1.0


def line(aircraft):
    seen = "yes" if aircraft.values.get("ftc_active", 0.0) > 0.5 else "no"
    return (
        f"altitude {aircraft.altitude_m:7.1f} m  roll {aircraft.deg['roll']:6.1f} deg  "
        f"sideslip {aircraft.deg['beta']:5.1f} deg  fault seen: {seen}"
    )


def fly():
    args = flight.arguments(__doc__, watch_s=39.0)
    aircraft = flight.Flight(args.connect, args.timeout)
    aircraft.start(args.restart)

    aircraft.roll_setpoint_deg = ROLL_DEG
    aircraft.wait_wall(0.2)
    aircraft.set_mode("Offboard", flight.OFFBOARD)
    onset = aircraft.break_surface("rudder", flight.RUDDER, ANGLE_DEG, lead_s=FAULT_AFTER_S)
    aircraft.watch(onset, 1.0, line)
    aircraft.watch(onset + 5.0, 1.0, line)

    rolls = []

    def line_and_roll(aircraft):
        rolls.append(aircraft.deg["roll"])
        return line(aircraft)

    if aircraft.lost is None:
        aircraft.watch(onset + args.watch - 10.0, 5.0, line)
    if aircraft.lost is None:
        aircraft.watch(onset + args.watch, 1.0, line_and_roll)
    if aircraft.lost is None and aircraft.mode != flight.OFFBOARD:
        raise flight.Failed("the aircraft left Offboard although setpoints came")

    aircraft.roll_setpoint_deg = None
    aircraft.set_mode("Hold", flight.HOLD)
    aircraft.check_text("Injected: rudder stuck at 7.0 deg")
    aircraft.check_acknowledgements()
    if rolls:
        print(
            f"last 10 s: roll {sum(rolls) / len(rolls):.1f} deg in the mean, "
            f"{min(rolls):.1f} to {max(rolls):.1f} deg (reference {ROLL_DEG:g} deg; the paper: around 10)"
        )
    return aircraft.lost


flight.run(fly)
