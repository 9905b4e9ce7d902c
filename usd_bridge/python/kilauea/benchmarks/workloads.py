"""Meshes that rays are traced against: shapes of our own, and stages."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kilauea.render import native

STAGES = (
    "16_caustic/caustic_dice.usdc",
    "02_kitchen/kitchen_day.usda",
    "15_townhouse/townhouse.usda",
    "05_chess/chess_outdoor.usda",
    "07_bmw27/cars32_unique.usda",
)
"""Measured by default where `KILAUEA_ASSETS` has them: 18 thousand to 3.4 million triangles."""


@dataclass(frozen=True, slots=True)
class Limits:
    """How big workloads get."""

    n_rays: int
    """About, of each kind."""
    max_triangles: int
    """With every instance baked."""


def default_meshes() -> list[str]:
    """Return the shapes, and those of our stages that are there."""
    assets = os.environ.get("KILAUEA_ASSETS")
    stages = [Path(assets) / stage for stage in STAGES] if assets else []
    return native().RayWorkload.shapes() + [str(stage) for stage in stages if stage.is_file()]


def load(mesh: str, limits: Limits) -> Any:
    """Make rays against a shape, or against a stage as its camera sees it."""
    workloads = native().RayWorkload
    if mesh in workloads.shapes():
        return workloads.shape(mesh, limits.n_rays)
    from kilauea.usd.options import FlattenOptions
    from kilauea.usd.stage import flatten

    frame = flatten(mesh, FlattenOptions(scene_materials=False))
    resolution = tuple(frame.settings["resolution"])
    name = Path(mesh).stem
    return workloads.flatten(name, frame, resolution, limits.max_triangles, limits.n_rays)
