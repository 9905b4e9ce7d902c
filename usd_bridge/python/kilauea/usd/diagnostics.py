"""USD's own messages, and what composition could not find, as lines for the user."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from pxr import Pcp, Tf, Usd, UsdUtils

_MISSING = (Pcp.ErrorInvalidAssetPath, Pcp.ErrorInvalidSublayerPath, Pcp.ErrorUnresolvedPrimPath)


@contextmanager
def captured(lines: list[str]) -> Iterator[None]:
    """Append USD's warnings to `lines` instead of letting them reach stderr."""
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        seen = set(lines)
        for diagnostic in delegate.TakeUncoalescedDiagnostics():
            line = one_line(diagnostic.commentary)
            if line not in seen:
                seen.add(line)
                lines.append(line)


def error_line(error: Tf.ErrorException) -> str:
    """Return everything that a USD error says, as one line."""
    return one_line("; ".join(str(e.commentary) for e in error.args)) or "unknown USD error"


def one_line(text: Any) -> str:
    """Fold white space so that a message stays on its line."""
    return " ".join(str(text).split())


def composition_report(stage: Usd.Stage) -> tuple[list[str], list[str]]:
    """Split the stage's composition errors into (missing layers and prims, other faults)."""
    missing: dict[str, None] = {}
    faults: dict[str, None] = {}
    for error in stage.GetCompositionErrors():
        (missing if isinstance(error, _MISSING) else faults)[one_line(error)] = None
    return list(missing), list(faults)
