"""Triangles as LuxCore takes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pyluxcore

BACK_GAP = 1e-4
"""Between the front and the back of what shines, of its size."""


@dataclass(frozen=True)
class Triangles:
    """Points (n, 3), vertex indices (m, 3) and unit normals at the points, or None."""

    points: np.ndarray
    indices: np.ndarray
    normals: np.ndarray | None

    def placed(self, matrix: np.ndarray) -> Triangles:
        """Transform by an affine (4, 4) matrix; sides stay what they are."""
        linear = matrix[:3, :3]
        points = self.points @ linear.T + matrix[:3, 3]
        mirrors = np.linalg.det(linear) < 0.0
        indices = self.indices[:, ::-1] if mirrors else self.indices
        if self.normals is None:
            return Triangles(points, indices, None)
        normals = self.normals @ np.linalg.inv(linear)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return Triangles(points, indices, normals)

    def back(self) -> Triangles:
        """Return triangles closely behind these that face the other way."""
        corners = self.points[self.indices]
        faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = np.zeros_like(self.points, dtype=np.float64)
        np.add.at(normals, self.indices, faces[:, None, :])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        gap = BACK_GAP * np.linalg.norm(np.ptp(self.points, axis=0))
        points = self.points - gap * normals
        turned = None if self.normals is None else -self.normals
        return Triangles(points, self.indices[:, ::-1], turned)


def define(target: pyluxcore.Scene, name: str, triangles: Triangles) -> None:
    """Give a scene a mesh by name."""
    normals = triangles.normals
    target.DefineMesh(
        name,
        rows(triangles.points),
        rows(triangles.indices),
        None if normals is None else rows(normals),
        None,
        None,
        None,
    )


def add_object(
    target: pyluxcore.Scene, name: str, triangles: Triangles, material: str
) -> dict[str, Any]:
    """Define a mesh and return the properties of an object that shows it."""
    define(target, name, triangles)
    return {
        f"scene.objects.{name}.shape": name,
        f"scene.objects.{name}.material": material,
    }


def rows(array: np.ndarray) -> list[tuple[Any, ...]]:
    """Return rows as tuples of Python numbers, which is all that LuxCore reads."""
    return list(map(tuple, array.tolist()))
