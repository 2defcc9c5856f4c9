"""Plays QGroundControl's initial connect, from a table, with its timers and retries.

The steps and times are those of QGroundControl 5.0 (InitialConnectStateMachine, ParameterManager,
PlanManager, FTPManager). Every request must be answered, and none twice. Latencies are printed, since a
wall clock on a busy machine proves nothing.
"""

import argparse
import json
import struct
import time
import zlib
from pathlib import Path

from checks import Checks
from station import ACCEPTED, NAN, UNSUPPORTED, Station

ACK_TIMEOUT_S, TRIES, MESSAGE_TIMEOUT_S = 3.0, 3, 1.0
FTP_TIMEOUT_S, PARAM_TIMEOUT_S, PARAM_TRIES = 1.0, 5.0, 4
MISSION_TIMEOUT_S, MISSION_TRIES = 1.5, 6
REQUEST_MESSAGE = 512

# Step, message id, name of the message.
REQUESTS = [
    ("version and capabilities", 148, "AUTOPILOT_VERSION"),
    ("protocol version", 300, "PROTOCOL_VERSION"),
    ("available modes", 435, "AVAILABLE_MODES"),
    ("component metadata", 397, "COMPONENT_METADATA"),
]
CAPABILITIES = {
    "MISSION_INT": 4,
    "COMMAND_INT": 8,
    "PARAM_ENCODE_BYTEWISE": 16,
    "FTP": 32,
    "SET_ATTITUDE_TARGET": 64,
    "SET_POSITION_TARGET_GLOBAL_INT": 256,
    "MAVLINK2": 8192,
}
FENCE, RALLY = 16384, 32768

# Parameters of 5.0's setup pages, and the values with which no page requires a setup.
SETUP = {
    "SYS_AUTOSTART": lambda v: v != 0,
    "CAL_GYRO0_ID": lambda v: v != 0,
    "CAL_ACC0_ID": lambda v: v != 0,
    "SYS_HAS_MAG": lambda v: v == 0,
    "SYS_HAS_NUM_ASPD": lambda v: v == 0,
    "CBRK_AIRSPD_CHK": lambda v: v == 162128,
    "COM_RC_IN_MODE": lambda v: v == 1,
    "BAT1_N_CELLS": lambda v: v != 0,
    "BAT1_V_CHARGED": lambda v: v != 0,
    "BAT1_V_EMPTY": lambda v: v != 0,
    "MAV_SYS_ID": lambda v: v == 1,
    "FW_AIRSPD_MIN": lambda v: v > 0,
    "FW_AIRSPD_MAX": lambda v: v > 0,
}
# Parameters that each version requests, from its source text.
ASKED = Path(__file__).with_name("qgroundcontrol_parameters.csv")
PX4_TYPES = {"INT32": 6, "FLOAT": 9}


def asked_for():
    """Name, PX4's type and versions of every parameter that a version requests."""
    lines = [line for line in ASKED.read_text().splitlines() if not line.startswith("#")]
    return [line.split(",")[:3] for line in lines]


