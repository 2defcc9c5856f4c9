"""Signing with stock pymavlink and MAVProxy: set up, refused, replayed, kept over a restart, turned off.

Starts and ends the autopilot itself, since a key has to outlive it.
"""

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
import time

from checks import Checks, wait_until
from mavproxy_session import Session
from station import Station

EPOCH_UNIX_S = 1420070400
MINUTE = 60 * 100_000
KEY, OTHER_KEY, PASSPHRASE = hashlib.sha256(b"one").digest(), bytes([7] * 32), "two-step"
NO_KEY = [0] * 32


def now():
    """Time of a signature, 10 us since 2015."""
    return int((time.time() - EPOCH_UNIX_S) * 100_000)


class Program:
    """The autopilot with a UDP port for ground stations that call."""

    def __init__(self, program, port, key_file):
        self.process = subprocess.Popen(
            [program, "--plant-link", "127.0.0.1:0", "--gcs", "none", "--gcs-tcp", "none",
             "--gcs-udp-server", f"127.0.0.1:{port}", "--parameter-file", "none", "--signing-key", key_file],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        )

    def end(self, kill=False):
        """Ends it and returns its exit status and output."""
        self.process.kill() if kill else self.process.terminate()
        printed = self.process.communicate(timeout=20)[1]
        return self.process.returncode, printed


def call(port, component, key=None, link=0):
    """A station that calls the autopilot; it may sign."""
    s = Station(f"udpout:127.0.0.1:{port}", component=component)
    # The client of a server link sends first.
    s.link.last_address = ("127.0.0.1", port)
    if key is not None:
        s.link.setup_signing(key, sign_outgoing=True, link_id=link)
    s.run(0.3)
    return s


def answered(s, timeout_s=1.0):
    """Whether the autopilot answers a request of this station."""
    mark = len(s.messages)
    s.mav.param_request_read_send(1, 1, b"OBS_W0", -1)
    return s.wait(lambda: s.of("PARAM_VALUE", mark), timeout_s)


def signed_frame(s, key, timestamp, link):
    """A request that is signed with this key at this time."""
    signing = s.mav.signing
    before = (signing.secret_key, signing.timestamp, signing.link_id, signing.sign_outgoing)
    signing.secret_key, signing.timestamp, signing.link_id, signing.sign_outgoing = key, timestamp, link, True
    frame = bytes(s.mav.param_request_read_encode(1, 1, b"OBS_W0", -1).pack(s.mav))
    signing.secret_key, signing.timestamp, signing.link_id, signing.sign_outgoing = before
    return frame


def answers(s, frame, timeout_s=1.0):
    """Whether the autopilot answers these bytes."""
    mark = len(s.messages)
    s.link.write(frame)
    return s.wait(lambda: s.of("PARAM_VALUE", mark), timeout_s)


def times(s, since=0):
    """Times of the signatures of the autopilot's messages."""
    frames = [bytes(m.get_msgbuf()) for m in s.messages[since:] if m.get_type() != "BAD_DATA"]
    return [int.from_bytes(f[-12:-6], "little") for f in frames if f[0] == 0xFD and f[2] & 1]


def mode_of(path):
    return os.stat(path).st_mode & 0o777


def set_up(c, port, key_file):
    """From off to on; returns a station that signs and one that does not."""
    plain = call(port, 100)
    c.expect("off: an unsigned request is answered", answered(plain))
    c.expect("off: what is sent is not signed", not times(plain))
    c.expect("off: a signed request is answered, whatever its key",
             answers(plain, signed_frame(plain, OTHER_KEY, now(), 3)))
    s = call(port, 102)
    s.mav.setup_signing_send(1, 1, list(KEY), now())
    s.link.setup_signing(KEY, sign_outgoing=True, link_id=1)
    c.expect("SETUP_SIGNING from loopback: a text says so", s.wait(lambda: "Signing is on" in s.texts(), 30.0), s.texts())
    c.expect("the key file is there", wait_until(lambda: os.path.exists(key_file), 30.0))
    c.expect("and nobody else may read it", mode_of(key_file) == 0o600, oct(mode_of(key_file)))
    return plain, s


