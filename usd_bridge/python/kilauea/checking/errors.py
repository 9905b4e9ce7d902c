"""What keeps a check from being made; not the same as a check that fails."""

from __future__ import annotations

from kilauea.errors import KilaueaError


class CannotCheckError(KilaueaError):
    """There is nothing to compare with: no such reference, another size, no Cycles."""

    exit_code = 2
