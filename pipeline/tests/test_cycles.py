"""Cycles, as set up here, against closed forms: it can only be a reference if it is right."""

from __future__ import annotations

import math
import os
import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from scene_writer import (
    SceneWriter,
    constant_material,
    light,
    pointing_down,
)

CACHE = Path(os.environ.get("KILAUEA_CACHE", Path.home() / ".cache/kilauea"))
PYTHON = CACHE / "reference-env/bin/python"
SCRIPT = Path(__file__).parents[1] / "cycles_render.py"
ALBEDO = 0.8
TOLERANCE = 0.005

pytestmark = pytest.mark.skipif(
    not PYTHON.exists(), reason="no Blender: `kilauea reference` has not made its environment yet"
)


def render(folder: Path, *flags: str) -> np.ndarray:
    out = folder / "out.exr"
    command = [str(PYTHON), str(SCRIPT), str(folder), str(out), *flags]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return oiio.ImageBuf(str(out)).get_pixels(oiio.FLOAT)[..., :3]


def check(image: np.ndarray, expected: float | list[float]) -> None:
    mean = image.reshape(-1, 3).mean(axis=0)
    np.testing.assert_allclose(mean, np.broadcast_to(expected, 3), rtol=TOLERANCE)


@pytest.fixture
def plane(tmp_path: Path) -> SceneWriter:
    writer = SceneWriter(tmp_path)
    writer.record["materials"] = [constant_material("Matte", diffuseColor=[ALBEDO] * 3)]
    writer.record["settings"]["samples_per_pixel"] = 256
    writer.floor()
    return writer


def distance(height: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[1, 3] = height
    return matrix


def rect_irradiance(half_width: float, half_height: float, height: float) -> float:
    """Under the centre of a parallel rectangle: four corner factors, Howell C-10, times pi."""
    total = 0.0
    for a, b in ((half_width, half_height), (half_height, half_width)):
        root = math.hypot(a, height)
        total += 2.0 * a / root * math.atan(b / root)
    return total


def cylinder_irradiance(radius: float, length: float, height: float) -> float:
    """Under the middle of a horizontal tube, by quadrature over the lateral surface."""
    phi = (np.arange(2000) + 0.5) / 2000 * 2.0 * math.pi
    x = ((np.arange(2000) + 0.5) / 2000 - 0.5)[:, None] * length
    y, z = height + radius * np.sin(phi), radius * np.cos(phi)
    toward = -np.sin(phi) * y - np.cos(phi) * z
    visible = np.maximum(toward, 0.0) * np.maximum(y, 0.0) / (x * x + y * y + z * z) ** 2
    return float(visible.sum() * length / 2000 * 2.0 * math.pi * radius / 2000)


@pytest.mark.parametrize(
    ("shape", "matrix", "irradiance"),
    [
        ({"type": "disk", "radius": 0.5}, pointing_down(1.0), math.pi * 0.25 / 1.25),
        (
            {"type": "rect", "width": 1.0, "height": 2.0},
            pointing_down(1.0),
            rect_irradiance(0.5, 1.0, 1.0),
        ),
        ({"type": "sphere", "radius": 0.5}, distance(2.0), math.pi * 0.25 / 4.0),
        (
            {"type": "cylinder", "radius": 0.25, "length": 1.5},
            distance(1.0),
            cylinder_irradiance(0.25, 1.5, 1.0),
        ),
        (
            {"type": "distant", "angle_degrees": 60.0},
            pointing_down(),
            math.pi * math.sin(math.radians(30.0)) ** 2,
        ),
        ({"type": "distant", "angle_degrees": 0.0}, pointing_down(), 1.0),
        ({"type": "dome"}, np.eye(4), math.pi),
    ],
    ids=["disk", "rect", "sphere", "cylinder", "distant", "delta sun", "dome"],
)
def test_irradiance_under_a_light(
    plane: SceneWriter, shape: dict, matrix: np.ndarray, irradiance: float
) -> None:
    colour = [4.0, 2.0, 1.0]
    plane.record["lights"] = [light(shape, matrix, radiance=colour, visible_to_camera=False)]
    check(render(plane.write()), [ALBEDO * irradiance / math.pi * c for c in colour])
