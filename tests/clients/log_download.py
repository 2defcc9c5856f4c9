"""Flight logs fetched with stock MAVSDK and pymavlink, compared byte by byte; the log of all traffic read back."""

import argparse
import os
import random
import time

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.log_files import LogFiles, LogFilesResult

from checks import Checks
from pymavlink import mavutil
from station import Station

# Older than any log of the flight itself: the first numbers.
SMALL, FULL, LARGE = (f"2025010{n}-120000-000000{n:02x}.ulg" for n in (1, 2, 3))
ALL = 0xFFFFFFFF


def write_logs(folder, large):
    """Logs whose bytes show where they belong; one ends with a full message."""
    source = random.Random(1)
    for name, size in [(SMALL, 12_345), (FULL, 90 * 1000), (LARGE, large)]:
        with open(os.path.join(folder, name), "wb") as file:
            file.write(source.randbytes(size))


def content(folder, name):
    with open(os.path.join(folder, name), "rb") as file:
        return file.read()


def with_mavsdk(c, connect, folder):
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    mavsdk.add_any_connection(connect)
    system = mavsdk.first_autopilot(20.0)
    logs = LogFiles(system)
    entries = logs.get_entries()
    sizes = [os.path.getsize(os.path.join(folder, name)) for name in (SMALL, FULL, LARGE)]
    c.expect("MAVSDK: entries with their sizes", [e.size_bytes for e in entries[:3]] == sizes,
             [(e.id, e.size_bytes) for e in entries])
    c.expect("MAVSDK: and their dates", entries[0].date == "2025-01-01T12:00:00Z", entries[0].date)
    for entry, name in zip(entries, (SMALL, FULL, LARGE)):
        got = os.path.join(folder, f"mavsdk-{name}")
        results = []
        began = time.monotonic()
        logs.download_log_file_async(entry, got, lambda result, progress, _: results.append(result))
        end = began + 180.0
        while time.monotonic() < end and not (results and results[-1] != LogFilesResult.NEXT):
            time.sleep(0.01)
        took = time.monotonic() - began
        same = results[-1:] == [LogFilesResult.SUCCESS] and open(got, "rb").read() == content(folder, name)
        c.expect(f"MAVSDK: {entry.size_bytes} bytes are those of the file", same,
                 f"{took:.1f} s, {entry.size_bytes / took / 1e3:.0f} kB/s")
    mavsdk.destroy()


def entries(s):
    mark = len(s.messages)
    s.mav.log_request_list_send(1, 1, 0, 0xFFFF)
    complete = lambda: (found := s.of("LOG_ENTRY", mark)) and len(found) >= found[0].num_logs
    s.wait(complete, 5.0)
    return s.of("LOG_ENTRY", mark)


def fetch(s, number, size, timeout_s=180.0):
    """A whole log in one request, with lost parts requested again; its bytes and the number of requests."""
    data, requests, have = bytearray(size), 1, set()
    s.mav.log_request_data_send(1, 1, number, 0, ALL)
    end, quiet = time.monotonic() + timeout_s, time.monotonic()
    wanted = {offset for offset in range(0, size, 90)}
    while have != wanted and time.monotonic() < end:
        before = len(have)
        s.pump()
        for m in s.of("LOG_DATA"):
            if m.id == number and m.count:
                data[m.ofs:m.ofs + m.count] = bytes(m.data[:m.count])
                have.add(m.ofs)
        s.messages.clear()
        if len(have) > before:
            quiet = time.monotonic()
        elif time.monotonic() - quiet > 0.5:
            for offset in sorted(wanted - have)[:20]:
                s.mav.log_request_data_send(1, 1, number, offset, 90)
            requests, quiet = requests + 1, time.monotonic()
    s.mav.log_request_end_send(1, 1)
    return bytes(data) if have == wanted else b"", requests


