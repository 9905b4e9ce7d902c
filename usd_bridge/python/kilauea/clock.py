"""Time since this process began, imports included."""

from __future__ import annotations

import os
import time
from pathlib import Path

_IMPORTED = time.monotonic()


def _age_at_import() -> float:
    """Return how long the process had run when this module was imported, from /proc (Linux)."""
    try:
        # Fields after the command name, which may hold spaces; starttime is field 22 (proc(5)).
        fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
        started = int(fields[19]) / os.sysconf("SC_CLK_TCK")
        age = time.clock_gettime(time.CLOCK_BOOTTIME) - started
    except (OSError, ValueError, IndexError, AttributeError):
        return 0.0
    # In a container, boot times may not belong together.
    return age if 0.0 <= age < 3600.0 else 0.0


_AGE = _age_at_import()


def process_age() -> float:
    """Return the seconds since the process began."""
    return _AGE + time.monotonic() - _IMPORTED
