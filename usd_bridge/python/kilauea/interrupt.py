"""Ctrl-C: ends the command within a second, whatever it is in the middle of."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable
from typing import Any, NoReturn, TypeVar

T = TypeVar("T")

EXIT_CODE = 130
GRACE_SECS = 0.7


def run(work: Callable[[], T], grace_secs: float = 0.0) -> T:
    """Do long work that holds no lock for long, leaving at once when interrupted.

    The work runs on a thread of its own, so that the main thread sees the signal while USD or the
    engine is busy. After an interrupt it has `grace_secs` to finish.
    """
    result: list[Any] = []
    errors: list[BaseException] = []

    def target() -> None:
        try:
            result.append(work())
        except BaseException as error:  # Handed on to the caller below.
            errors.append(error)

    thread = threading.Thread(target=target, daemon=True)
    try:
        thread.start()
        while thread.is_alive():
            thread.join(0.05)
    except KeyboardInterrupt:
        thread.join(grace_secs)
        leave()
    if errors:
        raise errors[0]
    return result[0]


class Interrupted(KeyboardInterrupt):
    """What was interrupted has stopped; nothing was written."""


def cancel(job: Any) -> NoReturn:
    """Cancel a native render without writing anything.

    Raises
    ------
    Interrupted
        It has stopped. If it does not soon, the process ends.
    """
    job.cancel()
    deadline = time.monotonic() + GRACE_SECS
    while time.monotonic() < deadline:
        if job.wait(0.05):
            raise Interrupted
    leave()


def leave() -> NoReturn:
    """End the process now: threads of USD and of the engine may still run."""
    sys.stderr.write("\nkilauea: interrupted\n")
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(EXIT_CODE)
