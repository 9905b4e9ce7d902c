"""The unit of length of a stage: what it is called changes nothing, what it is hardly anything."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("kilauea._native")

from kilauea.benchmarks import needs
from kilauea.render import native
from kilauea.usd.options import FlattenOptions
from kilauea.usd.stage import flatten

METERS_PER_LIGHT_YEAR = 9.4607e15


def room(units_per_meter: float) -> str:
    """A ball in a corner under a lamp, a few meters across."""
    u = units_per_meter

    def square(name: str, *corners: tuple[float, float, float]) -> str:
        points = ", ".join(f"({x * u!r}, {y * u!r}, {z * u!r})" for x, y, z in corners)
        return f"""def Mesh "{name}" {{ uniform token subdivisionScheme = "none"
            point3f[] points = [{points}]
            int[] faceVertexCounts = [4]; int[] faceVertexIndices = [0, 1, 2, 3]
            color3f[] primvars:displayColor = [(0.7, 0.6, 0.5)] }}"""

    floor = square("Floor", (-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2))
    wall = square("Wall", (-2, 0, -2), (2, 0, -2), (2, 4, -2), (-2, 4, -2))
    return f"""{floor} {wall}
        def Sphere "Ball" {{ double radius = {0.5 * u!r}
            double3 xformOp:translate = (0, {0.5 * u!r}, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"] }}
        def RectLight "Lamp" {{ float inputs:width = {u!r}; float inputs:height = {u!r}
            float inputs:intensity = 20
            double3 xformOp:translate = (0, {3.0 * u!r}, 0)
            float xformOp:rotateX = -90
            uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"] }}
        def Camera "Camera" {{ float horizontalAperture = 20; float verticalAperture = 20
            float focalLength = 25; float2 clippingRange = ({0.01 * u!r}, {100.0 * u!r})
            double3 xformOp:translate = (0, {1.2 * u!r}, {4.0 * u!r})
            uniform token[] xformOpOrder = ["xformOp:translate"] }}"""


@pytest.fixture
def picture(write_stage):
    """Render a stage and return red, green, blue and alpha."""

    def render(body: str, meters_per_unit: float):
        header = f"metersPerUnit = {meters_per_unit!r}"
        frame = flatten(str(write_stage(body, header=header)), FlattenOptions(resolution=(48, 48)))
        scene = native().build_scene(frame, json.dumps({"resolution": [48, 48]}))
        settings = {"samples_per_pixel": 16, "threads": 1, "filter": "box"}
        stats, pixels = needs.render(frame, scene, settings)
        assert stats["warnings"] == []
        assert stats["invalid_rays"] == stats["invalid_samples"] == 0
        assert pixels[..., :3].mean() > 0.05
        return pixels[..., :4]

    return render


@pytest.mark.parametrize("meters_per_unit", [1e-3, METERS_PER_LIGHT_YEAR])
def test_the_name_of_a_unit_changes_nothing(picture, meters_per_unit):
    body = room(1.0)
    assert np.array_equal(picture(body, 1.0), picture(body, meters_per_unit))


@pytest.mark.parametrize("meters_per_unit", [1e-3, 1e-8, 1e3, 1e8])
def test_a_room_looks_alike_in_any_unit(picture, meters_per_unit):
    """Hundredths of a micrometer to a quarter of the way to the moon: equal but for rounding."""
    difference = picture(room(1.0 / meters_per_unit), meters_per_unit) - picture(room(1.0), 1.0)
    assert np.abs(difference).max() < 1e-5
