"""Warnings that many prims share, folded into one line each."""

from __future__ import annotations


class Remarks:
    """Writes each remark to a list of lines once, with the first prim and how many there are."""

    def __init__(self, lines: list[str]) -> None:
        self._lines = lines
        self._first: dict[str, str] = {}
        self._paths: dict[str, set[str]] = {}

    def add(self, path: str, remark: str) -> None:
        """Remark on the prim at `path`."""
        paths = self._paths.setdefault(remark, set())
        if path in paths:
            return
        paths.add(path)
        first = self._first.setdefault(remark, path)
        if len(paths) == 1:
            self._lines.append(f"{first}: {remark}")
            return
        others = len(paths) - 1
        old = f"{first}: {remark}" + (f" (and {others - 1} more)" if others > 1 else "")
        self._lines[self._lines.index(old)] = f"{first}: {remark} (and {others} more)"
