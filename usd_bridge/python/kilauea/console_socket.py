"""Commands to a console over a Unix socket: a line in, a line of JSON out."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kilauea.console import Console
from kilauea.errors import KilaueaError, UsageError

_MAX_LINE = 1 << 20
"""Bytes of a command. Longer ones end their connection."""


def serve(file: Path, console: Console) -> None:
    """Take commands from whoever connects, one connection at a time, until told to quit.

    Nobody but the user may connect. Each answer is an object with `ok`; where that is false,
    `error` and the `code` with which a command of its own would have ended.

    Raises
    ------
    KilaueaError
        Another console listens there, or something else is in the way.
    """
    with _listening(file) as listener:
        print(f"listening on {file}", flush=True)
        while not console.is_over:
            connection, _ = listener.accept()
            with connection:
                _converse(connection, console)


def _converse(connection: socket.socket, console: Console) -> None:
    try:
        with connection.makefile("rb") as lines:
            while not console.is_over and (line := lines.readline(_MAX_LINE)):
                if not line.endswith(b"\n") and len(line) == _MAX_LINE:
                    return
                connection.sendall(json.dumps(_answer(console, line)).encode() + b"\n")
    except OSError:
        # The other side went away, and with it who would read the answer.
        return


def _answer(console: Console, line: bytes) -> dict[str, Any]:
    try:
        return {"ok": True, **console.run(line.decode(errors="replace"))}
    except KilaueaError as error:
        return {"ok": False, "error": str(error), "code": error.exit_code}


@contextmanager
def _listening(file: Path) -> Iterator[socket.socket]:
    _take_away_what_a_dead_console_left(file)
    with socket.socket(socket.AF_UNIX) as listener:
        before = os.umask(0o177)
        try:
            listener.bind(str(file))
        except OSError as error:
            raise KilaueaError(f"cannot listen on {file}: {error}") from None
        finally:
            os.umask(before)
        try:
            listener.listen()
            yield listener
        finally:
            file.unlink(missing_ok=True)


def _take_away_what_a_dead_console_left(file: Path) -> None:
    if not file.exists():
        return
    if not file.is_socket():
        raise UsageError(f"{file} exists and is no socket")
    with socket.socket(socket.AF_UNIX) as probe:
        try:
            probe.connect(str(file))
        except OSError:
            file.unlink(missing_ok=True)
        else:
            raise KilaueaError(f"a console listens on {file} already")
