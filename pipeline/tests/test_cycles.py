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
    camera,
    column_major,
    constant_material,
    light,
    look_down,
    pointing_down,
)
from turned_dome import TURNS, add_dome, look_at_it, mean_over_cosines, seen

CACHE = Path(os.environ.get("KILAUEA_CACHE", Path.home() / ".cache/kilauea"))
PYTHON = Path(os.environ.get("KILAUEA_REFERENCE_PYTHON", CACHE / "reference-env/bin/python"))
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


def check(image: np.ndarray, expected: float | list[float] | np.ndarray) -> None:
    mean = image.reshape(-1, 3).mean(axis=0)
    np.testing.assert_allclose(mean, np.broadcast_to(expected, 3), rtol=TOLERANCE)


@pytest.fixture
def plane(tmp_path: Path) -> SceneWriter:
    writer = SceneWriter(tmp_path)
    writer.record["materials"] = [constant_material("Matte", albedo=[ALBEDO] * 3)]
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


@pytest.mark.parametrize("max_depth", [1, 2, 5])
def test_depth_counts_the_bounce_toward_the_light(tmp_path: Path, max_depth: int) -> None:
    writer = SceneWriter(tmp_path)
    writer.inward_box(constant_material("Matte", albedo=[0.5] * 3))
    # Each wall shines through a light just in front of it, which lets everything else pass.
    panel = {"type": "rect", "width": 2.0, "height": 2.0}
    for axis in range(3):
        for sign in (-1.0, 1.0):
            matrix = np.roll(np.eye(3), axis + 1, axis=0)
            matrix[:, 2] *= sign
            matrix[:, 0] *= sign
            placed = np.eye(4)
            placed[:3, :3] = matrix
            placed[:3, 3] = 0.9999 * matrix[:, 2]
            writer.record["lights"].append(light(panel, placed, radiance=[0.5] * 3))
    writer.record["settings"] |= {"max_depth": max_depth, "samples_per_pixel": 1024}
    # Emission 1/2 and albedo 1/2: the geometric series, cut after max_depth + 1 terms.
    check(render(writer.write()), 1.0 - 0.5 ** (max_depth + 1))


@pytest.mark.parametrize("shape", ["disk", "sphere"])
def test_shaping(plane: SceneWriter, shape: str) -> None:
    """A small light that points 30 degrees past the point on the floor below it."""
    tilt = math.radians(30.0)
    spin = np.eye(4)
    spin[:2, :2] = [[math.cos(tilt), -math.sin(tilt)], [math.sin(tilt), math.cos(tilt)]]
    matrix = distance(1.0) @ spin @ pointing_down()
    shaping = {
        "cone_angle_degrees": 45.0,
        "cone_softness": 0.75,
        "focus": 3.0,
        "focus_tint": [0.0, 0.5, 1.0],
    }
    plane.record["lights"] = [light({"type": shape, "radius": 0.001}, matrix, shaping=shaping)]
    plane.record["lights"][0]["radiance"] = [1e6] * 3
    start = 0.25 * 45.0
    t = (30.0 - start) / (45.0 - start)
    cone = 1.0 - t * t * (3.0 - 2.0 * t)
    focus = math.cos(tilt) ** 3
    facing = math.cos(tilt) if shape == "disk" else 1.0
    levels = [focus, 0.5 * focus + 0.5, 1.0]
    expected = [ALBEDO * 1e6 * 1e-6 * facing * cone * level for level in levels]
    check(render(plane.write()), expected)


def emitter(writer: SceneWriter, colour: list[float]) -> int:
    """Add a black surface that shines; returns its index."""
    writer.record["materials"].append(
        constant_material(
            "UsdPreviewSurface", diffuseColor=[0.0] * 3, ior=1.0, emissiveColor=colour
        )
    )
    return len(writer.record["materials"]) - 1


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_screen_window_and_data_window(tmp_path: Path, projection: str) -> None:
    """A glowing quarter of the plane shows where each edge of an off-centre window lies."""
    writer = SceneWriter(tmp_path)
    bright = emitter(writer, [1.0] * 3)
    # x from 0 to 1 and z from 0 down to -1, which is up in the image.
    writer.chunk([(0, 0, 0), (1, 0, 0), (1, 0, -1), (0, 0, -1)], [(0, 1, 2), (0, 2, 3)], bright)
    writer.record["camera"] = camera(
        look_down(1.0), projection=projection, screen_window=[-0.5, -0.75, 1.5, 0.25]
    )
    # Pixels are 1/4 wide and 1/8 high; the data window is two columns and four rows larger.
    writer.record["settings"] |= {"resolution": [8, 8], "pixel_aspect_ratio": 2.0}
    writer.record["settings"]["data_window"] = {"min": [-2, -4], "max": [10, 6]}
    image = render(writer.write())
    expected = np.zeros((10, 12, 1))
    expected[:6, 4:8] = 1.0
    np.testing.assert_allclose(image, np.broadcast_to(expected, image.shape), atol=1e-3)


