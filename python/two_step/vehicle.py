"""A vehicle in flight, for tests of ground stations and of programs that talk to an autopilot.

>>> with two_step.Vehicle(speed=10) as vehicle:
...     vehicle.fail("left elevator stuck at 30 deg")
...     vehicle.wait(lambda v: v["compensator_active"], timeout_s=5)

It needs pymavlink: ``pip install two-step[vehicle]``.
"""

import collections
import json
import math
import os
import re
import selectors
import shutil
import socket
import subprocess
import sysconfig
import tempfile
import threading
import time
import types
import weakref
from pathlib import Path

#: Wall time for an answer, s, on a machine that is busy with other things.
ANSWER_S = 60.0
#: Wall time for the end of a process, s; then it is killed.
END_S = 10.0
#: What the plant takes: control periods of one step; multiples of wall time.
STEPS_MAX, SPEED = 100_000, (0.01, 1000.0)
#: Options of `sitl` besides the arguments of :class:`Vehicle`: those of the autopilot, those of the plant.
AUTOPILOT = ("allocation", "gains", "log_rate", "mavlink_autopilot")
PLANT = ("earth", "gyro_noise_deg_s", "step_us", "turbulence_m_s", "until_s")
#: Messages of which `state` is made, with their numbers, and the wall time between two, us.
TELEMETRY = {"ATTITUDE": 30, "GLOBAL_POSITION_INT": 33, "ODOMETRY": 331}
INTERVAL_US = 20_000
SET_MESSAGE_INTERVAL = 511
#: SERIAL_CONTROL: device, flag, bytes of a message; what ends an answer.
SHELL, RESPOND, CHUNK, PROMPT = 10, 2, 70, "two-step> "


class VehicleError(RuntimeError):
    """The vehicle refused, or one of its processes has ended; the text has the reason."""


