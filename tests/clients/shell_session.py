"""The shell over SERIAL_CONTROL with stock pymavlink, as QGroundControl sends it, and with stock MAVSDK."""

import argparse
import time

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.shell import Device, Shell

from checks import Checks, wait_until
from station import Station

SHELL = 10
REPLY, RESPOND, EXCLUSIVE, MULTI = 1, 2, 4, 16
PROMPT = "two-step> "
LINE_MAX = 240


class Console:
    """QGroundControl's console: 70 bytes each, padded with zeros."""

    def __init__(self, station):
        self.station = station

    def run(self, line, timeout_s=5.0):
        """Sends one line; returns the output between its echo and the prompt. The first prompt precedes the echo."""
        mark = len(self.station.messages)
        data = (line + "\n").encode()
        for start in range(0, len(data), 70):
            chunk = data[start:start + 70]
            self.station.mav.serial_control_send(
                SHELL, EXCLUSIVE | RESPOND | MULTI, 0, 0, len(chunk), list(chunk.ljust(70, b"\0")))
        is_answered = lambda text: "\n" in text and text.endswith(PROMPT)
        self.station.wait(lambda: is_answered(self.text(mark)), timeout_s)
        text = self.text(mark).removeprefix(PROMPT)
        if not is_answered(text):
            return None
        _, echo, answer = text.partition((line if len(line) <= LINE_MAX else "") + "\n")
        return answer.removesuffix(PROMPT) if echo else None

    def text(self, mark):
        """All output since message number `mark`."""
        parts = [m for m in self.station.messages[mark:] if m.get_type() == "SERIAL_CONTROL"]
        assert all(m.device == SHELL and m.flags == REPLY and m.count <= 70 for m in parts)
        return b"".join(bytes(m.data[:m.count]) for m in parts).decode()


def qgroundcontrol(c, connect):
    station = Station(connect)
    c.expect("pymavlink: the aircraft is there", station.wait(lambda: "ATTITUDE" in station.latest, 10.0))
    console = Console(station)
    run = console.run
    mark = len(station.messages)
    c.expect("an empty line is the prompt", run("") == "")
    c.expect("the page opens with a prompt", console.text(mark) == f"{PROMPT}\n{PROMPT}", console.text(mark))
    c.expect("help lists the commands", "failure" in (run("help") or ""))
    status = run("status") or ""
    c.expect("status shows the flight", "in the air" in status and "nozzle yaw" in status, status)
    everything = run("param show") or ""
    c.expect("a long list comes whole", len(everything.splitlines()) > 70, len(everything.splitlines()))
    before = (run("param get OBS_W0") or "? ?").split()[1]
    c.expect("a parameter is set", run("param set OBS_W0 41") == f"OBS_W0 {before} -> 41\n", before)
    c.expect("and every station gets the value", "OBS_W0" in [m.param_id for m in station.of("PARAM_VALUE")])
    c.expect("and set back", run(f"param set OBS_W0 {before}") == f"OBS_W0 41 -> {before}\n")
    c.expect("a reference is changed", run("reference altitude 5200") == "Reference altitude: 5200 m\n")
    c.expect("and one beyond the limits is not", "ERROR: altitude" in (run("reference altitude 99999") or ""))
    c.expect("the mode is changed", run("mode hold") == "Mode Hold\n")
    run("mode position")
    jam = run("failure servo stuck -i 5 -v 3deg") or ""
    c.expect("a servo sticks when the plant says so", jam.startswith("rudder: acts since"), jam)
    c.expect("it is on the list", "rudder" in (run("failure list") or ""))
    later = run("failure servo loss -m 3 -v 40% -t 100000s -d 5s -e 20s -n 3") or ""
    c.expect("two are scheduled", later.count("acts at") == 2, later)
    c.expect("a component that does not fail here", "there is no such sensor" in (run("failure optical_flow off") or ""))
    c.expect("a sensor that fails", (run("failure gps wrong -v 50m") or "").startswith("gnss: acts since"))
    torn = run("failure left_wing off -v 10%") or ""
    c.expect("a wing tip is torn off", torn.startswith("left wing: acts since"), torn)
    c.expect("everything is mended", "healthy since" in (run("failure clear") or ""))
    c.expect("and the list is empty", run("list") == "No faults\n")
    c.expect("time stands still", run("pause") == "Simulation paused\n")
    c.expect("one step", run("step 5") == "Simulation steps: 5\n")
    c.expect("time runs", run("run") == "Simulation runs\n")
    c.expect("nonsense is an error", (run("nonsense") or "").startswith("ERROR: "))
    c.expect("a line that is too long is an error", "at most" in (run("x" * 700) or ""))
    station.link.close()


def mavsdk(c, connect):
    library = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    library.add_any_connection(connect)
    system = library.first_autopilot(20.0)
    if not c.expect("MAVSDK: connects", system is not None):
        return
    shell = Shell(system)
    got = []
    shell.subscribe_receive(lambda received, _=None: got.append(received.data))
    # MAVSDK subscribes in its own thread, and requests no answer (flag RESPOND) before that is done.
    time.sleep(0.5)
    shell.send("param get FTC_MODE", Device.SHELL)
    shell.send("\n", Device.SHELL)
    # MAVSDK ends a line itself, so the line feed is an empty line behind it.
    came = wait_until(lambda: "".join(got).count(PROMPT) == 3, 5.0)
    answer = "".join(got).removeprefix(PROMPT).removeprefix("param get FTC_MODE\n")
    c.expect("MAVSDK: a line is echoed behind the prompt and answered",
             came and answer.startswith("FTC_MODE "), "".join(got))
    got.clear()
    shell.send("param show\n", Device.SHELL)
    came = wait_until(lambda: "".join(got).rstrip("\n").endswith(PROMPT), 5.0)
    lines = len("".join(got).splitlines())
    c.expect("MAVSDK: a long list comes whole", came and lines > 70, lines)
    library.destroy()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--connect", default="udpin:127.0.0.1:14550")
    connect = parser.parse_args().connect
    c = Checks("shell")
    qgroundcontrol(c, connect)
    mavsdk(c, connect.replace("udpin:", "udpin://"))
    c.end()


if __name__ == "__main__":
    main()
