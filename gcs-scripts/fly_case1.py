#!/usr/bin/env python3
"""Case 1 of the paper by MAVLink: climb from 5000 to 6000 m, and the left elevator jams at +30 deg.

Exit status: 0 survived, 1 lost, 2 anything else (no aircraft, a wrong acknowledgement).
"""

import flight

ALTITUDE_M = 6000.0
ANGLE_DEG = 30.0
FAULT_AFTER_S = 3.0


def line(aircraft):
    p, q, r = aircraft.rates_deg_s
    seen = "yes" if aircraft.values.get("ftc_active", 0.0) > 0.5 else "no"
    return (
        f"altitude {aircraft.altitude_m:7.1f} m  roll {aircraft.deg['roll']:6.1f} deg  "
        f"p {p:6.1f} q {q:6.1f} r {r:6.1f} deg/s  fault seen: {seen}"
    )


def fly():
    args = flight.arguments(__doc__, watch_s=60.0)
    aircraft = flight.Flight(args.connect, args.timeout)
    aircraft.start(args.restart)

    aircraft.demand(f"climb to {ALTITUDE_M:g} m", flight.DO_CHANGE_ALTITUDE, ALTITUDE_M, 0)
    onset = aircraft.break_surface(
        "left elevator", flight.LEFT_ELEVATOR, ANGLE_DEG, lead_s=FAULT_AFTER_S
    )
    aircraft.watch(onset, 1.0, line)
    aircraft.watch(onset + 5.0, 1.0, line)
    if aircraft.lost is None:
        aircraft.watch(onset + args.watch, 10.0, line)

    aircraft.check_text("Injected: left elevator stuck at 30.0 deg")
    aircraft.check_acknowledgements()
    z2 = [aircraft.values.get(name, float("nan")) for name in ("z2_p", "z2_q", "z2_r")]
    print(
        f"at the end: altitude {aircraft.altitude_m:.1f} m ({aircraft.altitude_m - ALTITUDE_M:+.1f} m), "
        f"roll {aircraft.deg['roll']:.1f} deg, estimated fault acceleration "
        f"roll {z2[0]:+.2f} pitch {z2[1]:+.2f} yaw {z2[2]:+.2f} rad/s^2"
    )
    return aircraft.lost


flight.run(fly)