class Connect:
    """The state machine."""

    def __init__(self, station, checks):
        self.s, self.checks = station, checks
        self.ftp_sequence = 0

    def request_message(self, step, number, kind, p2=0.0):
        """REQUEST_MESSAGE with three tries; the message and its number of copies are checked."""
        mark = len(self.s.messages)
        for attempt in range(1, TRIES + 1):
            began = time.monotonic()
            self.s.mav.command_long_send(
                1, 1, REQUEST_MESSAGE, 0, float(number), p2, 0.0, 0.0, 0.0, 0.0, 0.0
            )
            acks = lambda: [
                m for m in self.s.of("COMMAND_ACK", mark) if m.command == REQUEST_MESSAGE
            ]
            if self.s.wait(acks, ACK_TIMEOUT_S):
                break
        else:
            self.checks.expect(f"{step}: answered", False)
            return None
        result = acks()[0].result
        latency_ms = 1e3 * (acks()[0].arrived - began)
        found = lambda: [
            m
            for m in self.s.of(kind, mark)
            if kind != "AVAILABLE_MODES" or m.mode_index == int(p2)
        ]
        if result == ACCEPTED:
            self.s.wait(found, MESSAGE_TIMEOUT_S)
        self.s.run(0.05)
        name = f"{step}{f' {int(p2)}' if p2 else ''}"
        self.checks.expect(
            f"{name}: one acknowledgement, first try",
            len(acks()) == 1 and attempt == 1,
            f"result {result}, {latency_ms:.1f} ms",
        )
        if result != ACCEPTED:
            return None
        self.checks.expect(f"{name}: {kind} once", len(found()) == 1, f"{len(found())}")
        return found()[0] if found() else None

    def modes(self):
        """AVAILABLE_MODES 1, 2, ... until the index is the number of modes."""
        modes, index = [], 1
        while True:
            mode = self.request_message("mode", 435, "AVAILABLE_MODES", float(index))
            if mode is None:
                break
            modes.append(mode)
            if index >= mode.number_modes:
                break
            index += 1
        names = {m.custom_mode: m.mode_name for m in modes}
        wanted = {196608: "Position", 50593792: "Hold", 67371008: "Mission", 84148224: "Return"}
        self.checks.expect("modes: Position, Hold, Mission and Return by their names",
                           wanted.items() <= names.items(), ", ".join(names.values()))

    def ftp(self, opcode, session=0, offset=0, size=None, data=b""):
        """One request of MAVLink FTP with retries; the answer's (opcode, data, payload fields)."""
        self.ftp_sequence += 1
        size = len(data) if size is None else size
        head = struct.pack("<HBBBBBBI", self.ftp_sequence & 0xFFFF, session, opcode, size, 0, 0, 0, offset)
        payload = (head + data).ljust(251, b"\0")
        mark = len(self.s.messages)
        self.ftp_mark = mark
        for _ in range(TRIES):
            self.s.mav.file_transfer_protocol_send(0, 1, 1, list(payload))
            answer = lambda: [
                a for a in map(unpack, self.s.of("FILE_TRANSFER_PROTOCOL", mark)) if a["req"] == opcode
            ]
            if self.s.wait(answer, FTP_TIMEOUT_S):
                return answer()[0]
        return None

    def download(self, path):
        """OpenFileRO, BurstReadFile, ReadFile for gaps, ResetSessions: as QGroundControl does."""
        opened = self.ftp(4, data=path.encode())
        if opened is None or opened["opcode"] != 128:
            return None
        length = struct.unpack("<I", opened["data"][:4])[0]
        content, offset = bytearray(length), 0
        self.ftp(15, session=opened["session"], offset=0, size=239)
        got = {}

        def collect():
            for answer in map(unpack, self.s.of("FILE_TRANSFER_PROTOCOL", self.ftp_mark)):
                if answer["req"] == 15 and answer["opcode"] == 128:
                    got[answer["offset"]] = answer["data"]
            return sum(map(len, got.values())) >= length

        self.s.wait(collect, 5.0)
        for at, data in got.items():
            content[at : at + len(data)] = data
        covered = sum(map(len, got.values()))
        while offset < length and covered < length:
            if offset not in got:
                part = self.ftp(5, session=opened["session"], offset=offset, size=239)
                if part is None or part["opcode"] != 128:
                    return None
                content[offset : offset + len(part["data"])] = part["data"]
            offset += 239
        closed = self.ftp(2)
        self.checks.expect(f"FTP {path}: {length} bytes, session closed", closed["opcode"] == 128)
        return bytes(content)

    def metadata(self, message):
        """general.json and everything that it names."""
        uri = message.uri
        content = self.download(uri.removeprefix("mftp://"))
        if not self.checks.expect("general metadata is there", content is not None, uri):
            return
        self.checks.expect(
            "its CRC is the announced one", zlib_crc(content) == message.file_crc, f"{message.file_crc:#x}"
        )
        general = json.loads(content)
        names = {1: "parameter", 4: "events", 5: "actuators"}
        for entry in general["metadataTypes"]:
            kind = names.get(entry["type"], entry["type"])
            data = self.download(entry["uri"].removeprefix("mftp://"))
            if not self.checks.expect(f"{kind} metadata is there", data is not None, entry["uri"]):
                continue
            self.checks.expect(f"{kind} metadata: CRC", zlib_crc(data) == entry["fileCrc"])
            parsed = json.loads(data)
            if entry["type"] == 1:
                self.described = {p["name"]: p for p in parsed["parameters"]}
        missing = self.ftp(4, data=b"@PARAM/param.pck?withdefaults=1")
        self.checks.expect(
            "an unknown file is refused", missing is not None and missing["opcode"] == 129
            and missing["data"][0] == 10,
        )

    def parameters(self):
        """PARAM_REQUEST_LIST to all components, gaps by PARAM_REQUEST_READ."""
        mark, values = len(self.s.messages), {}

        def complete():
            for m in self.s.of("PARAM_VALUE", mark):
                if m.param_index != 65535:
                    values.setdefault(m.param_index, m)
            return values and len(values) == next(iter(values.values())).param_count

        began = time.monotonic()
        for attempt in range(1, PARAM_TRIES + 1):
            self.s.mav.param_request_list_send(1, 0)
            if self.s.wait(complete, PARAM_TIMEOUT_S):
                break
        took_s = time.monotonic() - began
        copies = len(self.s.of("PARAM_VALUE", mark))
        self.checks.expect(
            "parameters: all, contiguous, each once, first try",
            complete() and attempt == 1 and copies == len(values)
            and sorted(values) == list(range(len(values))),
            f"{len(values)} in {took_s:.2f} s",
        )
        from station import number
        by_name = {m.param_id: number(m) for m in values.values()}
        for name, fits in SETUP.items():
            self.checks.expect(
                f"parameter {name} asks for no setup", name in by_name and fits(by_name[name]),
                by_name.get(name),
            )
        types = {m.param_id: m.param_type for m in values.values()}
        asked = asked_for()
        for version in sorted({v for _, _, versions in asked for v in versions.split()}):
            wrong = {name for name, kind, versions in asked
                     if version in versions.split() and types.get(name) != PX4_TYPES[kind]}
            self.checks.expect(f"version {version} misses no parameter and no type", not wrong,
                               ", ".join(sorted(wrong)))
        described = getattr(self, "described", {})
        lacking = [name for name in by_name if name not in described]
        self.checks.expect("every parameter is described", not lacking, ", ".join(lacking))
        self.checks.expect("no _HASH_CHECK, no SYS_HITL", not {"_HASH_CHECK", "SYS_HITL"} & set(by_name))

    def plan(self, kind, name):
        """MISSION_REQUEST_LIST, every item, MISSION_ACK."""
        mark = len(self.s.messages)
        counts = lambda: [m for m in self.s.of("MISSION_COUNT", mark) if m.mission_type == kind]
        for attempt in range(1, MISSION_TRIES + 1):
            self.s.mav.mission_request_list_send(1, 1, kind)
            if self.s.wait(counts, MISSION_TIMEOUT_S):
                break
        self.s.run(0.05)
        self.checks.expect(
            f"{name}: one count, first try", len(counts()) == 1 and attempt == 1,
            f"{counts()[0].count} items" if counts() else "none",
        )
        for seq in range(counts()[0].count if counts() else 0):
            self.s.mav.mission_request_int_send(1, 1, seq, kind)
            items = lambda: [m for m in self.s.of("MISSION_ITEM_INT", mark) if m.seq == seq]
            self.checks.expect(f"{name}: item {seq}", self.s.wait(items, MISSION_TIMEOUT_S))
        self.s.mav.mission_ack_send(1, 1, 0, kind)


