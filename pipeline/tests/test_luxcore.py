"""LuxCore, as set up here, against closed forms."""

from __future__ import annotations

import math
import os
import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from scene_writer import SceneWriter, camera, constant_material, light, look_down, pointing_down
from turned_dome import TURNS, add_dome, look_at_it, mean_over_cosines, seen

CACHE = Path(os.environ.get("KILAUEA_CACHE", Path.home() / ".cache/kilauea"))
PYTHON = Path(os.environ.get("KILAUEA_LUXCORE_PYTHON", CACHE / "luxcore-env/bin/python"))
SCRIPT = Path(__file__).parents[1] / "luxcore_render.py"
ALBEDO = 0.8

pytestmark = pytest.mark.skipif(
    not PYTHON.exists(), reason="no LuxCore: `kilauea bench` has not made its environment yet"
)


def run(folder: Path, *flags: str) -> subprocess.CompletedProcess[str]:
    command = [str(PYTHON), str(SCRIPT), str(folder), str(folder / "out.exr"), *flags]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def render(folder: Path, *flags: str) -> np.ndarray:
    done = run(folder, *flags)
    assert done.returncode == 0, done.stdout + done.stderr
    return oiio.ImageBuf(str(folder / "out.exr")).get_pixels(oiio.FLOAT)[..., :3]


@pytest.mark.parametrize(
    ("shape", "height", "irradiance", "seen"),
    [
        ({"type": "disk", "radius": 0.5}, 1.0, math.pi * 0.25 / 1.25, True),
        ({"type": "sphere", "radius": 0.5}, 2.0, math.pi * 0.25 / 4.0, False),
        ({"type": "distant", "angle_degrees": 0.0}, 0.0, 1.0, True),
        ({"type": "distant", "angle_degrees": 60.0}, 0.0, math.pi * 0.25, True),
        ({"type": "dome"}, 0.0, math.pi, True),
    ],
    ids=["disk", "sphere", "delta sun", "wide sun", "dome"],
)
def test_irradiance_under_a_light(
    tmp_path: Path, shape: dict, height: float, irradiance: float, seen: bool
) -> None:
    writer = SceneWriter(tmp_path)
    writer.record["materials"] = [constant_material("Matte", albedo=[ALBEDO] * 3)]
    writer.floor()
    # The camera looks under the light, which would be in its way.
    writer.record["camera"] = camera(look_down(0.4))
    above = light(shape, pointing_down(height), radiance=[4.0, 2.0, 1.0], visible_to_camera=seen)
    writer.record["lights"] = [above]
    writer.record["settings"]["samples_per_pixel"] = 1024
    mean = render(writer.write()).reshape(-1, 3).mean(axis=0)
    expected = ALBEDO * irradiance / math.pi * np.array([4.0, 2.0, 1.0])
    np.testing.assert_allclose(mean, expected, rtol=0.01)


def shining_sheet(writer: SceneWriter, height: float, turned: bool) -> None:
    """Add a square of two by two that shines, as UsdPreviewSurface without reflection."""
    materials = writer.record["materials"]
    inputs = {"useSpecularWorkflow": 1.0, "emissiveColor": [4.0, 2.0, 1.0]}
    surface = constant_material("UsdPreviewSurface", diffuseColor=[0.0] * 3, **inputs)
    materials.append(surface)
    corners = [(-1.0, height, -1.0), (-1.0, height, 1.0), (1.0, height, 1.0), (1.0, height, -1.0)]
    writer.chunk(corners[::-1] if turned else corners, [(0, 1, 2), (0, 2, 3)], len(materials) - 1)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("engine", ["path", "hybrid", "bidir", "bidirvm"])
def test_every_engine_finds_what_shines_to_both_sides(
    tmp_path: Path, engine: str, turned: bool
) -> None:
    """From the middle of its side, one above a square of two by two fills 0.554 of the cosines."""
    writer = SceneWriter(tmp_path)
    writer.record["materials"] = [constant_material("Matte", albedo=[ALBEDO] * 3)]
    writer.floor()
    shining_sheet(writer, 1.0, turned)
    writer.record["camera"] = camera(look_down(0.4), screen_window=[-0.02, -0.02, 0.02, 0.02])
    writer.record["settings"] |= {"resolution": [96, 96], "samples_per_pixel": 16, "max_depth": 4}
    mean = render(writer.write(), "--engine", engine).reshape(-1, 3).mean(axis=0)
    covered = 4.0 / math.pi / math.sqrt(2.0) * math.atan(1.0 / math.sqrt(2.0))
    np.testing.assert_allclose(mean, ALBEDO * covered * np.array([4.0, 2.0, 1.0]), rtol=0.02)


