#!/usr/bin/env python3
"""Jam the left elevator, or another servo, of the aircraft that flies now, or mend it.

Exit status: 0 the aircraft has done so, 1 it refused, 2 there is no aircraft or no answer.
"""

import argparse
import os
import sys
import time

os.environ["MAVLINK20"] = "1"

try:
    from pymavlink import mavutil  # noqa: E402  (MAVLINK20 must be set before)
except ImportError:
    print(f"this needs pymavlink: {sys.executable} -m pip install pymavlink", file=sys.stderr)
    sys.exit(2)

# MAV_CMD_USER_1: failure of a unit, with a value. SERVO, kinds of failure, instance, value in degrees.
USER_1 = 31010
SERVO, OK, STUCK, LEFT_ELEVATOR, ANGLE_DEG = 102, 0, 2, 3, 1
ACCEPTED = 0
ANSWER_S = 5.0
# The text with the reason follows the refusal.
REASON_S = 1.0


def whole(link, message):
    """The text of a message, with the messages that continue it."""
    text = message.text
    while message is not None and message.id and len(message.text) == 50:
        message = link.recv_match(type="STATUSTEXT", blocking=True, timeout=REASON_S)
        text += message.text if message is not None else ""
    return text.rstrip()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--connect", default="udpin:127.0.0.1:14540", help="pymavlink connection [%(default)s]")
    parser.add_argument("--angle", type=float, default=30.0, metavar="DEG", help="where it sticks [%(default)s]")
    parser.add_argument("--servo", type=int, default=LEFT_ELEVATOR, metavar="N", help="its MAVLink number [%(default)s]")
    parser.add_argument("--mend", action="store_true", help="mend it instead")
    args = parser.parse_args()
    try:
        link = mavutil.mavlink_connection(args.connect, source_system=254, source_component=190)
    except OSError as error:
        print(f"cannot open {args.connect}: {error}", file=sys.stderr)
        return 2
    if not args.connect.startswith("udpin"):
        # Whoever calls has to speak first.
        link.mav.heartbeat_send(mavutil.mavlink.MAV_TYPE_GCS, mavutil.mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)
    if link.wait_heartbeat(timeout=ANSWER_S) is None:
        print(f"no aircraft is heard at {args.connect}", file=sys.stderr)
        return 2
    kind, mode, angle = (OK, 0, 0.0) if args.mend else (STUCK, ANGLE_DEG, args.angle)
    link.mav.command_long_send(link.target_system, 1, USER_1, 0, SERVO, kind, args.servo, mode, angle, 0, 0)
    until = time.monotonic() + ANSWER_S
    while time.monotonic() < until:
        message = link.recv_match(type=["COMMAND_ACK", "STATUSTEXT"], blocking=True, timeout=0.5)
        if message is None:
            continue
        if message.get_type() == "STATUSTEXT":
            print(whole(link, message))
        elif message.command == USER_1 and message.target_system == 254:
            if message.result == ACCEPTED:
                print("done")
                return 0
            print(f"refused, result {message.result}")
            reason = link.recv_match(type="STATUSTEXT", blocking=True, timeout=REASON_S)
            if reason is not None:
                print(whole(link, reason))
            return 1
    print("no answer", file=sys.stderr)
    return 2


sys.exit(main())