def unpack(message):
    """The fields of an FTP payload."""
    raw = bytes(message.payload)
    seq, session, opcode, size, req, burst, _, offset = struct.unpack("<HBBBBBBI", raw[:12])
    return {"seq": seq, "session": session, "opcode": opcode, "req": req, "burst": burst,
            "offset": offset, "data": raw[12 : 12 + size]}


def zlib_crc(content):
    """CRC-32 as MAVLink FTP and QGroundControl compute it: polynomial 0x04C11DB7, no final inversion."""
    return zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--connect", default="udpin:127.0.0.1:14550")
    args = parser.parse_args()
    checks = Checks("QGroundControl's initial connect")
    station = Station(args.connect, dialect="all")
    if not checks.expect("a heartbeat", station.wait(lambda: "HEARTBEAT" in station.latest, 20.0)):
        checks.end()
    first = station.latest["HEARTBEAT"]
    checks.expect(
        "it is a PX4 plane, component 1, with custom modes",
        (first.type, first.autopilot, first.get_srcComponent(), first.base_mode & 1) == (1, 12, 1, 1),
    )
    connect = Connect(station, checks)
    began = time.monotonic()
    version = connect.request_message(*REQUESTS[0])
    capabilities = version.capabilities if version else 0
    for name, bit in CAPABILITIES.items():
        checks.expect(f"capability {name}", capabilities & bit != 0)
    checks.expect("flight version is at least 1.4.1, no release",
                  version is not None and version.flight_sw_version >> 8 >= 0x010401
                  and version.flight_sw_version & 0xFF == 0)
    protocol = connect.request_message(*REQUESTS[1])
    checks.expect("MAVLink 2", protocol is not None and protocol.max_version >= 200)
    connect.modes()
    metadata = connect.request_message(*REQUESTS[3])
    if checks.expect("component metadata", metadata is not None):
        connect.metadata(metadata)
    connect.parameters()
    connect.plan(0, "mission")
    if capabilities & FENCE:
        connect.plan(1, "fence")
    if capabilities & RALLY:
        connect.plan(2, "rally points")
    for _ in range(2):
        station.mav.system_time_send(int(time.time() * 1e6), 0)
    print(f"  initial connect complete after {time.monotonic() - began:.2f} s")

    station.run(3.0)
    heartbeats = station.of("HEARTBEAT")
    gaps = [b.arrived - a.arrived for a, b in zip(heartbeats, heartbeats[1:])]
    checks.expect("communication is never lost (3.5 s)", max(gaps) < 3.5, f"longest gap {max(gaps):.2f} s")
    status = station.latest.get("SYS_STATUS")
    prearm = 0x10000000
    checks.expect("Ready: the pre-arm check is enabled and healthy", status is not None
                  and status.onboard_control_sensors_enabled & prearm
                  and status.onboard_control_sensors_health & prearm)
    enabled = status.onboard_control_sensors_enabled
    checks.expect("all enabled sensors are healthy",
                  enabled & status.onboard_control_sensors_health == enabled)
    checks.expect("in the air, armed", station.latest["EXTENDED_SYS_STATE"].landed_state == 2
                  and station.latest["HEARTBEAT"].base_mode & 128)
    for kind in ["HOME_POSITION", "ALTITUDE", "ATTITUDE_QUATERNION", "VFR_HUD", "GPS_RAW_INT",
                 "BATTERY_STATUS", "NAV_CONTROLLER_OUTPUT", "CURRENT_MODE", "MISSION_CURRENT"]:
        checks.expect(f"{kind} is streamed", kind in station.latest)
    warnings = [m.text for m in station.of("STATUSTEXT") if m.severity <= 4]
    checks.expect("no warning during the connect", not warnings, "; ".join(warnings))
    unknown = [m for m in station.latest if m.startswith("UNKNOWN")]
    checks.expect("no unknown message, no bad data", not unknown and station.bad == 0, unknown)
    result = station.command(40000, [0.0] * 7)
    checks.expect("an unknown command is refused at once", result == UNSUPPORTED, result)
    result = station.command(43000, [NAN] * 7)
    checks.expect("a command of nothing but NaN is answered", result is not None, result)
    checks.end()


if __name__ == "__main__":
    main()