def test_lights_are_seen_or_not(tmp_path: Path) -> None:
    for kind in ({"type": "rect", "width": 1.0, "height": 1.0}, {"type": "sphere", "radius": 0.5}):
        for visible in (True, False):
            writer = SceneWriter(tmp_path / f"{kind['type']}{visible}")
            up = np.diag([1.0, -1.0, -1.0, 1.0]) @ pointing_down()
            writer.record["lights"] = [
                light(kind, up, radiance=[3.0, 2.0, 1.0], visible_to_camera=visible)
            ]
            expected = [3.0, 2.0, 1.0] if visible else [0.0] * 3
            check(render(writer.write(), "--samples", "4"), expected)


def test_instances_far_from_the_origin(tmp_path: Path) -> None:
    """Nested instances whose offsets cancel only in double precision."""
    far = 4.0e7
    writer = SceneWriter(tmp_path)
    writer.record["origin_world"] = [far, 0.0, 0.0]
    writer.record["prototypes"][0]["center"] = [far, 0.0, 0.0]
    bright = emitter(writer, [1.0] * 3)
    writer.prototype("/outer", center=(far, 0.0, 0.0))
    writer.prototype("/inner", center=(0.0, 7.0, 0.0))
    corners = [(-1, -7, 0), (1, -7, 0), (0, -7, -2)]
    writer.chunk(corners, [(0, 1, 2)], bright, prototype=2)
    shift = np.eye(4)
    shift[0, 3] = far
    writer.record["prototypes"][1]["instances"] = [
        {"prototype": 2, "matrices": writer.array([column_major(shift)], "<f8"), "attributes": []}
    ]
    half = np.diag([0.5, 0.5, 0.5, 1.0])
    half[0, 3] = 0.5 * far
    writer.record["prototypes"][0]["instances"] = [
        {"prototype": 1, "matrices": writer.array([column_major(half)], "<f8"), "attributes": []}
    ]
    view = look_down(1.0)
    view[0, 3] = far
    writer.record["camera"] = camera(view, screen_window=[-1, -1, 1, 1])
    writer.record["settings"] |= {"resolution": [16, 16], "samples_per_pixel": 256}
    image = render(writer.write())
    # A triangle of base 1 and height 1 in a window of 2 by 2, its base on the middle row.
    assert abs(image[..., 0].mean() - 0.5 / 4.0) < 2e-3
    assert image[8:].max() == 0.0
    assert abs(image[7, 4:12, 0].mean() - 0.9375 * 1.0) < 0.02


def primvar_material(name: str) -> dict:
    return {
        "path": "/primvar",
        "shader": "UsdPreviewSurface",
        "inputs": {
            "diffuseColor": {"node": 1, "channel": "rgb"},
            "emissiveColor": {"node": 0, "channel": "rgb"},
        },
        "nodes": [
            {"type": "primvar", "name": name, "fallback": [0.25, 0.5, 0.75, 1.0]},
            {"type": "constant", "value": [0.0, 0.0, 0.0, 1.0]},
        ],
    }


@pytest.mark.parametrize("interpolation", ["constant", "uniform", "vertex", "missing", "instance"])
def test_primvars(tmp_path: Path, interpolation: str) -> None:
    writer = SceneWriter(tmp_path)
    writer.record["materials"] = [primvar_material("glow")]
    values = {
        "constant": [[1.0, 2.0, 3.0]],
        "uniform": [[1.0, 2.0, 3.0], [9.0, 9.0, 9.0]],
        "vertex": [[1.0, 2.0, 3.0]] * 3 + [[9.0, 9.0, 9.0]],
    }
    attributes = []
    if interpolation in values:
        attributes.append(
            {
                "name": "glow",
                "width": 3,
                "interpolation": interpolation,
                "data": values[interpolation],
            }
        )
    writer.prototype("/floor")
    writer.floor(attributes=tuple(attributes), prototype=1)
    instances = {"prototype": 1, "matrices": writer.array([column_major(np.eye(4))], "<f8")}
    instances["attributes"] = []
    if interpolation == "instance":
        data = writer.array([[4.0, 5.0, 6.0]], "<f4")
        instances["attributes"] = [{"name": "glow", "width": 3, "data": data}]
    writer.record["prototypes"][0]["instances"] = [instances]
    # Looks at the first triangle, (-1, 1) (1, 1) (1, -1) in x and z.
    view = look_down()
    view[0, 3], view[2, 3] = 0.5, 0.5
    writer.record["camera"] = camera(view)
    expected = {"missing": [0.25, 0.5, 0.75], "instance": [4.0, 5.0, 6.0]}
    image = render(writer.write(), "--samples", "4")
    check(image, expected.get(interpolation, [1.0, 2.0, 3.0]))


