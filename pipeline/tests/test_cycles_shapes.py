"""Curves, points, motion and visibility in Cycles: how much of a window they cover."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_writer import SceneWriter, camera, column_major, look_down
from test_cycles import emitter, pytestmark, render

__all__ = ["pytestmark"]

TOLERANCE = 4e-3
QUAD = [(0, 0, 1), (1, 0, 1), (1, 0, -1), (0, 0, -1)]
"""A column of half the window's height and half its width, from the middle to the right edge."""


@pytest.fixture
def window(tmp_path: Path) -> SceneWriter:
    """A window from -1 to 1 along x and z, seen from above, in which all that is there is 1."""
    writer = SceneWriter(tmp_path)
    emitter(writer, [1.0] * 3)
    view = camera(look_down(), projection="orthographic", screen_window=[-1, -1, 1, 1])
    writer.record["camera"] = view
    writer.record["settings"] |= {"resolution": [32, 32], "samples_per_pixel": 256}
    return writer


def covered(writer: SceneWriter) -> float:
    return float(render(writer.write())[..., 0].mean())


def shift(x: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[0, 3] = x
    return matrix


def add_curves(writer: SceneWriter, points: Any, radii: Any, **fields: Any) -> None:
    record = {
        "prim_idx": 0,
        "material": 0,
        "visibility": 7,
        "basis": "bezier",
        "profile": "round",
        "n_points": len(points),
        "n_segments": 1,
        "points": writer.array(points, "<f4"),
        "later_points": [],
        "radii": writer.array(radii, "<f4"),
        "normals": None,
        "segments": writer.array([0], "<u4"),
        "attributes": [],
    }
    writer.record["prototypes"][0].setdefault("curves", []).append(record | fields)


@pytest.mark.parametrize("basis", ["linear", "bezier"])
def test_round_curves(window: SceneWriter, basis: str) -> None:
    n = 2 if basis == "linear" else 4
    points = [(-2 + 4 * i / (n - 1), 0, 0) for i in range(n)]
    add_curves(window, points, [0.25] * n, basis=basis)
    assert covered(window) == pytest.approx(0.25, abs=TOLERANCE)


def test_ribbons_lie_across_their_normals(window: SceneWriter) -> None:
    points = [(-2 + 4 * i / 3, 0, 0) for i in range(4)]
    # Tilted by 60 degrees about its axis, a ribbon looks half as wide.
    normal = (0.0, 0.5, math.sqrt(0.75))
    normals = window.array([normal] * 4, "<f4")
    add_curves(window, points, [0.5] * 4, profile="ribbon", normals=normals)
    assert covered(window) == pytest.approx(0.25, abs=TOLERANCE)


def test_points(window: SceneWriter) -> None:
    record = {
        "prim_idx": 0,
        "material": 0,
        "visibility": 7,
        "n_points": 2,
        "centers": window.array([(-0.5, 0, 0), (0.5, 0, 0)], "<f4"),
        "later_centers": [],
        "radii": window.array([0.25, 0.5], "<f4"),
        "attributes": [],
    }
    window.record["prototypes"][0]["points"] = [record]
    area = math.pi * (0.25**2 + 0.5**2)
    assert covered(window) == pytest.approx(area / 4, abs=TOLERANCE)


def move_quad(writer: SceneWriter, *x: float) -> None:
    """Place the column at several keys."""
    writer.prototype("/quad")
    writer.chunk(QUAD, [(0, 1, 2), (0, 2, 3)], prototype=1)
    first, *later = (writer.array([column_major(shift(at))], "<f8") for at in x)
    writer.record["prototypes"][0]["instances"] = [
        {"prototype": 1, "matrices": first, "later_matrices": later, "attributes": []}
    ]


def test_moving_instances(window: SceneWriter) -> None:
    # Leaves the window to the right in the first half of the shutter, and stays outside.
    move_quad(window, 0, 1, 1)
    assert covered(window) == pytest.approx(0.125, abs=TOLERANCE)


def test_deforming_meshes(window: SceneWriter) -> None:
    window.chunk(QUAD, [(0, 1, 2), (0, 2, 3)])
    chunk = window.record["prototypes"][0]["chunks"][0]
    keys = [np.array(QUAD) + np.array([x, 0, 0]) for x in (1, 1)]
    chunk["later_keys"] = [{"positions": window.array(key, "<f4"), "normals": None} for key in keys]
    assert covered(window) == pytest.approx(0.125, abs=TOLERANCE)


def test_moving_cameras(window: SceneWriter) -> None:
    window.chunk(QUAD, [(0, 1, 2), (0, 2, 3)])
    later = look_down()
    later[0, 3] = -1
    window.record["camera"]["later_world_from_camera"] = [column_major(later)]
    assert covered(window) == pytest.approx(0.25, abs=TOLERANCE)


@pytest.mark.parametrize(("visibility", "expected"), [(7, 0.5), (6, 0.0), (1, 0.5)])
def test_visibility_to_the_camera(window: SceneWriter, visibility: int, expected: float) -> None:
    window.chunk(QUAD, [(0, 1, 2), (0, 2, 3)])
    window.record["prototypes"][0]["chunks"][0]["visibility"] = visibility
    assert covered(window) == pytest.approx(expected, abs=TOLERANCE)
