"""A progress bar."""

from __future__ import annotations

import sys
import time
from math import isnan


class Bar:
    """A progress bar on one line of standard error. Call it with a text and a fraction from 0 to 1, NaN if it is not known."""

    def __init__(self) -> None:
        self._start = time.monotonic()
        self._length = 0

    def __call__(self, text: str, share: float) -> None:
        elapsed = time.monotonic() - self._start
        if isnan(share):
            line = f"{elapsed:.0f} s  {text}"
        else:
            full = int(30 * min(max(share, 0.0), 1.0))
            left = f", {elapsed * (1 - share) / share:.0f} s left" if share > 0.01 else ""
            line = f"{100 * share:3.0f} % |{'#' * full}{' ' * (30 - full)}| {elapsed:.0f} s{left}  {text}"
        print("\r" + line.ljust(self._length), end="", file=sys.stderr, flush=True)
        self._length = len(line)

    def close(self) -> None:
        """End the line."""
        if self._length:
            print(file=sys.stderr)


def bar() -> Bar:
    """A new bar."""
    return Bar()
