"""Mitsuba, as set up here, against closed forms."""

from __future__ import annotations

import math
import os
import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from scene_writer import SceneWriter, camera, constant_material, light, look_down, pointing_down

CACHE = Path(os.environ.get("KILAUEA_CACHE", Path.home() / ".cache/kilauea"))
PYTHON = Path(os.environ.get("KILAUEA_MITSUBA_PYTHON", CACHE / "mitsuba-env/bin/python"))
SCRIPT = Path(__file__).parents[1] / "mitsuba_render.py"
CYCLES_PYTHON = Path(os.environ.get("KILAUEA_REFERENCE_PYTHON", CACHE / "reference-env/bin/python"))
CYCLES_SCRIPT = Path(__file__).parents[1] / "cycles_render.py"
ALBEDO = 0.8

pytestmark = pytest.mark.skipif(
    not PYTHON.exists(), reason="no Mitsuba: `kilauea bench` has not made its environment yet"
)


def run(
    folder: Path, python: Path = PYTHON, script: Path = SCRIPT
) -> subprocess.CompletedProcess[str]:
    command = [str(python), str(script), str(folder), str(folder / "out.exr")]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def render(folder: Path, *engine: Path) -> np.ndarray:
    done = run(folder, *engine)
    if done.returncode != 0 and "LLVM ERROR" in done.stdout + done.stderr:
        pytest.skip("the LLVM here is too old for Mitsuba")
    assert done.returncode == 0, done.stdout + done.stderr
    return oiio.ImageBuf(str(folder / "out.exr")).get_pixels(oiio.FLOAT)[..., :3]


@pytest.mark.parametrize(
    ("shape", "height", "irradiance"),
    [
        ({"type": "disk", "radius": 0.5}, 1.0, math.pi * 0.25 / 1.25),
        ({"type": "sphere", "radius": 0.5}, 2.0, math.pi * 0.25 / 4.0),
        ({"type": "distant", "angle_degrees": 0.0}, 0.0, 1.0),
        ({"type": "dome"}, 0.0, math.pi),
    ],
    ids=["disk", "sphere", "delta sun", "dome"],
)
def test_irradiance_under_a_light(
    tmp_path: Path, shape: dict, height: float, irradiance: float
) -> None:
    writer = SceneWriter(tmp_path)
    writer.record["materials"] = [constant_material("Matte", albedo=[ALBEDO] * 3)]
    writer.floor()
    # The camera looks under the light, which would be in its way.
    view = look_down(0.4)
    writer.record["camera"] = camera(view)
    writer.record["lights"] = [light(shape, pointing_down(height), radiance=[4.0, 2.0, 1.0])]
    writer.record["settings"]["samples_per_pixel"] = 1024
    mean = render(writer.write()).reshape(-1, 3).mean(axis=0)
    expected = ALBEDO * irradiance / math.pi * np.array([4.0, 2.0, 1.0])
    np.testing.assert_allclose(mean, expected, rtol=0.005)


@pytest.mark.skipif(not CYCLES_PYTHON.exists(), reason="no Blender to compare with")
@pytest.mark.parametrize("max_depth", [1, 2, 6])
def test_agrees_with_cycles_on_interreflection(tmp_path: Path, max_depth: int) -> None:
    writer = SceneWriter(tmp_path)
    writer.inward_box(constant_material("Matte", albedo=[0.9, 0.6, 0.3]))
    lamp = light({"type": "disk", "radius": 0.1}, pointing_down(0.999), radiance=[80.0] * 3)
    writer.record["lights"] = [lamp]
    # Mitsuba's lamp is black and in the way, which is why it is small.
    writer.record["settings"] |= {"max_depth": max_depth, "samples_per_pixel": 4096}
    means = []
    for python, script in ((PYTHON, SCRIPT), (CYCLES_PYTHON, CYCLES_SCRIPT)):
        image = render(writer.write(), python, script)
        means.append(image.reshape(-1, 3).mean(axis=0))
    np.testing.assert_allclose(means[0], means[1], rtol=0.01)


def test_screen_window(tmp_path: Path) -> None:
    writer = SceneWriter(tmp_path)
    writer.record["materials"] = [
        constant_material("UsdPreviewSurface", diffuseColor=[0.0] * 3, emissiveColor=[1.0] * 3)
    ]
    # x from 0 to 1 and z from 0 down to -1, which is up in the image.
    writer.chunk([(0, 0, 0), (1, 0, 0), (1, 0, -1), (0, 0, -1)], [(0, 1, 2), (0, 2, 3)])
    writer.record["camera"] = camera(look_down(1.0), screen_window=[-0.5, -1.5, 1.5, 0.5])
    image = render(writer.write())
    expected = np.zeros((8, 8, 3))
    expected[:2, 2:6] = 1.0
    np.testing.assert_allclose(image, expected, atol=1e-3)


def test_mirror_reflects_its_tint(tmp_path: Path) -> None:
    """In a white furnace a mirror has its tint."""
    writer = SceneWriter(tmp_path)
    tint = [0.9, 0.6, 0.3]
    writer.record["materials"] = [constant_material("Mirror", tint=tint)]
    writer.floor()
    writer.record["lights"] = [light({"type": "dome"}, np.eye(4))]
    image = render(writer.write())
    np.testing.assert_allclose(image.reshape(-1, 3).mean(axis=0), tint, rtol=1e-3)


def test_glass_passes_and_reflects_all_light(tmp_path: Path) -> None:
    """In a white furnace a pane of glass cannot be seen."""
    writer = SceneWriter(tmp_path)
    writer.record["materials"] = [constant_material("Glass", ior=1.5)]
    writer.floor()
    below = [(-1, -0.1, 1), (1, -0.1, 1), (1, -0.1, -1), (-1, -0.1, -1)]
    writer.chunk(below, [(0, 2, 1), (0, 3, 2)])
    writer.record["lights"] = [light({"type": "dome"}, np.eye(4))]
    writer.record["settings"] |= {"max_depth": 32}
    np.testing.assert_allclose(render(writer.write()).mean(), 1.0, rtol=0.01)


def test_says_what_it_does_not_cover(tmp_path: Path) -> None:
    writer = SceneWriter(tmp_path)
    shape = {"type": "cylinder", "radius": 1.0, "length": 1.0}
    writer.record["lights"] = [light(shape, np.eye(4))]
    done = run(writer.write())
    assert done.returncode == 3
    assert "cylinder" in done.stderr
