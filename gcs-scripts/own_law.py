#!/usr/bin/env python3
"""A flight law in Python, standard library only: the autopilot's side of the plant link.

    python3 gcs-scripts/own_law.py --altitude 5200 &
    cargo run -- plant-sim --scenario case1 --speed max

The plant sends the samples of its sensors and waits; the answer is one command for each effector. Change `law`.
Packets: icd/src/wire.rs; who waits for whom: icd/src/lockstep.rs; more in docs/own-law.md.
"""

import argparse
import math
import socket
import struct
import sys
import time
import zlib

HEADER = struct.Struct("<4sHBBQQQ")  # magic, version, kind, phase, session, sequence, time in us
SAMPLE = struct.Struct("<BBBQ")  # number of a sensor, count of its values, valid, time in us; its values follow
MAGIC, VERSION, SENSORS, ACTUATORS, REFUSAL = b"2STP", 10, 1, 2, 3
SILENCE_S = 10.0  # How long it waits for a plant that has begun.
COMMANDS = 8  # What `law` gives.
SIGNALS = {  # The sensors by their numbers, each with the names of its values here.
    0: ("gyro", "p q r"), 1: ("accelerometer", "fx fy fz"), 2: ("attitude", "qw qx qy qz"),
    3: ("gnss", "vn ve vd pn pe pd latitude longitude gnss_altitude year"),
    4: ("barometer", "static_pressure altitude"), 5: ("pitot", "impact_pressure airspeed"),
    6: ("vanes", "alpha beta"), 7: ("engine_monitor", "thrust"), 8: ("magnetometer", "mx my mz"),
    9: ("radar_altimeter", "height"), 10: ("weight_on_wheels", "load"), 11: ("fuel_gauge", "fuel"),
}
NEEDED = "p q r qw qx qy qz vd altitude airspeed".split()  # What `law` reads.


def law(s, demand, memory, h):
    """The latest values `s` by name (SI, rad) to left and right aileron, left and right elevator, rudder, nozzle pitch and
    yaw (rad) and thrust (N). Positive aileron rolls left, positive elevator lowers the nose."""
    roll = math.atan2(2 * (s["qw"] * s["qx"] + s["qy"] * s["qz"]), 1 - 2 * (s["qx"] ** 2 + s["qy"] ** 2))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (s["qw"] * s["qy"] - s["qz"] * s["qx"]))))
    climb = max(-40.0, min(40.0, 0.2 * (demand.altitude - s["altitude"]))) + s["vd"]
    speed = demand.airspeed - s["airspeed"]
    memory["elevator"] = max(-0.1, min(0.1, memory["elevator"] - 0.0002 * climb * h))
    memory["thrust"] = max(-4.0, min(4.0, memory["thrust"] + 0.02 * speed * h))
    aileron = 1.5 * (roll - math.radians(demand.roll)) + 0.5 * s["p"]
    elevator = 0.0003 - 0.003 * climb + 1.2 * s["q"] + 1.0 * (pitch - 0.0347) + memory["elevator"]
    thrust = 27_119.0 + 9_295.0 * (0.3 * speed + memory["thrust"])
    return -aileron, aileron, elevator, elevator, 0.2 * s["r"], 0.0, 0.0, thrust


def samples(data):
    """A packet of samples: the aircraft as in its bytes, the period, s, and the samples by name. An error says what is wrong."""
    name = HEADER.size + 1 + data[HEADER.size]
    end = name + 5  # Name of the aircraft, number and identity of its effectors.
    period_us, sensors = struct.unpack_from("<IB", data[:-4], end)
    # When each sensor took its values, us, and whether they are valid; with ideal sensors they are.
    s, place = {"time_us": {}, "valid": {}}, end + 5
    for _ in range(sensors):
        number, count, valid, time_us = SAMPLE.unpack_from(data[:-4], place)
        values = struct.unpack_from("<%dd" % count, data[:-4], place + SAMPLE.size)
        place += SAMPLE.size + 8 * count
        sensor, names = SIGNALS.get(number, (None, ""))
        if sensor is None:
            continue  # Of a later version.
        if len(names.split()) != count or not all(map(math.isfinite, values)):
            raise ValueError("%s: values that no sensor has" % sensor)
        s.update(zip(names.split(), values))
        s["time_us"][sensor], s["valid"][sensor] = time_us, valid
    missing = [name for name in NEEDED if name not in s]
    if missing:
        raise ValueError("this law needs %s, which no sensor of the aircraft measures" % ", ".join(missing))
    if abs(math.hypot(s["qw"], s["qx"], s["qy"], s["qz"]) - 1) > 1e-3:
        raise ValueError("an attitude that no aircraft has")
    if data[end - 5] != COMMANDS:
        raise ValueError("%d effectors; this law has %d" % (data[end - 5], COMMANDS))
    return data[HEADER.size:end], period_us * 1e-6, s


