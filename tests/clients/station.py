"""A ground station made of stock pymavlink: it sends, and keeps all received messages."""

import os
import struct
import time

os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil  # noqa: E402  (MAVLINK20 must be set before)

GCS, AUTOPILOT_INVALID = 6, 8
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS = 0, 1, 2, 3, 4, 5
UNSUPPORTED_FRAME = 9
NAN = float("nan")


class Station:
    """One link to one aircraft."""

    def __init__(self, connect, system=255, component=190, dialect="common"):
        self.link = mavutil.mavlink_connection(
            connect, source_system=system, source_component=component, dialect=dialect
        )
        self.mav = self.link.mav
        self.ids = (system, component)
        self.messages = []
        self.latest = {}
        self.bad = 0
        self._next_heartbeat = 0.0
        self.heartbeats = True

    def pump(self, wait_s=0.02):
        """Receives everything available and sends a heartbeat when one is due."""
        now = time.monotonic()
        if self.heartbeats and now >= self._next_heartbeat and self._can_send():
            self.mav.heartbeat_send(GCS, AUTOPILOT_INVALID, 0, 0, 0)
            self._next_heartbeat = now + 1.0
        message = self.link.recv_match(blocking=True, timeout=wait_s)
        while message is not None:
            self._take(message)
            message = self.link.recv_match(blocking=False)

    def _can_send(self):
        return not hasattr(self.link, "last_address") or self.link.last_address is not None

    def _take(self, message):
        message = known(message)
        kind = message.get_type()
        if kind == "BAD_DATA":
            self.bad += 1
            return
        if message.get_srcSystem() != 1 and not kind.startswith("UNKNOWN"):
            return
        message.arrived = time.monotonic()
        self.messages.append(message)
        self.latest[kind] = message

    def run(self, seconds):
        """Receives for a while."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.pump()

    def wait(self, condition, timeout_s):
        """Receives until `condition()` is true; returns whether it became true in time."""
        give_up = time.monotonic() + timeout_s
        while not condition():
            if time.monotonic() > give_up:
                return False
            self.pump()
        return True

    def wait_for(self, kind, timeout_s=3.0, where=lambda message: True):
        """The next matching message of this kind, or None."""
        mark = len(self.messages)
        found = []

        def arrived():
            for message in self.messages[mark:]:
                if message.get_type() == kind and where(message):
                    found.append(message)
                    return True
            return False

        return found[0] if self.wait(arrived, timeout_s) else None

    def of(self, kind, since=0):
        """All messages of this kind since an index of `messages`."""
        return [m for m in self.messages[since:] if m.get_type() == kind]

    def texts(self, since=0):
        """STATUSTEXTs, long ones put together."""
        texts, parts = [], {}
        for message in self.of("STATUSTEXT", since):
            if message.id == 0:
                texts.append(message.text)
            else:
                parts[message.id] = parts.get(message.id, "") + message.text
        return [text.rstrip() for text in texts + list(parts.values())]

    def command(self, command, p=(), frame=None, xy=None, z=None, timeout_s=6.0):
        """Sends one COMMAND_LONG (or COMMAND_INT with a frame) and returns the final result.

        None without an answer. Also remembers how many final answers came.
        """
        mark = len(self.messages)
        params = list(p) + [NAN] * (7 - len(p))
        if frame is None:
            self.mav.command_long_send(1, 1, command, 0, *params)
        else:
            x, y = xy if xy is not None else (0, 0)
            z = params[6] if z is None else z
            self.mav.command_int_send(1, 1, frame, command, 0, 0, *params[:4], x, y, z)

        def finals():
            return [
                m
                for m in self.of("COMMAND_ACK", mark)
                if m.command == command and m.result != IN_PROGRESS
            ]

        if not self.wait(finals, timeout_s):
            return None
        self.run(0.05)
        answers = finals()
        return answers[0].result if len(answers) == 1 else f"{len(answers)} answers"

    def parameters(self, timeout_s=10.0):
        """All parameters by name, by PARAM_REQUEST_LIST."""
        values, mark = {}, len(self.messages)
        self.mav.param_request_list_send(1, 1)

        def complete():
            for m in self.of("PARAM_VALUE", mark):
                if m.param_index != 65535:
                    values[m.param_index] = m
            return values and len(values) == next(iter(values.values())).param_count

        self.wait(complete, timeout_s)
        return {m.param_id: number(m) for m in values.values()}

    def set_parameter(self, name, value, integer=False, timeout_s=3.0):
        """Writes one parameter and returns the value that came back (None without an answer)."""
        mark = len(self.messages)
        kind = 6 if integer else 9
        wire = struct.unpack("<f", struct.pack("<i", int(value)))[0] if integer else value
        self.mav.param_set_send(1, 1, name.encode(), wire, kind)
        answers = lambda: [m for m in self.of("PARAM_VALUE", mark) if m.param_id == name]
        return number(answers()[0]) if self.wait(answers, timeout_s) else None

    def mode(self):
        """PX4 main and sub mode of the latest heartbeat."""
        custom = self.latest["HEARTBEAT"].custom_mode
        return (custom >> 16 & 0xFF, custom >> 24 & 0xFF)

    def connect(self, timeout_s=20.0):
        """Waits until the aircraft is seen flying."""
        return self.wait(
            lambda: "HEARTBEAT" in self.latest
            and "GLOBAL_POSITION_INT" in self.latest
            and "HOME_POSITION" in self.latest,
            timeout_s,
        )


class ByHand:
    """A message without a definition in this pymavlink, with the fields that the tests use."""

    def __init__(self, message, kind, fields):
        self._message, self._kind = message, kind
        self._system, self._sequence = message.get_msgbuf()[5], message.get_msgbuf()[4]
        self.__dict__.update(fields)

    def get_type(self):
        return self._kind

    def get_srcSystem(self):
        return self._system

    def get_seq(self):
        return self._sequence

    def __getattr__(self, name):
        return getattr(self._message, name)


def known(message):
    """Decodes PROTOCOL_VERSION and COMPONENT_METADATA, and returns all other messages unchanged."""
    if not message.get_type().startswith("UNKNOWN_"):
        return message
    frame = bytes(message.get_msgbuf())
    payload, msg_id = frame[10:-2].ljust(200, b"\0"), int.from_bytes(frame[7:10], "little")
    if msg_id == 300:
        version, low, high = struct.unpack("<HHH", payload[:6])
        return ByHand(message, "PROTOCOL_VERSION", {"version": version, "min_version": low, "max_version": high})
    if msg_id == 397:
        boot, crc = struct.unpack("<II", payload[:8])
        uri = payload[8:108].split(b"\0")[0].decode()
        return ByHand(message, "COMPONENT_METADATA", {"time_boot_ms": boot, "file_crc": crc, "uri": uri})
    return message


def number(value):
    """A PARAM_VALUE's number: integers are encoded byte-wise, as by PX4."""
    if value.param_type == 6:
        return struct.unpack("<i", struct.pack("<f", value.param_value))[0]
    return value.param_value