class Vehicle:
    """An autopilot and its aircraft: two processes at ports that the system chooses, until `close` or the end of this process.

    scenario: "nominal", "case1", ... or the path of a file. A flight ends at the scenario's duration, if it has one.
    airframe, model, law, compensator, ftc, seed: as the options of ``sitl``; script: path of a script.
    params: parameters of the autopilot by name; they are not saved.
    period_ms: control period, 1 to 4 ms. speed: 0.01 to 1000 times wall time, or "max".
    paused: simulation time stands still at 0 until `run` or `step`.
    log_dir: folder for the flight log; without it a folder that goes with this object.
    gcs: addresses "IP:PORT" of ground stations that listen by UDP.
    options: further ones of ``sitl`` with underscores: ``turbulence_m_s=1.5``, ``until_s=60``, ...

    Raises ValueError or TypeError with the option, its value and what is allowed.
    """

    def __init__(self, scenario="nominal", *, airframe=None, model=None, law=None, compensator=None, ftc=None, script=None,
                 params=None, seed=None, period_ms=2.0, speed=1.0, paused=False, log_dir=None, gcs=(), **options):
        unknown = sorted(set(options) - {*AUTOPILOT, *PLANT})
        if unknown:
            raise TypeError(f"Vehicle has no option {unknown[0]!r}; further ones are {', '.join(AUTOPILOT + PLANT)}")
        self._processes, self._ended = {}, {}
        if log_dir is None:
            log_dir = tempfile.mkdtemp(prefix="two-step-")
            weakref.finalize(self, _remove, log_dir, self._processes)
        if airframe is not None and model is None and not Path(airframe).suffix:
            # As the launcher: an aircraft of the program has its model there.
            model = airframe
        params = {**_fitted(scenario, options), **(params or {})}
        autopilot = dict(scenario=scenario, model=model, law=law, compensator=compensator, ftc=ftc, script=script,
                         param=[f"{name}={value}" for name, value in params.items()], plant_link="127.0.0.1:0",
                         gcs=[*gcs] or "none", gcs_udp_server="none", gcs_tcp="127.0.0.1:0", parameter_file="none",
                         signing_key="none", log_dir=log_dir, **{name: options[name] for name in AUTOPILOT if name in options})
        plant = dict(scenario=scenario, airframe=airframe, seed=seed, period_ms=period_ms, speed=speed, start_paused=True,
                     **{name: options[name] for name in PLANT if name in options})
        self._news = threading.Condition()
        self._shell_lock = threading.Lock()
        self._selector = selectors.DefaultSelector()
        self._errors = collections.defaultdict(lambda: collections.deque(maxlen=50))
        self._thread = self._socket = self._connection = self._listening = self._log = self._system = None
        self._state, self._texts, self._shell_text = {}, [], ""
        # Simulation time, us, of each part of `state`, and of the latest ODOMETRY.
        self._times, self._time_us = dict.fromkeys([*TELEMETRY, "status"], -1), 0
        self._period_us = round(float(period_ms) * 1000)
        self._paused, self._pace_us, self._pace_lines = True, 0, 0
        try:
            self._start(autopilot, plant)
            if not paused:
                self.run()
        except BaseException:
            self.close()
            raise

    def _start(self, autopilot, plant):
        try:
            from pymavlink.dialects.v20 import common
        except ImportError as error:
            raise ImportError("a vehicle needs pymavlink: pip install two-step[vehicle]") from error
        self._launch("autopilot", autopilot, self._take_status)
        self._until(lambda: self._listening, "the autopilot to listen")
        host, port = self._listening["ground_stations"]["tcp_server"].split(":")
        #: For pymavlink's ``mavutil.mavlink_connection``, and for MAVSDK; any number of stations.
        self.address, self.mavsdk_address = f"tcp:{host}:{port}", f"tcpout://{host}:{port}"
        # Before the plant, so that no text of the flight is missed.
        self._socket = socket.create_connection((host, int(port)), timeout=ANSWER_S)
        self._selector.register(self._socket, selectors.EVENT_READ, (None, self._take_mavlink))
        # It sends no heartbeats: the station under test is the one in control.
        self._mav = common.MAVLink(types.SimpleNamespace(write=self._socket.sendall), srcSystem=253, srcComponent=190)
        self._mav.robust_parsing = True
        self._launch("plant-sim", {**plant, "autopilot": self._listening["plant_link"]}, self._take_pace)
        self._thread = threading.Thread(target=self._follow, name="two-step vehicle", daemon=True)
        self._thread.start()
        self._until(lambda: self._system, "a heartbeat")
        for number in TELEMETRY.values():
            self._mav.command_long_send(self._system, 1, SET_MESSAGE_INTERVAL, 0, number, INTERVAL_US, 0, 0, 0, 0, 0)
        self._until(lambda: self._is_at(0) and (self._log or autopilot["log_dir"] == "none"), "the flight to begin")

    def _launch(self, name, options, take):
        """Starts a process whose standard output goes to `take` by lines. The end of its standard input ends it."""
        words = [name, "--status", "--with-parent", *_words(options)]
        # A session of its own: Ctrl-C is for the test, which then ends the vehicle in order.
        process = subprocess.Popen([_program(), *words], bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, start_new_session=True)
        self._processes[name] = process
        self._selector.register(process.stdout, selectors.EVENT_READ, (None, _by_line(take)))
        self._selector.register(process.stderr, selectors.EVENT_READ, (name, _by_line(self._errors[name].append)))

    def _follow(self):
        while self._selector.get_map():
            self._receive(None)

    def _receive(self, wait_s):
        for key, _ in self._selector.select(wait_s):
            try:
                data = os.read(key.fd, 65536)
            except BlockingIOError:
                continue
            except OSError:
                data = b""
            with self._news:
                name, take = key.data
                if data:
                    take(data)
                else:
                    self._selector.unregister(key.fileobj)
                    if name is not None:
                        self._ended[name] = self._processes[name].wait()
                self._news.notify_all()

    def _take_status(self, line):
        status = json.loads(line)
        kind = status.pop("kind")
        if kind == "listening":
            self._listening = status
        elif kind == "flight_log":
            self._log = Path(status["path"])
        elif kind == "flight":
            self._times["status"] = round(status.pop("t_s") * 1e6)
            # MAVLink has these more often.
            del status["altitude_m"], status["roll_deg"]
            self._state |= status

    def _take_pace(self, line):
        pace = json.loads(line)
        self._paused, self._pace_us, self._pace_lines = pace["paused"], round(pace["t_s"] * 1e6), self._pace_lines + 1

    def _take_mavlink(self, data):
        for message in self._mav.parse_buffer(data) or ():
            kind = message.get_type()
            if kind == "ATTITUDE":
                self._times[kind] = message.time_boot_ms * 1000
                self._state |= {"roll_deg": math.degrees(message.roll), "pitch_deg": math.degrees(message.pitch),
                                "heading_deg": math.degrees(message.yaw) % 360.0}
            elif kind == "GLOBAL_POSITION_INT":
                self._times[kind] = message.time_boot_ms * 1000
                self._state |= {"altitude_m": message.alt / 1e3, "climb_m_s": -message.vz / 1e2,
                                "latitude_deg": message.lat / 1e7, "longitude_deg": message.lon / 1e7}
            elif kind == "ODOMETRY":
                self._times[kind] = self._time_us = message.time_usec
                self._state["time_s"] = self.time_s
            elif kind == "HEARTBEAT" and message.get_srcComponent() == 1:
                self._system = message.get_srcSystem()
            elif kind == "SERIAL_CONTROL":
                self._shell_text += bytes(message.data[:message.count]).decode(errors="replace")
            elif kind == "STATUSTEXT" and message.chunk_seq == 0:
                self._texts.append(message.text)
            elif kind == "STATUSTEXT" and self._texts:
                self._texts[-1] += message.text

    def _until(self, condition, what):
        """Waits by wall time until the condition holds or a process has ended."""
        give_up = time.monotonic() + ANSWER_S
        while True:
            # Before the condition, which then sees the last of it.
            ended = self._why_ended()
            if condition():
                return
            if ended:
                raise ended
            if time.monotonic() > give_up:
                raise TimeoutError(f"waited {ANSWER_S:g} s for {what}")
            if self._thread is None:
                self._receive(0.2)
            else:
                with self._news:
                    self._news.wait(0.2)

    def _why_ended(self):
        """The exception for a process that has ended, or None."""
        for name, status in list(self._ended.items()):
            lines = [line.strip() for line in self._errors[name] if line.strip()]
            reasons = [line for line in lines if line.lower().startswith("error")]
            if self._times["status"] < 0 and reasons:
                return ValueError(re.sub(r"^(ERROR|error:) ", "", reasons[0]))
            if name == "plant-sim" and status == 0:
                return VehicleError(f"the flight is over: {self._summary()}")
            return VehicleError(f"{name} has ended with status {status}: {' | '.join(reasons or lines[-3:])}")
        return None

    @property
    def connection(self):
        """A connection of pymavlink that has seen a heartbeat, opened at the first use; the caller alone reads from it."""
        if self._connection is None:
            os.environ.setdefault("MAVLINK20", "1")
            from pymavlink import mavutil

            self._connection = mavutil.mavlink_connection(self.address)
            if self._connection.wait_heartbeat(timeout=ANSWER_S) is None:
                raise TimeoutError(f"no heartbeat within {ANSWER_S:g} s")
        return self._connection

    @property
    def time_s(self):
        """Simulation time, s."""
        return self._time_us / 1e6

    @property
    def state(self):
        """The latest telemetry; ``vehicle["roll_deg"]`` is one value of it.

        time_s, altitude_m, airspeed_m_s (true), climb_m_s, roll_deg, pitch_deg, heading_deg (0 to 360), latitude_deg,
        longitude_deg, mode ("Position", "Return", ...), plant ("flying", "on_ground", "terminated", "lost"),
        compensator_active, faults, references, ... While time stands still, all is of `time_s`.
        """
        with self._news:
            return dict(self._state)

    def __getitem__(self, name):
        return self.state[name]

    @property
    def messages(self):
        """The texts of the autopilot so far (STATUSTEXT)."""
        with self._news:
            return [text.rstrip() for text in self._texts]

    @property
    def log(self):
        """Path of the flight log (ULog), complete after `close`."""
        return self._log

    def pause(self):
        """Lets simulation time stand still."""
        self._order("pause", True)
        self._until(lambda: self._is_at(self._pace_us), "the time of the pause")

    def step(self, periods=1):
        """Flies this number of control periods, 1 to 100000, and stands still again. Time that runs is paused first."""
        if not 1 <= periods <= STEPS_MAX or periods != int(periods):
            raise ValueError(f"periods is {periods}; it must be a whole number from 1 to {STEPS_MAX}")
        if not self._paused:
            self.pause()
        target_us = self._time_us + int(periods) * self._period_us
        self._order(f"step {int(periods)}", True)
        if self._pace_us != target_us:
            raise VehicleError(f"the flight ended before {target_us / 1e6:g} s: {self._summary()}")
        self._until(lambda: self._is_at(target_us), "the step")

    def run(self, speed=None):
        """Lets simulation time run; speed: 0.01 to 1000 times wall time, "max", or as before."""
        if speed is not None:
            speed = SPEED[1] if speed == "max" else float(speed)
            if not SPEED[0] <= speed <= SPEED[1]:
                raise ValueError(f"speed is {speed:g}; it must be between {SPEED[0]:g} and {SPEED[1]:g}, or \"max\"")
            self._order(f"speed {speed!r}", None)
        self._order("run", False)

    def _order(self, line, paused):
        """Sends a line to the plant and waits until the plant has done it."""
        before = self._pace_lines
        try:
            self._processes["plant-sim"].stdin.write(f"{line}\n".encode())
        except (OSError, ValueError):
            raise self._why_ended() or VehicleError("the vehicle is closed") from None
        self._until(lambda: self._pace_lines > before and paused in (None, self._paused), f"the plant to {line}")

    def _is_at(self, time_us):
        """Whether all of `state` is of this time."""
        # Two messages have it in whole ms; control periods are no shorter.
        return {us // 1000 for us in self._times.values()} == {time_us // 1000}

    def shell(self, line):
        """Runs a line of the autopilot's shell, such as "mode return", and returns what it prints.

        Raises VehicleError with the autopilot's reason where it refuses.
        """
        data = f"{line}\n".encode()
        with self._shell_lock:
            self._shell_text = ""
            try:
                for start in range(0, len(data), CHUNK):
                    part = data[start:start + CHUNK]
                    self._mav.serial_control_send(SHELL, RESPOND, 0, 0, len(part), list(part.ljust(CHUNK, b"\0")))
            except OSError:
                raise self._why_ended() or VehicleError("the vehicle is closed") from None
            self._until(lambda: "\n" in self._shell_text and self._shell_text.endswith(PROMPT), f"the answer to {line!r}")
            answer = self._shell_text.removeprefix(PROMPT).partition("\n")[2].removesuffix(PROMPT).strip()
        if answer.startswith("ERROR: "):
            raise VehicleError(answer.removeprefix("ERROR: "))
        return answer

    def fail(self, fault, stuck_deg=None):
        """Breaks an effector, a sensor or a part, and returns the simulation time of the onset, s.

        fault: in the words of scripts, "left elevator stuck at 30 deg, for 10 s"; with `stuck_deg` only what sticks.

        Raises VehicleError with the reason of a refusal, and with what is expected where a word does not fit.
        """
        stuck = "" if stuck_deg is None else f" stuck at {float(stuck_deg):f} deg"
        answer = self.shell(f"fail {fault}{stuck}")
        onset = re.search(r": acts since ([\d.]+) s", answer)
        if onset is None:
            raise VehicleError(answer)
        return float(onset[1])

    def clear(self, target="all"):
        """Repairs a target, "left elevator", or everything, and cancels what is scheduled there. A healthy one stays so."""
        return self.shell(f"clear {target}")

    def wait(self, condition, timeout_s=60.0, what="the condition"):
        """Waits until `condition(vehicle)` is true, for at most `timeout_s` of simulation time, and returns its value.

        Raises TimeoutError, also where simulation time stands still for a minute, and VehicleError where the flight has ended.
        """
        begin_us = last_us = self._time_us
        moved = time.monotonic()
        while True:
            # Before the condition, which then sees the last state.
            # At a high speed the parts of the state are seconds apart.
            ended, now_us, oldest_us = self._why_ended(), self._time_us, min(self._times.values())
            if value := condition(self):
                return value
            if ended:
                raise ended
            if now_us != last_us:
                # A flight that begins anew begins at zero.
                begin_us -= max(0, last_us - now_us)
                last_us, moved = now_us, time.monotonic()
            if oldest_us > begin_us + timeout_s * 1e6:
                raise TimeoutError(f"{what}: not within {timeout_s:g} s; {self._summary()}")
            if time.monotonic() - moved > ANSWER_S:
                raise TimeoutError(f"{what}: simulation time stands still; {self._summary()}")
            with self._news:
                self._news.wait(0.2)

    def _summary(self):
        state, names = self.state, ("time_s", "altitude_m", "airspeed_m_s", "roll_deg", "pitch_deg", "mode", "plant")
        shown = (f"{value:.1f}" if isinstance(value, float) else str(value) for value in map(state.get, names))
        return f"{', '.join(map(' '.join, zip(names, shown)))}; last texts: {self.messages[-3:]}"

    def report(self):
        """Log, state, texts and what the processes wrote last, as lines for a person."""
        errors = (f"{name}: {line}" for name, lines in self._errors.items() for line in list(lines)[-5:])
        return "\n".join([f"flight log: {self.log}", self._summary(), *self.messages, *errors])

    def close(self):
        """Ends both processes; without error where they have ended."""
        _end(self._processes)
        if self._thread is not None:
            self._thread.join()
        for one in (self._connection, self._socket, self._selector):
            if one is not None:
                one.close()
        for process in self._processes.values():
            process.stdout.close()
            process.stderr.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def _end(processes):
    for process in processes.values():
        process.stdin.close()
    for process in processes.values():
        try:
            process.wait(END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _remove(folder, processes):
    """Where a vehicle was not closed, its autopilot writes there until it has ended."""
    _end(processes)
    shutil.rmtree(folder, ignore_errors=True)


def _program():
    """The program `sitl`: that of TWO_STEP_SITL, or the one of this environment."""
    installed = Path(sysconfig.get_path("scripts")) / "sitl"
    program = os.environ.get("TWO_STEP_SITL") or (installed if installed.exists() else shutil.which("sitl"))
    if program is None:
        raise FileNotFoundError(f"there is no program {installed}; TWO_STEP_SITL can name another one")
    return program


def _words(options):
    for name, value in options.items():
        option = f"--{name.replace('_', '-')}"
        if value is True:
            yield option
        elif value is not None and value is not False:
            yield from (f"{option}={one}" for one in (value if isinstance(value, list) else [value]))


def _fitted(scenario, options):
    """Parameters that fit the sensors of a scenario file, as the launcher sets them."""
    if "gains" in options or not Path(scenario).is_file():
        return {}
    from two_step import _native

    sensors = json.loads(_native.read_toml(scenario)).get("plant", {}).get("sensors", {})
    return {"EST_PRESET": 1} if sensors.get("grade") == "consumer" else {}


def _by_line(take):
    rest = b""

    def receive(data):
        nonlocal rest
        *lines, rest = (rest + data).split(b"\n")
        for line in lines:
            take(line.decode(errors="replace"))

    return receive
