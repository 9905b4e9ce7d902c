"""Commands in processes of their own, apart from our packages, and what they cost."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from typing import IO

from kilauea.errors import KilaueaError

_LOG_LINES_SHOWN = 12


@dataclass(frozen=True, slots=True)
class Finished:
    """A command that ended well."""

    output: str
    wall_s: float
    cpu_s: float
    """Of all its threads, system time included."""


def run_apart(command: list[str], purpose: str) -> Finished:
    """Run a command without our Python paths and measure it.

    Raises
    ------
    KilaueaError
        It failed; the message ends with the last line it wrote.
    """
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME")}
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        start = time.perf_counter()
        child = subprocess.Popen(command, stdout=out, stderr=err, env=environment)
        try:
            _, status, usage = os.wait4(child.pid, 0)
        except BaseException:
            child.kill()
            child.wait()
            raise
        wall_s = time.perf_counter() - start
        child.returncode = os.waitstatus_to_exitcode(status)
        printed, complaints = (_text(file) for file in (out, err))
    if child.returncode != 0:
        lines = (printed + complaints).strip().splitlines()[-_LOG_LINES_SHOWN:]
        print("\n".join(lines), file=sys.stderr)
        last = lines[-1] if lines else f"exit code {child.returncode}"
        raise KilaueaError(f"cannot {purpose}: {last}")
    return Finished(printed, wall_s, usage.ru_utime + usage.ru_stime)


def _text(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode(errors="replace")
