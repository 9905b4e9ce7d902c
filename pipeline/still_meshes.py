"""What engines without motion, curves and nested instances can draw of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from unsupported import UnsupportedError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from exported import ExportedScene

ALL_RAYS = 7
"""Camera, shadow and indirect rays."""


def refuse_what_is_no_still_mesh(scene: ExportedScene) -> None:
    """Raise where a scene has more than meshes that stand still and are seen by all rays."""
    if scene.has_motion:
        raise UnsupportedError("motion blur")
    for prototype in scene.prototypes:
        if prototype.get("curves") or prototype.get("points"):
            raise UnsupportedError("curves and points")
        for record in (*prototype["chunks"], *prototype["instances"]):
            if record.get("visibility", ALL_RAYS) != ALL_RAYS:
                raise UnsupportedError("surfaces that some rays do not meet")


def placements(
    scene: ExportedScene, prototype: int = 0, matrix: np.ndarray | None = None
) -> Iterator[tuple[int, np.ndarray]]:
    """Yield each place of each prototype as (prototype, 4 by 4), instances in instances flat."""
    matrix = np.eye(4) if matrix is None else matrix
    yield prototype, matrix
    record = scene.prototypes[prototype]
    for instances in record["instances"]:
        if instances.get("attributes"):
            raise UnsupportedError("primvars per instance")
        (still,) = scene.placed(record, instances)
        for placed in still:
            yield from placements(scene, instances["prototype"], matrix @ placed)
