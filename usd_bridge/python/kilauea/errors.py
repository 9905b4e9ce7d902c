"""What ends a command early; each error knows the exit code that scripts see."""

from __future__ import annotations


class KilaueaError(Exception):
    """Ends the command with one line on stderr and no traceback."""

    exit_code = 1


class UsageError(KilaueaError):
    """The command line asks for something impossible."""

    exit_code = 2


class StageError(KilaueaError):
    """The stage cannot be opened."""

    exit_code = 3


class MissingAssetError(KilaueaError):
    """Something is missing or not rendered, under `--strict`."""

    exit_code = 4


class TimeLimitError(KilaueaError):
    """The time limit came before one full pass."""

    exit_code = 5
