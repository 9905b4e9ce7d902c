"""The box around everything in a frame."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kilauea import payload

Box = NDArray[np.float64]
"""(2, 3): the lowest and the highest corner; lowest above highest where it is empty."""

_EMPTY: Box = np.array([[np.inf] * 3, [-np.inf] * 3])


def world_bounds(frame: payload.Frame) -> Box | None:
    """Return the box around the control points and shapes of a frame; None without any.

    Motion plays no part: only frames without a camera, and so without a shutter, are framed.
    """
    box = _Bounds(frame).of_prototype(payload.WORLD)
    return box if np.isfinite(box).all() else None


class _Bounds:
    def __init__(self, frame: payload.Frame) -> None:
        self._own: dict[int, list[Box]] = {}
        self._placed: dict[int, list[payload.Instances]] = {}
        self._known: dict[int, Box] = {}
        for mesh in frame.meshes:
            box = _transformed(_points_box(mesh.points), mesh.prototype_from_mesh)
            self._own.setdefault(mesh.prototype, []).append(box)
        for curves in frame.curves:
            box = _widened(_points_box(curves.points), curves.widths)
            box = _transformed(box, curves.prototype_from_curves)
            self._own.setdefault(curves.prototype, []).append(box)
        for cloud in frame.points:
            box = _widened(_points_box(cloud.points), cloud.widths)
            box = _transformed(box, cloud.prototype_from_points)
            self._own.setdefault(cloud.prototype, []).append(box)
        for shape in frame.implicits:
            box = _transformed(_shape_box(shape), shape.prototype_from_mesh)
            self._own.setdefault(shape.prototype, []).append(box)
        for instances in frame.instances:
            self._placed.setdefault(instances.parent, []).append(instances)

    def of_prototype(self, index: int) -> Box:
        if index not in self._known:
            placed = [
                _transformed(self.of_prototype(i.prototype), i.parent_from_prototype)
                for i in self._placed.get(index, ())
            ]
            self._known[index] = _union([*self._own.get(index, ()), *placed])
        return self._known[index]


def _points_box(points: Any) -> Box:
    finite = points[np.isfinite(points).all(axis=1)]
    if not len(finite):
        return _EMPTY
    return np.array([finite.min(axis=0), finite.max(axis=0)], np.float64)


def _widened(box: Box, widths: payload.Primvar | None) -> Box:
    """Widen a box by half of the largest width, which is 1 where there are none."""
    finite = np.ones(1) if widths is None else widths.values[np.isfinite(widths.values)]
    radius = max(float(finite.max(initial=0.0)), 0.0) / 2
    return box + np.array([[-radius], [radius]])


def _shape_box(shape: payload.Implicit) -> Box:
    """Bound a shape, built along z and turned to its axis."""
    a, b, c = shape.dimensions
    match shape.kind:
        case "Sphere":
            half = [a, a, a]
        case "Cube":
            half = [a / 2] * 3
        case "Plane":
            half = [a / 2, b / 2, 0.0]
        case "Capsule":
            half = [max(a, b), max(a, b), c / 2 + max(a, b)]
        case _:
            half = [max(a, b), max(a, b), c / 2]
    turns = {"X": [2, 1, 0], "Y": [0, 2, 1], "Z": [0, 1, 2]}
    extent = np.array(half)[turns[shape.axis]]
    return np.array([-extent, extent])


def _transformed(box: Box, matrices: Any) -> Box:
    """Bound a box under one or many matrices of row vectors."""
    if not np.isfinite(box).all():
        return _EMPTY
    corners = np.array([(*c, 1.0) for c in itertools.product(*box.T)])
    placed = (corners @ np.reshape(matrices, (-1, 4, 4)))[..., :3].reshape(-1, 3)
    return _points_box(placed)


def _union(boxes: list[Box]) -> Box:
    if not boxes:
        return _EMPTY
    stacked = np.array(boxes)
    return np.array([stacked[:, 0].min(axis=0), stacked[:, 1].max(axis=0)])
