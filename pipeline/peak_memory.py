"""The highest resident size of this process."""

from __future__ import annotations

from pathlib import Path


def peak_rss() -> int:
    """Return the highest resident size in bytes, from /proc (Linux).

    `getrusage` would count what the process was before it became this program: a copy of its
    parent.
    """
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return 1024 * int(line.split()[1])
    raise RuntimeError("/proc/self/status has no VmHWM")