CORNERS = np.float32([[[1, 0, 0], [0, 2, 0]], [[0, 0, 3], [4, 4, 4]]])
"""Lower left, lower right, upper left, upper right."""


def textured(
    writer: SceneWriter,
    texture: int,
    lookup: dict | None = None,
    transform: dict | None = None,
) -> None:
    """Cover a floor from -1 to 1 with an image that glows; the records change the defaults."""
    lookup = {
        "type": "uv_texture",
        "texture": texture,
        "st": 1,
        "wrap_s": "clamp",
        "wrap_t": "clamp",
        "scale": [1.0] * 4,
        "bias": [0.0] * 4,
        "fallback": [0.0] * 4,
    } | (lookup or {})
    transform = {
        "type": "transform2d",
        "input": 0,
        "scale": [1.0, 1.0],
        "rotation_degrees": 0.0,
        "translation": [0.0, 0.0],
    } | (transform or {})
    material = primvar_material("st")
    material["nodes"][1:] = [
        transform,
        lookup,
        {"type": "constant", "value": [0.0, 0.0, 0.0, 1.0]},
    ]
    material["inputs"]["diffuseColor"]["node"] = 3
    material["inputs"]["emissiveColor"]["node"] = 2
    writer.record["materials"] = [material]
    st = {"name": "st", "width": 2, "interpolation": "vertex"}
    writer.floor(attributes=(st | {"data": [(0, 0), (1, 0), (1, 1), (0, 1)]},))
    writer.record["camera"] = camera(look_down(1.0), screen_window=[-1, -1, 1, 1])
    writer.record["settings"] |= {"resolution": [32, 32], "samples_per_pixel": 4}


def corners_of(image: np.ndarray) -> np.ndarray:
    """The corner pixels, lowest row first."""
    return image[[-1, 0]][:, [0, -1]]


def test_textures_are_upright(tmp_path: Path) -> None:
    writer = SceneWriter(tmp_path)
    levels = {"scale": [2.0] * 4, "bias": [0.5] * 4}
    textured(writer, writer.texture((0, CORNERS)), levels)
    image = render(writer.write())
    np.testing.assert_allclose(corners_of(image), 2.0 * CORNERS + 0.5, rtol=1e-3)


def test_transform2d_turns_coordinates(tmp_path: Path) -> None:
    """A quarter turn counter-clockwise: (s, t) reads (1 - t, s)."""
    writer = SceneWriter(tmp_path)
    turn = {"rotation_degrees": 90.0, "translation": [1.0, 0.0]}
    textured(writer, writer.texture((0, CORNERS)), transform=turn)
    image = render(writer.write())
    (low_left, low_right), (up_left, up_right) = CORNERS
    expected = [[low_right, up_right], [low_left, up_left]]
    np.testing.assert_allclose(corners_of(image), expected, atol=1e-3)


def test_wraps_differ_per_direction(tmp_path: Path) -> None:
    """The coordinates span [-1, 2]: three periods across, black above and below."""
    writer = SceneWriter(tmp_path)
    transform = {"scale": [3.0, 3.0], "translation": [-1.0, -1.0]}
    wraps = {"wrap_s": "mirror", "wrap_t": "black"}
    textured(writer, writer.texture((0, CORNERS)), wraps, transform)
    writer.record["settings"]["resolution"] = [48, 48]
    image = render(writer.write())
    assert image[:15].max() == 0.0
    assert image[33:].max() == 0.0
    np.testing.assert_allclose(
        image[31, [0, 15, 16, 31, 32, 47]], CORNERS[0, [1, 0, 0, 1, 1, 0]], atol=1e-2
    )


def test_black_surrounds_an_image_without_darkening_it(tmp_path: Path) -> None:
    """All of it is read at its lower left corner, as textures without coordinates are."""
    writer = SceneWriter(tmp_path)
    wraps = {"wrap_s": "black", "wrap_t": "black"}
    textured(writer, writer.texture((0, CORNERS)), wraps, {"scale": [0.0, 0.0]})
    image = render(writer.write())
    np.testing.assert_allclose(image.reshape(-1, 3).mean(axis=0), CORNERS[0, 0], atol=1e-3)


