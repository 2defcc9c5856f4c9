"""Receives from a flight with stock pymavlink and prints every message, its rate, and irregularities.

Odd are bytes that are no message, messages that the dialect does not know, gaps in the sequence numbers,
numbers that are not finite where the definitions do not say so, and times that run backwards.
"""

import argparse
import math
import time
from collections import Counter, defaultdict

from checks import Checks
from station import Station

# Fields for which the message definitions say NaN or "unknown".
MAY_BE_NAN = {"BATTERY_STATUS", "ESTIMATOR_STATUS", "WIND_COV", "HOME_POSITION", "ODOMETRY",
              "POSITION_TARGET_GLOBAL_INT", "ATTITUDE_TARGET", "GPS_RAW_INT", "HIGHRES_IMU", "ALTITUDE",
              "LOCAL_POSITION_NED_COV", "NAV_CONTROLLER_OUTPUT"}


def odd_numbers(message):
    """Names of the fields that hold no finite number."""
    odd = []
    for name in message.get_fieldnames():
        value = getattr(message, name)
        values = value if isinstance(value, (list, tuple)) else [value]
        if any(isinstance(v, float) and not math.isfinite(v) for v in values):
            odd.append(name)
    return odd


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--connect", default="udpin:127.0.0.1:14550")
    parser.add_argument("--seconds", type=float, default=20.0, help="wall time to listen")
    args = parser.parse_args()
    c = Checks(f"traffic of {args.seconds:g} s")
    s = Station(args.connect, dialect="all")
    if not c.expect("connects", s.connect()):
        c.end()
    s.messages.clear()
    began = time.monotonic()
    s.run(args.seconds)
    took = time.monotonic() - began
    counts = Counter(m.get_type() for m in s.messages)
    odd, boots, backwards, gaps, last = defaultdict(set), {}, [], 0, {}
    for m in s.messages:
        kind = m.get_type()
        if kind not in MAY_BE_NAN:
            for name in odd_numbers(m):
                odd[kind].add(name)
        boot = getattr(m, "time_boot_ms", None)
        if boot is not None:
            key = (kind, getattr(m, "name", ""))
            if boot < boots.get(key, 0):
                backwards.append(kind)
            boots[key] = boot
        # Each component counts for itself.
        seq, component = m.get_seq(), m.get_srcComponent()
        if component in last and seq != (last[component] + 1) % 256:
            gaps += 1
        last[component] = seq
    for kind, count in sorted(counts.items()):
        print(f"       {kind:32} {count / took:7.2f} Hz")
    for m in s.of("STATUSTEXT"):
        print(f"       text {m.severity}: {m.text}")
    c.expect("every byte is part of a message", s.bad == 0, s.bad)
    c.expect("every message is known", not [k for k in counts if k.startswith("UNKNOWN")])
    c.expect("no sequence number is missing", gaps == 0, gaps)
    c.expect("no number is odd", not odd, dict(odd))
    c.expect("no time runs backwards", not backwards, backwards)
    c.expect("a heartbeat a second", 0.9 <= counts["HEARTBEAT"] / took <= 1.2)
    c.end()


if __name__ == "__main__":
    main()
