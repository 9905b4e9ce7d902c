from __future__ import annotations

import math

import pytest
from kilauea.errors import UsageError

CAMERA = 'def Camera "Cam" {{ {} }}'
PLAIN = "float horizontalAperture = 20; float verticalAperture = 10; float focalLength = 20;"


def camera_of(flatten, attributes, **options):
    options.setdefault("resolution", (200, 100))
    return flatten(CAMERA.format(PLAIN + attributes), **options).camera


def test_perspective_window_is_aperture_over_focal_length(flatten):
    camera = camera_of(flatten, "")
    assert camera["projection"] == "perspective"
    assert camera["screen_window"] == [-0.5, -0.25, 0.5, 0.25]
    assert camera["lens_radius"] == 0
    assert camera["clipping_range"] == [1, 1000000]
    assert camera["exposure_scale"] == 1


def test_aperture_offset_moves_the_window(flatten):
    camera = camera_of(flatten, "float horizontalApertureOffset = 5")
    assert camera["screen_window"] == [-0.25, -0.25, 0.75, 0.25]


def test_orthographic_window_is_in_scene_units(flatten):
    camera = camera_of(
        flatten, 'token projection = "orthographic"; float horizontalApertureOffset = 5'
    )
    assert camera["projection"] == "orthographic"
    assert camera["screen_window"] == pytest.approx([-0.5, -0.5, 1.5, 0.5])


def test_lens_and_focus(flatten):
    camera = camera_of(flatten, "float fStop = 2; float focusDistance = 7")
    assert camera["lens_radius"] == pytest.approx(0.1 * 20 / (2 * 2))
    assert camera["focus_distance"] == 7
    off = camera_of(flatten, "float fStop = 2; float focusDistance = 7", depth_of_field=False)
    assert off["lens_radius"] == 0


def test_exposure(flatten):
    assert camera_of(flatten, "float exposure = 1; float exposure:fStop = 2")[
        "exposure_scale"
    ] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("policy", "resolution", "expected"),
    [
        ("expandAperture", (100, 100), [-0.5, -0.5, 0.5, 0.5]),
        ("expandAperture", (400, 100), [-1, -0.25, 1, 0.25]),
        ("cropAperture", (100, 100), [-0.25, -0.25, 0.25, 0.25]),
        ("cropAperture", (400, 100), [-0.5, -0.125, 0.5, 0.125]),
        ("adjustApertureWidth", (100, 100), [-0.25, -0.25, 0.25, 0.25]),
        ("adjustApertureWidth", (400, 100), [-1, -0.25, 1, 0.25]),
        ("adjustApertureHeight", (100, 100), [-0.5, -0.5, 0.5, 0.5]),
        ("adjustApertureHeight", (400, 100), [-0.5, -0.125, 0.5, 0.125]),
        ("adjustPixelAspectRatio", (100, 100), [-0.5, -0.25, 0.5, 0.25]),
    ],
)
def test_conform_policies(flatten, policy, resolution, expected):
    frame = flatten(
        CAMERA.format(PLAIN)
        + f"""def RenderSettings "S" {{
            uniform token aspectRatioConformPolicy = "{policy}"
            uniform int2 resolution = {resolution} }}""",
        settings="/S",
    )
    assert frame.camera["screen_window"] == pytest.approx(expected)
    squeeze = 2 if policy == "adjustPixelAspectRatio" else 1
    assert frame.settings["pixel_aspect_ratio"] == pytest.approx(squeeze)


def test_scale_leaves_the_camera_rigid(flatten):
    camera = camera_of(
        flatten,
        """float3 xformOp:scale = (3, 3, 3); double3 xformOp:translate = (1, 2, 3)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]""",
    )
    assert camera["world_from_camera"] == [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]


def test_which_camera(flatten):
    two = 'def Camera "First" {} def Xform "X" { def Camera "main_cam" {} }'
    assert flatten(two).camera["path"] == "/X/main_cam"
    assert flatten(two, camera="First").camera["path"] == "/First"
    assert flatten(two, camera="/First").camera["path"] == "/First"
    assert flatten('def Camera "A" {} def Camera "B" {}').camera["path"] == "/A"
    settings = two + 'def RenderSettings "S" { rel camera = </First> }'
    assert flatten(settings, settings="/S").camera["path"] == "/First"
    with pytest.raises(UsageError, match="/Nowhere"):
        flatten(two, camera="/Nowhere")


@pytest.mark.parametrize("up", ["Y", "Z"])
def test_default_framing_sees_the_whole_stage_from_the_front(flatten, up):
    frame = flatten(
        'def Cube "C" { double size = 2 }', header=f'upAxis = "{up}"', resolution=(100, 100)
    )
    m = frame.camera["world_from_camera"]
    eye, backward, upward = m[12:15], m[8:11], m[4:7]
    front = [0, 0, 1] if up == "Y" else [0, -1, 0]
    assert backward == pytest.approx(front, abs=1e-9)
    assert upward == pytest.approx([0, 1, 0] if up == "Y" else [0, 0, 1], abs=1e-9)
    distance = math.dist(eye, (0, 0, 0))
    assert eye == pytest.approx([distance * c for c in front])
    # The front face, one unit nearer, fills the window but for the margin.
    half = frame.camera["screen_window"][2] * (distance - 1)
    assert 1 < half < 1.2
    assert any("no camera" in n for n in frame.notes)


def test_default_light_only_where_nothing_shines(flatten):
    (light,) = flatten('def Sphere "S" {}').lights
    assert light["shape"] == {"type": "dome"}
    assert light["radiance"] == [1, 1, 1]
    lit = flatten('def Sphere "S" {} def SphereLight "L" {}')
    assert [x["path"] for x in lit.lights] == ["/L"]


def test_a_shutter_that_closes_first_is_said(flatten):
    backwards = CAMERA.format("double shutter:open = 0.5; double shutter:close = 0.25")
    frame = flatten(backwards)
    assert frame.warnings == ["/Cam: the shutter closes before it opens: no blur"]
    assert frame.camera["shutter"] == [0, 0]
    assert flatten(backwards, motion_blur=False).warnings == []
