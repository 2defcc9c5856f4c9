#!/usr/bin/env python3
"""Flies the aircraft with pymavlink alone: a reference, a fault, its acknowledgement, and what the aircraft makes of it.

    cargo run --release -- --speed 4            # in one terminal
    pip install pymavlink
    python3 examples/drive_by_mavlink.py        # in another one
"""

import argparse
import math
import sys
import time

from pymavlink import mavutil

arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
arguments.add_argument("--connect", default="udpin:127.0.0.1:14550")
link = mavutil.mavlink_connection(arguments.parse_args().connect)
if link.wait_heartbeat(timeout=30) is None:
    sys.exit("no aircraft within 30 s")


def receive(kind, accept=lambda message: True, seconds=60.0):
    """The next message of a kind that fits."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        message = link.recv_match(type=kind, blocking=True, timeout=1.0)
        if message and accept(message):
            return message
    sys.exit(f"no {kind} within {seconds:g} s")


def command(name, *parameters):
    """Sends a command and waits for its final acknowledgement."""
    number = getattr(mavutil.mavlink, name)
    values = (list(parameters) + [math.nan] * 7)[:7]
    link.mav.command_long_send(link.target_system, link.target_component, number, 0, *values)
    progress = mavutil.mavlink.MAV_RESULT_IN_PROGRESS
    result = receive("COMMAND_ACK", lambda ack: ack.command == number and ack.result != progress).result
    print(f"{name}: {mavutil.mavlink.enums['MAV_RESULT'][result].name}")
    return result


# Ten times a second: estimates and state of the compensator by name (docs/mavlink.md).
command("MAV_CMD_SET_MESSAGE_INTERVAL", mavutil.mavlink.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT, 100_000)
altitude_m = receive("GLOBAL_POSITION_INT").alt * 1e-3
command("MAV_CMD_DO_CHANGE_ALTITUDE", altitude_m + 100.0, 0)
receive("GLOBAL_POSITION_INT", lambda position: position.alt * 1e-3 > altitude_m + 90.0)
print("100 m higher")

# The left elevator jams at +20 degrees, at once: unit "control surface", type "stuck", instance 3 (docs/commands.md).
jam = command("MAV_CMD_USER_1", 102, 2, 3, 1, 20, 0, 0)
receive("NAMED_VALUE_FLOAT", lambda value: value.name == "ftc_active" and value.value > 0.5)
print("the compensator is active")
command("MAV_CMD_USER_1", 102, 0, 3, 0, 0, 0, 0)
sys.exit(0 if jam == mavutil.mavlink.MAV_RESULT_ACCEPTED else 1)
