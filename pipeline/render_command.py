"""What the commands of other engines share: their arguments, and what they say of a render."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from peak_memory import peak_rss

if TYPE_CHECKING:
    from exported import Raster


def render_parser(description: str | None) -> argparse.ArgumentParser:
    """Return a parser with the arguments of every engine that renders an exported scene."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("folder", type=Path, help="what Scene.export wrote")
    parser.add_argument("out", type=Path, help="EXR to write, linear float RGB")
    parser.add_argument("--samples", type=int, help="per pixel, instead of the scene's own")
    parser.add_argument("--seed", type=int, help="instead of the scene's own")
    parser.add_argument("--stats", type=Path, help="JSON to write")
    return parser


def write_stats(
    path: Path,
    engine: str,
    raster: Raster,
    samples_per_pixel: float,
    seed: int,
    seconds: dict[str, float],
) -> None:
    """Write a render's statistics; `seconds` are those of `build_s`, `compile_s`, `render_s`."""
    stats = {
        "engine": engine,
        "samples_per_pixel": samples_per_pixel,
        "seed": seed,
        "width": raster.width,
        "height": raster.height,
        **seconds,
        "peak_rss": peak_rss(),
        "warnings": [],
    }
    path.write_text(json.dumps(stats, indent=1), encoding="utf-8")
