"""Scripts of faults: uploaded with stock MAVSDK and MAVProxy, started with stock pymavlink, MAVProxy and from the shell."""

import argparse
import os
import re
import tempfile

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.ftp import Ftp, FtpResult

from checks import Checks, wait_until
from mavproxy_session import Session
from shell_session import Console
from station import ACCEPTED, DENIED, TEMPORARILY_REJECTED, Station

USER_3 = 31012
LEFT_ELEVATOR, RUDDER = 3, 5

CHAIN = """# The left elevator jams for two seconds in a turn, and then the rudder loses half its effect
roll 15 deg
when roll passes 10 deg: fail left elevator stuck at 2 deg, for 2 s
after 2 s: fail rudder 50 % left
after 1 s: roll 0 deg
after 3 s: clear all
say The chain is over
"""
BAD = "say one\nfail elevator stuck\n"
LATE = "at 30 min: say late\n"
LINES = [line for line in CHAIN.splitlines() if not line.startswith(("#", "say"))]


def upload(c, connect, folder):
    """With MAVSDK; the files persist after its end."""
    library = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    library.add_any_connection(connect.replace("udpin:", "udpin://"))
    system = library.first_autopilot(20.0)
    if not c.expect("MAVSDK: connects", system is not None):
        return
    ftp = Ftp(system)
    for name, text in [("chain.txt", CHAIN), ("bad.txt", BAD), ("late.txt", LATE)]:
        path = os.path.join(folder, name)
        with open(path, "w", encoding="ascii") as file:
            file.write(text)
        results = []
        ftp.upload_async(path, "/scripts", lambda result, *_: results.append(result))
        over = wait_until(lambda: results and results[-1] != FtpResult.NEXT, 10.0)
        c.expect(f"MAVSDK: {name} is uploaded", over and results[-1] == FtpResult.SUCCESS, results[-1:])
        same = ftp.are_files_identical(path, f"/scripts/{name}")
        c.expect("MAVSDK: and what is there is what was sent", same, same)
    names = [entry.name for entry in ftp.list_directory("/scripts").entries]
    c.expect("MAVSDK: all are listed", names == ["bad.txt", "chain.txt", "late.txt"], names)
    ftp.destroy()
    library.destroy()


def faults(station, since):
    """Onset of each fault that was on the list, by instance, s of simulation time."""
    lists = [m for m in station.of("DEBUG_FLOAT_ARRAY", since) if m.array_id == 2 and m.data[0] > 0]
    return {int(m.data[4]): m.data[8] for m in lists}


def fly_chain(c, station, start, since, who):
    """The texts and the faults of the chain, once `start()` has begun it."""
    c.expect(f"{who}: the script begins", start())
    has_text = lambda part: any(part in text for text in station.texts(since))
    c.expect(f"{who}: it is reported", station.wait(lambda: has_text("Script began: "), 5.0))
    c.expect(f"{who}: and ends", station.wait(lambda: has_text("Script done: "), 60.0), station.texts(since)[-4:])
    for number, line in enumerate(LINES, 2):
        c.expect(f"{who}: line {number} is reported", has_text(f"Script {number}: {line}"))
    c.expect(f"{who}: its words", has_text("Script: The chain is over"))
    c.expect(f"{who}: nothing was refused", not has_text("refused"), [t for t in station.texts(since) if "refused" in t])
    onset = faults(station, since)
    c.expect(f"{who}: exactly these fail", sorted(onset) == [LEFT_ELEVATOR, RUDDER], onset)
    later = onset.get(RUDDER, 0.0) - onset.get(LEFT_ELEVATOR, 0.0)
    c.expect(f"{who}: the rudder 2 s after the elevator", abs(later - 2.0) < 1e-3, f"{later:.4f} s")
    for words in ["Cleared: left elevator stuck at 2.0 deg", "Cleared: rudder 50 % left"]:
        c.expect(f"{who}: {words!r} is reported", station.wait(lambda: words in station.texts(since), 3.0))
    for effector, form in [
        (LEFT_ELEVATOR, r"Injected: left elevator stuck at 2\.0 deg, from ([0-9.]+) s, for 2 s"),
        (RUDDER, r"Injected: rudder 50 % left, from ([0-9.]+) s"),
    ]:
        found = [m for m in (re.fullmatch(form, text) for text in station.texts(since)) if m]
        times = [float(m[1]) for m in found]
        # The list of faults has single precision.
        on_time = len(times) == 1 and abs(times[0] - onset.get(effector, -1.0)) < 1e-3
        c.expect(f"{who}: {form!r} once, with the time of its onset", on_time, times)
    banks = [m.roll for m in station.of("ATTITUDE", since)]
    c.expect(f"{who}: it was in the turn", max(banks) > 0.17, f"{max(banks):.2f} rad")


