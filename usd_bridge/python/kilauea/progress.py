"""How far a render is, on stderr."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

_BAR_WIDTH = 30
_REDRAW_SECS = 0.2
_LINE_SECS = 10.0
_SLOW_WIDTH = 24
_NAMED = 3
"""Workers that are named; others are counted."""


class Progress:
    """A bar on a terminal; otherwise a line now and then."""

    def __init__(self, shown: bool, alfred: bool = False) -> None:
        self._shown = shown
        self._alfred = alfred
        self._tty = sys.stderr.isatty()
        self._next = time.monotonic() + (0.0 if self._tty else _LINE_SECS)
        self._percent = -1
        self._drawn = False

    def update(
        self, fraction: float, seconds_left: float | None, laggards: Sequence[int] = ()
    ) -> None:
        """Show the state where it is time to; `laggards` are workers that hold the frame up."""
        percent = int(100 * min(max(fraction, 0.0), 1.0))
        if self._alfred and percent > self._percent:
            self._percent = percent
            print(f"ALF_PROGRESS {percent}%", flush=True)
        now = time.monotonic()
        if not self._shown or now < self._next:
            return
        left = "" if seconds_left is None else f"{duration(seconds_left)} left"
        slow = f"slow: {_workers(laggards)}" if laggards else ""
        if self._tty:
            done = "#" * (percent * _BAR_WIDTH // 100)
            sys.stderr.write(
                f"\r[{done:-<{_BAR_WIDTH}}] {percent:3d} %  {left:<16}{slow:<{_SLOW_WIDTH}}"
            )
            self._next = now + _REDRAW_SECS
            self._drawn = True
        else:
            said = ", ".join(part for part in (f"{percent} %", left, slow) if part)
            sys.stderr.write(f"kilauea: {said}\n")
            self._next = now + _LINE_SECS
        sys.stderr.flush()

    def close(self) -> None:
        """Take the bar away."""
        if self._drawn:
            sys.stderr.write("\r" + " " * (_BAR_WIDTH + 28 + _SLOW_WIDTH) + "\r")
            sys.stderr.flush()


def _workers(ranks: Sequence[int]) -> str:
    """Write `worker 2` or `workers 0, 1, 2 +5`."""
    named = ", ".join(str(rank) for rank in ranks[:_NAMED])
    more = f" +{len(ranks) - _NAMED}" if len(ranks) > _NAMED else ""
    return f"worker{'s' if len(ranks) > 1 else ''} {named}{more}"


def duration(seconds: float) -> str:
    """Write seconds as `12 s`, `3:04` or `1:02:03`."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes, secs = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{secs:02d}" if hours else f"{minutes}:{secs:02d}"