def test_udim(tmp_path: Path) -> None:
    writer = SceneWriter(tmp_path)
    tiles = [(1001 + idx, np.full((1, 1, 3), 1.0 + idx)) for idx in (0, 1, 10)]
    textured(writer, writer.texture(*tiles), transform={"scale": [2.0, 2.0]})
    image = render(writer.write())
    np.testing.assert_allclose(corners_of(image)[..., 0], [[1.0, 2.0], [11.0, 0.0]], atol=1e-3)


def test_rect_light_texture_is_upright_where_it_shines(tmp_path: Path) -> None:
    writer = SceneWriter(tmp_path)
    texture = writer.texture((0, CORNERS))
    # Turned about y to face the camera, which looks along -z.
    facing = np.diag([-1.0, 1.0, -1.0, 1.0])
    facing[2, 3] = -1.0
    shape = {"type": "rect", "width": 2.0, "height": 2.0}
    writer.record["lights"] = [light(shape, facing, texture=texture)]
    writer.record["camera"] = camera(np.eye(4), screen_window=[-1, -1, 1, 1])
    writer.record["settings"] |= {"resolution": [32, 32], "samples_per_pixel": 4}
    image = render(writer.write())
    np.testing.assert_allclose(corners_of(image), CORNERS, atol=1e-3)


@TURNS
def test_dome_is_where_usd_puts_it(tmp_path: Path, world_from_dome: np.ndarray) -> None:
    writer = SceneWriter(tmp_path)
    add_dome(writer, world_from_dome)
    look_at_it(writer)
    np.testing.assert_allclose(render(writer.write()), seen(world_from_dome), atol=0.005)


@TURNS
def test_dome_lights_from_where_it_is_seen(plane: SceneWriter, world_from_dome: np.ndarray) -> None:
    add_dome(plane, world_from_dome)
    check(render(plane.write()), ALBEDO * mean_over_cosines(world_from_dome))


def test_exposure_and_emission_of_both_sides(tmp_path: Path) -> None:
    writer = SceneWriter(tmp_path)
    writer.floor(material=emitter(writer, [1.0, 2.0, 3.0]))
    below = np.diag([1.0, -1.0, -1.0, 1.0]) @ look_down()
    for view in (look_down(), below):
        writer.record["camera"] = camera(view, exposure_scale=40.0)
        check(render(writer.write(), "--samples", "4"), [40.0, 80.0, 120.0])


@pytest.mark.parametrize(("ior", "roughness"), [(1.5, 0.0), (1.5, 0.3)])
def test_glass_passes_and_reflects_all_light(tmp_path: Path, ior: float, roughness: float) -> None:
    """In a white furnace a pane of glass cannot be seen."""
    writer = SceneWriter(tmp_path)
    glass = {"opacity": 0.0, "ior": ior, "roughness": roughness}
    writer.record["materials"] = [constant_material("UsdPreviewSurface", **glass)]
    writer.floor()
    writer.chunk([(-1, -0.1, 1), (1, -0.1, 1), (1, -0.1, -1)], [(0, 2, 1)])
    writer.record["lights"] = [light({"type": "dome"}, np.eye(4))]
    writer.record["settings"] |= {"max_depth": 32}
    check(render(writer.write()), 1.0)


@pytest.mark.parametrize("mode", [0.0, 1.0])
def test_opacity_modes(tmp_path: Path, mode: float) -> None:
    """A black surface without opacity keeps its highlight when transparent, not in presence."""
    writer = SceneWriter(tmp_path)
    surface = {"diffuseColor": [0.0] * 3, "opacity": 0.0, "opacityMode": mode, "roughness": 0.0}
    writer.record["materials"] = [constant_material("UsdPreviewSurface", **surface)]
    writer.floor()
    # Above the floor alone is light.
    above = distance(10.0) @ pointing_down()
    shape = {"type": "rect", "width": 30.0, "height": 30.0}
    writer.record["lights"] = [light(shape, above, visible_to_camera=False)]
    reflected = ((1.5 - 1.0) / (1.5 + 1.0)) ** 2
    image = render(writer.write())
    np.testing.assert_allclose(image.mean(), (1.0 - mode) * reflected, atol=2e-3)