def by_command(c, station):
    mark = len(station.messages)
    # In the sorted list: bad.txt, chain.txt, late.txt.
    start = lambda: station.command(USER_3, (1, 2, 0, 0, 0, 0, 0)) == ACCEPTED
    fly_chain(c, station, start, mark, "pymavlink")
    mark = len(station.messages)
    c.expect("a bad script is denied", station.command(USER_3, (1, 1, 0, 0, 0, 0, 0)) == DENIED)
    reason = "Script refused: bad.txt, line 2, column 6"
    found = station.wait(lambda: any(text.startswith(reason) for text in station.texts(mark)), 3.0)
    c.expect("with line and reason", found, station.texts(mark))
    c.expect("so is a number that is not there", station.command(USER_3, (1, 9, 0, 0, 0, 0, 0)) == DENIED)
    mark = len(station.messages)
    c.expect("0 is the one that came last", station.command(USER_3, (1, 0, 0, 0, 0, 0, 0)) == ACCEPTED)
    c.expect("and is stopped", station.command(USER_3, (0, 0, 0, 0, 0, 0, 0)) == ACCEPTED)
    stopped = lambda: "Script stopped: late.txt" in station.texts(mark)
    c.expect("which is reported", station.wait(stopped, 3.0), station.texts(mark))
    c.expect("once", station.command(USER_3, (0, 0, 0, 0, 0, 0, 0)) == TEMPORARILY_REJECTED)


def by_shell(c, station):
    run = Console(station).run
    listed = run("script list") or ""
    c.expect("shell: the list", [line.split()[:2] for line in listed.splitlines()]
             == [["1", "bad.txt"], ["2", "chain.txt"], ["3", "late.txt"]], listed)
    refused = run("script run bad.txt") or ""
    c.expect("shell: a bad script is an error", refused.startswith("ERROR: Script refused: bad.txt, line 2, column 6"), refused)
    c.expect("shell: one that is not there too", "no such file" in (run("script run nope.txt") or ""))
    c.expect("shell: none runs", run("script stop") == "ERROR: no script runs\n")
    c.expect("shell: late.txt begins", run("script run 3") == "Script began: late.txt\n")
    status = run("script status") or ""
    c.expect("shell: its line", "line 1 is next: at 30 min: say late" in status, status)
    c.expect("shell: it is stopped", run("script stop") == "Script stopped\n")
    mark = len(station.messages)
    start = lambda: run("script run chain.txt") == "Script began: chain.txt\n"
    fly_chain(c, station, start, mark, "shell")
    c.expect("shell: no fault is left", run("list") == "No faults\n")


def by_mavproxy(c, connect, folder):
    path = os.path.join(folder, "proxy.txt")
    with open(path, "w", encoding="ascii") as file:
        file.write("say Hello from MAVProxy\nfail rudder 80 % left, for 1 s\nat 30 min: end\n")
    s = Session(connect, folder)
    c.expect("MAVProxy: connects", s.wait_for(r"Detected vehicle 1:1", 20.0))
    c.expect("MAVProxy: has the parameters", s.wait_for(r"Received \d+ parameters", 15.0))
    for line, answers in [
        (f"ftp put {path} /scripts/proxy.txt", ["Script proxy.txt: 3 lines, number 4"]),
        ("long 31012 1 0", ["Script began: proxy.txt", "Script: Hello from MAVProxy", "Injected: "]),
        ("long 31012 0 0", ["Script stopped: proxy.txt"]),
    ]:
        mark = len(s.output)
        s.send_line(line)
        for answer in answers:
            c.expect(f"MAVProxy: {line.split()[0]}: {answer}", s.wait_for(answer, 10.0, mark), s.output[mark:].strip()[-200:])
    s.send_line("exit")
    c.expect("MAVProxy: no error", "Traceback" not in s.output)
    s.process.kill()
    s.process.wait(5.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--connect", default="udpin:127.0.0.1:14550")
    connect = parser.parse_args().connect
    c = Checks("scripts")
    with tempfile.TemporaryDirectory() as folder:
        upload(c, connect, folder)
        station = Station(connect)
        c.expect("pymavlink: the aircraft is there", station.wait(lambda: "ATTITUDE" in station.latest, 10.0))
        by_command(c, station)
        by_shell(c, station)
        station.link.close()
        by_mavproxy(c, connect, folder)
    c.end()


if __name__ == "__main__":
    main()