@TURNS
def test_dome_and_screen_window_are_where_usd_puts_them(
    tmp_path: Path, world_from_dome: np.ndarray
) -> None:
    writer = SceneWriter(tmp_path)
    add_dome(writer, world_from_dome)
    look_at_it(writer)
    np.testing.assert_allclose(render(writer.write()), seen(world_from_dome), atol=0.005)


@TURNS
@pytest.mark.parametrize("engine", ["path", "bidir"])
def test_dome_lights_from_where_it_is_seen(
    tmp_path: Path, engine: str, world_from_dome: np.ndarray
) -> None:
    writer = SceneWriter(tmp_path)
    writer.record["materials"] = [constant_material("Matte", albedo=[ALBEDO] * 3)]
    writer.floor()
    add_dome(writer, world_from_dome)
    writer.record["settings"]["samples_per_pixel"] = 256
    mean = render(writer.write(), "--engine", engine).reshape(-1, 3).mean(axis=0)
    np.testing.assert_allclose(mean, ALBEDO * mean_over_cosines(world_from_dome), rtol=0.01)


def test_mirror_reflects_its_tint(tmp_path: Path) -> None:
    """In a white furnace a mirror has its tint."""
    writer = SceneWriter(tmp_path)
    tint = [0.9, 0.6, 0.3]
    writer.record["materials"] = [constant_material("Mirror", tint=tint)]
    writer.floor()
    writer.record["lights"] = [light({"type": "dome"}, np.eye(4))]
    writer.record["settings"] |= {"max_depth": 4}
    image = render(writer.write())
    np.testing.assert_allclose(image.reshape(-1, 3).mean(axis=0), tint, rtol=1e-3)


@pytest.mark.parametrize("max_depth", [1, 2])
def test_depth_counts_as_ours(tmp_path: Path, max_depth: int) -> None:
    """In a closed box that shines evenly from a small lamp, each bounce adds its own light."""
    writer = SceneWriter(tmp_path)
    writer.inward_box(constant_material("Matte", albedo=[0.5] * 3))
    lamp = light({"type": "sphere", "radius": 0.01}, np.eye(4), visible_to_camera=False)
    writer.record["lights"] = [lamp | {"radiance": [1e4] * 3}]
    writer.record["settings"] |= {"max_depth": max_depth, "samples_per_pixel": 2048}
    mean = float(render(writer.write()).mean())
    direct = direct_light_of_a_wall()
    if max_depth == 1:
        assert mean == pytest.approx(direct, rel=0.01)
    else:
        assert 1.2 * direct < mean < 1.8 * direct


@pytest.mark.parametrize("engine", ["path", "hybrid", "bidir"])
def test_late_bounces_bring_no_more_than_their_light(tmp_path: Path, engine: str) -> None:
    """A closed box that sends out a fifth and reflects the rest has a radiance of one."""
    writer = SceneWriter(tmp_path)
    inputs = {"useSpecularWorkflow": 1.0, "emissiveColor": [0.2] * 3}
    writer.inward_box(constant_material("UsdPreviewSurface", diffuseColor=[0.8] * 3, **inputs))
    writer.record["settings"] |= {"max_depth": 32, "samples_per_pixel": 256}
    mean = float(render(writer.write(), "--engine", engine).mean())
    assert mean == pytest.approx(1.0 - 0.8**33, rel=0.01)


def direct_light_of_a_wall() -> float:
    """Average what a lamp in the middle gives a wall at distance one, over the wall."""
    x, y = np.meshgrid(*[(np.arange(8) + 0.5) / 4.0 - 1.0] * 2)
    # Finer than a pixel, which is a quarter wide.
    offsets = (np.arange(16) + 0.5) / 64.0 - 0.125
    squares = [(x + a) ** 2 + (y + b) ** 2 + 1.0 for a in offsets for b in offsets]
    cosine_over_square = np.mean([square**-1.5 for square in squares])
    return float(0.5 / math.pi * 1e4 * math.pi * 0.01**2 * cosine_over_square)


def test_says_what_it_does_not_cover(tmp_path: Path) -> None:
    writer = SceneWriter(tmp_path)
    shape = {"type": "cylinder", "radius": 1.0, "length": 1.0}
    writer.record["lights"] = [light(shape, np.eye(4))]
    done = run(writer.write())
    assert done.returncode == 3
    assert "cylinder" in done.stderr