def refused(c, port, plain, s):
    """Senders that the autopilot ignores while signing is on."""
    c.expect("signed: answered", answered(s))
    mark = len(s.messages)
    s.run(2.0)
    frames = s.messages[mark:]
    # pymavlink does not check the signature of a message without a definition.
    known = [m for m in frames if not m.get_type().startswith(("UNKNOWN", "BAD_DATA"))]
    c.expect("everything that is sent is signed, and pymavlink agrees",
             known and s.bad == 0 and len(times(s, mark)) == len(frames)
             and all(m.get_signed() for m in known), f"{len(known)} of {len(frames)} known")
    stamps = times(s)
    c.expect("its time only grows", all(a < b for a, b in zip(stamps, stamps[1:])), len(stamps))
    c.expect("unsigned: not answered", not answered(plain))
    c.expect("and a text says so once",
             s.wait(lambda: any("refused unsigned messages" in t for t in s.texts()), 3.0), s.texts())
    c.expect("wrong key: not answered", not answers(s, signed_frame(s, OTHER_KEY, now() + 10, 4)))
    c.expect("and a text says so", s.wait(lambda: any("wrong signature" in t for t in s.texts()), 3.0))
    frame = signed_frame(s, KEY, now() + 20, 5)
    c.expect("another link of the same station: answered", answers(s, frame))
    c.expect("the same frame again: not answered", not answers(s, frame))
    c.expect("and a text says so", s.wait(lambda: any("not newer" in t for t in s.texts()), 3.0))
    old = signed_frame(s, KEY, now() - MINUTE - 500_000, 6)
    c.expect("a new link more than a minute behind: not answered", not answers(s, old))
    late = signed_frame(s, KEY, now() - MINUTE // 2, 6)
    c.expect("a new link half a minute behind: answered", answers(s, late))
    damaged = bytearray(signed_frame(s, KEY, now() + 30, 5))
    damaged[-1] ^= 1
    c.expect("one bit of the signature changed: not answered", not answers(s, bytes(damaged)))
    plain.mav.setup_signing_send(1, 1, NO_KEY, 0)
    plain.mav.setup_signing_send(1, 1, list(OTHER_KEY), 0)
    plain.run(0.5)
    c.expect("an unsigned SETUP_SIGNING changes nothing", answered(s) and not any("Signing is off" in t for t in s.texts()))
    stranger = call(port, 103)
    stranger.run(2.5)
    c.expect("who comes without the key receives nothing", not stranger.messages, len(stranger.messages))
    stranger.link.close()


def gets_in(port, component, link, within_s):
    """A station with the key and a right clock that repeats its request until the autopilot answers, and the duration, s."""
    began = time.monotonic()
    s = call(port, component, KEY, link)
    while not (accepted := answered(s, 0.4)) and time.monotonic() - began < within_s:
        # pymavlink reads the clock at this moment only.
        s.link.setup_signing(KEY, sign_outgoing=True, link_id=link)
    return s, accepted, time.monotonic() - began


def restarted(c, port, key_file, start, s):
    """The key and its times persist over the autopilot's end, however it ends, and so do the accepted timestamps."""
    for kill in (False, True):
        before = max(times(s))
        # Long enough that a message was accepted since the last save.
        for _ in range(8):
            frame = signed_frame(s, KEY, now(), 8)
            c.expect("before a restart: answered", answers(s, frame))
            time.sleep(0.9)
        s.link.close()
        status, printed = start.running.end(kill)
        c.expect("killed" if kill else "ended in order", status == (-9 if kill else 0), status)
        c.expect("the log never shows a key", KEY.hex() not in printed and str(list(KEY))[1:-1] not in printed)
        start()
        thief = call(port, 108)
        c.expect("after a restart: a message from before is not answered, and who sends it receives nothing",
                 not answers(thief, frame, 2.0) and not thief.messages, len(thief.messages))
        limit_s = 10.0 if kill else 1.0
        s, accepted, took_s = gets_in(port, 104, 7, limit_s)
        c.expect(f"and a station with a right clock is answered within {limit_s:.0f} s", accepted, f"{took_s:.1f} s")
        c.expect("the message from before is not answered later either", not answers(thief, frame))
        thief.link.close()
        first = min(times(s))
        c.expect("and time goes on where it was", first > before, f"{(first - before) / 1e5:.1f} s later")
        plain = call(port, 105)
        c.expect("and one without it is not", not answered(plain))
        plain.link.close()
    return s


def turned_off(c, port, key_file, s):
    s.mav.setup_signing_send(1, 1, NO_KEY, 0)
    s.link.disable_signing()
    c.expect("zeros turn it off, and a text says so", s.wait(lambda: "Signing is off" in s.texts(), 3.0), s.texts())
    c.expect("and the key file is gone", wait_until(lambda: not os.path.exists(key_file), 3.0))
    c.expect("unsigned: answered again", answered(s))
    plain = call(port, 106)
    c.expect("by anybody", answered(plain))
    plain.link.close()
    s.link.close()


def mavproxy(c, port, folder):
    s = Session(f"udpout:127.0.0.1:{port}", folder)
    c.expect("MAVProxy connects", s.wait_for(r"Received \d+ parameters", 30.0), s.output[-200:])
    for line, answer in [(f"signing setup {PASSPHRASE}", r"AP: Signing is on"),
                         ("param fetch OBS_W0", r"OBS_W0 = "),
                         ("long DO_SET_MODE 1 4 3", r"Got COMMAND_ACK: DO_SET_MODE"),
                         ("signing remove", r"Removed signing"),
                         ("long DO_SET_MODE 1 4 3", r"Got COMMAND_ACK: DO_SET_MODE")]:
        mark = len(s.output)
        s.send_line(line)
        c.expect(f"MAVProxy: {line}", s.wait_for(answer, 6.0, mark), s.output[mark:].strip()[-160:])
        time.sleep(0.5)
    s.send_line("exit")
    try:
        s.process.wait(5.0)
    except subprocess.TimeoutExpired:
        s.process.kill()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--autopilot", required=True, help="the program")
    parser.add_argument("--port", type=int, required=True, help="a free UDP port")
    args = parser.parse_args()
    c = Checks("Signing")
    with tempfile.TemporaryDirectory() as folder:
        key_file = os.path.join(folder, "data", "signing.key")

        def start():
            start.running = Program(args.autopilot, args.port, key_file)

        start()
        try:
            plain, s = set_up(c, args.port, key_file)
            refused(c, args.port, plain, s)
            plain.link.close()
            s = restarted(c, args.port, key_file, start, s)
            turned_off(c, args.port, key_file, s)
            mavproxy(c, args.port, folder)
            status, printed = start.running.end()
            c.expect("it ends in order", status == 0, printed[-500:])
            c.expect("the log says that signing was on and off", "Signing is on" in printed and "Signing is off" in printed)
            os.makedirs(os.path.dirname(key_file), exist_ok=True)
            with open(key_file, "w", encoding="ascii") as file:
                file.write(f'key = "{KEY.hex()}"\n')
            os.chmod(key_file, 0o644)
            start()
            start.running.process.wait(20)
            status, printed = start.running.end()
            c.expect("a key file that others may read stops the start",
                     status == 1 and "0644" in printed and "0600" in printed and key_file in printed, printed.strip()[-200:])
            os.chmod(key_file, 0o600)
            start()
            s = call(args.port, 107, KEY, link=1)
            c.expect("a key file made by hand turns signing on at the start", answered(s, 5.0))
        finally:
            start.running.end(kill=True)
    c.end()


if __name__ == "__main__":
    main()
