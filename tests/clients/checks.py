"""What the client checks share: a list of claims with their outcome, and an exit status."""

import sys
import time


class Checks:
    """Claims and whether they held. Exit status 0 only if every one did."""

    def __init__(self, title):
        print(title)
        self.failed = []
        self.count = 0

    def expect(self, claim, holds, detail=""):
        """Notes whether a claim holds and returns it."""
        self.count += 1
        mark = "ok  " if holds else "FAIL"
        tail = f"  ({detail})" if detail != "" else ""
        print(f"  {mark} {claim}{tail}", flush=True)
        if not holds:
            self.failed.append(claim)
        return holds

    def end(self):
        """Prints the sum and leaves."""
        if self.failed:
            print(f"{len(self.failed)} of {self.count} claims failed:")
            for claim in self.failed:
                print(f"  {claim}")
            sys.exit(1)
        print(f"all {self.count} claims hold")
        sys.exit(0)


def wait_until(condition, timeout_s, pause_s=0.02):
    """Waits until `condition()` is true; whether it became true in time."""
    give_up = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > give_up:
            return False
        time.sleep(pause_s)
    return True