@pytest.mark.parametrize("angle", [60.0, 0.5])
def test_metal_mirrors_the_sun(tmp_path: Path, angle: float) -> None:
    """A camera at 45 degrees to a mirror sees the sun's radiance, tinted alike at all angles."""
    writer = SceneWriter(tmp_path)
    gold = [0.9, 0.6, 0.3]
    surface = {"diffuseColor": gold, "metallic": 1.0, "roughness": 0.0}
    writer.record["materials"] = [constant_material("UsdPreviewSurface", **surface)]
    writer.floor()
    half = math.sqrt(0.5)
    view = np.eye(4)
    view[:3, 1] = (0.0, half, -half)
    view[:3, 2] = (0.0, half, half)
    view[:3, 3] = (0.0, 2.0, 2.0)
    toward_sun = np.eye(4)
    toward_sun[:3, 1] = (0.0, half, half)
    toward_sun[:3, 2] = (0.0, half, -half)
    sun = {"type": "distant", "angle_degrees": angle}
    writer.record["lights"] = [light(sun, toward_sun, visible_to_camera=False)]
    writer.record["camera"] = camera(view, screen_window=[-1e-4, -1e-4, 1e-4, 1e-4])
    check(render(writer.write()), gold)


@pytest.mark.parametrize(("tint", "roughness"), [([0.9, 0.6, 0.3], 0.0), ([1.0] * 3, 0.5)])
def test_mirrors_reflect_their_tint(tmp_path: Path, tint: list[float], roughness: float) -> None:
    """In a white furnace a mirror has its tint; a rough one that is white stays white."""
    writer = SceneWriter(tmp_path)
    writer.record["materials"] = [constant_material("Mirror", tint=tint, roughness=roughness)]
    writer.floor()
    writer.record["lights"] = [light({"type": "dome"}, np.eye(4))]
    check(render(writer.write()), tint)


def test_glass_tints_what_it_refracts(tmp_path: Path) -> None:
    """Seen straight on, what is under the boundary is tinted and what is above is not."""
    writer = SceneWriter(tmp_path)
    tint = [0.9, 0.5, 0.0]
    writer.record["materials"] = [constant_material("Glass", tint=tint, ior=1.5)]
    writer.floor()
    writer.record["lights"] = [light({"type": "dome"}, np.eye(4))]
    check(render(writer.write()), [0.04 + 0.96 * channel for channel in tint])


@pytest.mark.parametrize("textured_metallic", [False, True])
def test_part_metals_reflect_as_specified(tmp_path: Path, *, textured_metallic: bool) -> None:
    """Seen straight on, half a metal has the product of two interpolations, not a mean of two."""
    writer = SceneWriter(tmp_path)
    gold = [0.9, 0.6, 0.3]
    surface = {"diffuseColor": gold, "metallic": 0.5, "roughness": 0.0, "ior": 1.5}
    material = constant_material("UsdPreviewSurface", **surface)
    if textured_metallic:
        half = {"type": "primvar", "name": "half", "fallback": [0.5, 0.0, 0.0, 1.0]}
        material["nodes"][material["inputs"]["metallic"]["node"]] = half
    writer.record["materials"] = [material]
    writer.floor()
    sun = {"type": "distant", "angle_degrees": 0.5}
    writer.record["lights"] = [light(sun, pointing_down(), visible_to_camera=False)]
    writer.record["camera"] = camera(look_down(), screen_window=[-1e-4, -1e-4, 1e-4, 1e-4])
    share = 0.5 * 0.04 + 0.5 * 1.0
    check(render(writer.write()), [share * (0.5 + 0.5 * channel) for channel in gold])


def test_encoded_texels_are_decoded_before_interpolation(tmp_path: Path) -> None:
    """Between black and white there is one half of the light."""
    writer = SceneWriter(tmp_path)
    ends = np.repeat(np.float32([[[0.0], [255.0]]]), 3, axis=2)
    textured(writer, writer.texture((0, ends), element="u1", transfer=1))
    image = render(writer.write(), "--samples", "64")
    np.testing.assert_allclose(image[:, 15:17].mean(), 0.5, rtol=1e-2)


def test_batches_are_renders_with_seeds_of_their_own(plane: SceneWriter) -> None:
    """The second batch is what the next seed gives alone."""
    plane.record["lights"] = [light({"type": "sphere", "radius": 0.5}, distance(1.0))]
    folder = plane.write()
    command = [str(PYTHON), str(SCRIPT), str(folder), str(folder / "out.exr"), "--samples", "4"]
    for flags in (["--seed", "3", "--batches", "2"], ["--seed", "4"]):
        subprocess.run([*command, *flags], capture_output=True, check=True)
    first, second, alone = (
        oiio.ImageBuf(str(folder / name)).get_pixels(oiio.FLOAT)
        for name in ("out.0.exr", "out.1.exr", "out.exr")
    )
    assert (second == alone).all()
    assert (first != second).any()