def packet(kind, detail, session, sequence, time_us, body):
    data = HEADER.pack(MAGIC, VERSION, kind, detail, session, sequence, time_us) + body
    return data + struct.pack("<I", zlib.crc32(data))


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--listen", default="127.0.0.1:9960", help="where the plant asks [127.0.0.1:9960]")
    options.add_argument("--altitude", type=float, default=5000.0, help="m")
    options.add_argument("--roll", type=float, default=0.0, help="deg")
    options.add_argument("--airspeed", type=float, default=264.0, help="m/s")
    options.add_argument("--for-s", type=float, default=math.inf, help="simulation time after which it ends")
    options.add_argument("--wait-s", type=float, default=30.0, help="how long it waits for a plant to begin")
    demand = options.parse_args()
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        host, port = demand.listen.rsplit(":", 1)
        link.bind((host, int(port)))
    except (ValueError, OverflowError, OSError) as problem:
        options.error("--listen %s: expected IP:PORT, a free one: %s" % (demand.listen, problem))
    print("listening on %s:%d" % link.getsockname(), flush=True)
    flight, answer, memory, s, said = None, b"", {}, {}, ""
    link.settimeout(1.0)
    deadline = time.monotonic() + demand.wait_s
    while time.monotonic() < deadline:
        try:
            data, plant = link.recvfrom(2048)
        except socket.timeout:
            continue
        if len(data) < 36 or data[:4] != MAGIC:
            continue
        _, version, kind, phase, session, sequence, time_us = HEADER.unpack_from(data)
        if version != VERSION and kind != REFUSAL:
            link.sendto(packet(REFUSAL, 1, session, sequence, 0, struct.pack("<H", VERSION)), plant)
            continue
        if kind != SENSORS or zlib.crc32(data[:-4]) != struct.unpack("<I", data[-4:])[0]:
            continue
        if flight == (session, sequence):
            link.sendto(answer, plant)  # The answer was lost: the same bytes again.
            deadline = time.monotonic() + SILENCE_S
            continue
        try:
            aircraft, period_s, s = samples(data)
        except (struct.error, IndexError, ValueError) as problem:
            text = "ignored: %d bytes from %s:%d: %s" % (len(data), *plant, problem)
            if text != said:  # A plant repeats its packet.
                print(text, file=sys.stderr)
            said = text
            continue
        if flight is None or flight[0] != session:
            memory = {"elevator": 0.0, "thrust": 0.0}
        flight = (session, sequence)
        if phase == 0 or "commands" not in memory:  # Otherwise time stands still: the same commands.
            memory["commands"] = law(s, demand, memory, period_s)
        commands = struct.pack("<%dd" % COMMANDS, *memory["commands"])
        brakes = struct.pack("<d", 0.0)  # 0 to 1.
        body = aircraft + commands + brakes + b"\0\0"  # No request to the plant, no flight log.
        answer = packet(ACTUATORS, 0, session, sequence, time_us, body)
        link.sendto(answer, plant)
        deadline = time.monotonic() + SILENCE_S
        if phase == 2 or time_us * 1e-6 >= demand.for_s:
            break
    if flight is None:
        sys.exit("no plant has spoken to %s:%d for %g s; start one, for example: cargo run -- plant-sim --autopilot %s:%d"
                 % (*link.getsockname(), demand.wait_s, *link.getsockname()))
    print("%.1f s: altitude %.1f m, airspeed %.1f m/s" % (time_us * 1e-6, s["altitude"], s["airspeed"]))


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
