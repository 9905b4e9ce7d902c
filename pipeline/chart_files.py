"""Charts as files: `pyplot` without a window, and how its figures are written. Needs matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib

matplotlib.use("agg")
# Equal rows make equal files.
matplotlib.rcParams["svg.hashsalt"] = "kilauea"

from matplotlib import pyplot  # noqa: E402

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

__all__ = ["pyplot", "save"]


def save(figure: Figure, stem: Path) -> None:
    """Write a figure as `stem.svg` and `stem.png`."""
    figure.savefig(stem.with_suffix(".svg"), metadata={"Date": None})
    figure.savefig(stem.with_suffix(".png"), dpi=110)