def with_pymavlink(c, connect, folder):
    s = Station(connect)
    c.expect("pymavlink: connects", s.connect())
    listed = entries(s)
    c.expect("pymavlink: numbers count from 0", [e.id for e in listed] == list(range(len(listed))))
    c.expect("pymavlink: time of the first", listed[0].time_utc == 1735732800, listed[0].time_utc)
    whole = content(folder, SMALL)
    for offset, count in [(0, 90), (90, 900), (12_300, 90)]:
        mark = len(s.messages)
        s.mav.log_request_data_send(1, 1, 0, offset, count)
        s.run(0.3)
        got = b"".join(bytes(m.data[:m.count]) for m in s.of("LOG_DATA", mark))
        c.expect(f"pymavlink: {count} bytes from {offset}", got == whole[offset:offset + count], len(got))
    for number, name in enumerate((FULL, LARGE), start=1):
        size = os.path.getsize(os.path.join(folder, name))
        began = time.monotonic()
        data, requests = fetch(s, number, size)
        took = time.monotonic() - began
        c.expect(f"pymavlink: {size} bytes are those of the file", data == content(folder, name),
                 f"{took:.1f} s, {size / took / 1e3:.0f} kB/s, {requests} requests")
    s.mav.log_request_data_send(1, 1, 2, 0, ALL)
    s.run(0.5)
    c.expect("pymavlink: a command is acknowledged during a download", s.command(520, [1.0]) == 0)
    s.mav.log_request_end_send(1, 1)
    s.run(0.5)
    mark = len(s.messages)
    s.run(0.5)
    c.expect("pymavlink: the end stops it", not s.of("LOG_DATA", mark))
    mark = len(s.messages)
    s.mav.log_request_data_send(1, 1, 999, 0, 90)
    s.run(0.5)
    c.expect("pymavlink: a log that is not there is reported", any("no such log" in t for t in s.texts(mark)))
    return s


def erase(c, s, folder):
    mark = len(s.messages)
    s.mav.log_erase_send(1, 1)
    c.expect("erase: reported", s.wait(lambda: any("erased" in t for t in s.texts(mark)), 5.0), s.texts(mark))
    left = sorted(os.listdir(folder))
    c.expect("erase: the logs are gone", not {SMALL, FULL, LARGE} & set(left), left)
    c.expect("erase: what is no log stays", f"mavsdk-{SMALL}" in left and any(n.endswith(".tlog") for n in left))
    listed = entries(s)
    c.expect("erase: the list is what is left",
             listed and listed[0].num_logs == sum(n.endswith(".ulg") and n[0].isdigit() for n in left))


def read_tlog(c, folder):
    """The program still runs."""
    time.sleep(1.5)
    name = next(n for n in sorted(os.listdir(folder)) if n.endswith(".tlog"))
    log = mavutil.mavlink_connection(os.path.join(folder, name))
    kinds, times, stations = {}, [], set()
    gaps, last = 0, {}
    while (message := log.recv_match()) is not None:
        kinds[message.get_type()] = kinds.get(message.get_type(), 0) + 1
        times.append(message._timestamp)
        stations.add(message.get_srcSystem())
        # Of the frame itself, which may be of a message that this dialect does not have.
        frame = message.get_msgbuf()
        if frame[0] == 0xFD:
            sender, number = bytes(frame[5:7]), frame[4]
            gaps += last.get(sender, number) != number
            last[sender] = (number + 1) % 256
    c.expect("tlog: pymavlink reads it", len(times) > 1000 and "BAD_DATA" not in kinds,
             f"{len(times)} messages, {kinds.get('BAD_DATA', 0)} bad")
    c.expect("tlog: no sequence number is missing", gaps == 0, gaps)
    c.expect("tlog: both directions", {1, 255} <= stations, stations)
    expected = {"HEARTBEAT", "ATTITUDE", "LOG_REQUEST_LIST", "LOG_ENTRY", "LOG_REQUEST_DATA", "LOG_ERASE"}
    c.expect("tlog: questions and answers", expected <= set(kinds), expected - set(kinds))
    c.expect("tlog: without the bytes of the logs themselves", "LOG_DATA" not in kinds)
    c.expect("tlog: times go up and end now", times == sorted(times) and abs(times[-1] - time.time()) < 10.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--connect", default="udpin:127.0.0.1:14550")
    parser.add_argument("--log-dir", required=True, help="the log folder of the program, which may be filled")
    parser.add_argument("--megabytes", type=float, default=3.0, help="size of the largest log")
    args = parser.parse_args()
    c = Checks("Logs")
    write_logs(args.log_dir, int(args.megabytes * 1e6) + 1)
    with_mavsdk(c, args.connect.replace("udpin:", "udpin://"), args.log_dir)
    s = with_pymavlink(c, args.connect, args.log_dir)
    erase(c, s, args.log_dir)
    read_tlog(c, args.log_dir)
    c.end()


if __name__ == "__main__":
    main()
