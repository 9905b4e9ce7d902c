from __future__ import annotations

import pytest
from kilauea.payload import ALL_RAYS, CAMERA_RAYS, INDIRECT_RAYS, SHADOW_RAYS

HAIR = """
def BasisCurves "Hair" {
    uniform token type = "cubic"
    uniform token basis = "bspline"
    uniform token wrap = "pinned"
    int[] curveVertexCounts = [3]
    point3f[] points = [(0, 0, 0), (0, 1, 0), (0, 2, 0)]
    EXTRA
}
"""
DUST = """
def Points "Dust" {
    point3f[] points = [(0, 0, 0), (1, 0, 0)]
    int64[] ids = [7, 9]
    EXTRA
}
"""
QUAD = """
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
"""


def test_curves_pass_as_authored(flatten):
    extra = """float[] widths = [0.1] (interpolation = "constant")
        color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "uniform")"""
    frame = flatten(HAIR.replace("EXTRA", extra))
    (hair,) = frame.curves
    assert (hair.curve_type, hair.basis, hair.wrap) == ("cubic", "bspline", "pinned")
    assert hair.curve_vertex_counts.tolist() == [3]
    assert hair.points.tolist() == [[0, 0, 0], [0, 1, 0], [0, 2, 0]]
    assert (hair.widths.interpolation, hair.widths.values.size) == ("constant", 1)
    assert hair.normals is None
    assert [p.name for p in hair.primvars] == ["displayColor"]
    assert frame.warnings == []


def test_widths_without_interpolation_are_per_vertex(flatten):
    (hair,) = flatten(HAIR.replace("EXTRA", "float[] widths = [1, 2, 3]")).curves
    assert hair.widths.interpolation == "vertex"
    (bare,) = flatten(HAIR.replace("EXTRA", "")).curves
    assert bare.widths is None


def test_the_primvar_wins_over_widths(flatten):
    extra = """float[] widths = [1, 2]
        float[] primvars:widths = [5] (interpolation = "constant")"""
    (dust,) = flatten(DUST.replace("EXTRA", extra)).points
    assert dust.widths.values.tolist() == [5]


def test_normals_are_read(flatten):
    extra = 'normal3f[] normals = [(0, 0, 1)] (interpolation = "constant")'
    (hair,) = flatten(HAIR.replace("EXTRA", extra)).curves
    assert hair.normals.values.tolist() == [0, 0, 1]
    frame = flatten(DUST.replace("EXTRA", extra))
    assert frame.warnings == ["Points with normals are drawn as spheres, not as discs (/Dust)"]


def test_points_pass_as_authored(flatten):
    (dust,) = flatten(DUST.replace("EXTRA", "float[] widths = [2, 3]")).points
    assert dust.points.tolist() == [[0, 0, 0], [1, 0, 0]]
    assert (dust.widths.interpolation, dust.widths.values.tolist()) == ("vertex", [2, 3])


def test_a_stage_of_hair_is_framed_with_its_widths(flatten):
    def distance(widths):
        frame = flatten(HAIR.replace("EXTRA", f"float[] widths = {widths}"))
        assert frame.camera["world_from_camera"][13] == pytest.approx(1)
        return frame.camera["focus_distance"]

    assert distance("[8, 1, 1]") > 4 * distance("[0, 0, 0]")


@pytest.mark.parametrize(
    ("primvars", "expected"),
    [
        ("", ALL_RAYS),
        ("bool primvars:arnold:visibility:camera = 0", SHADOW_RAYS | INDIRECT_RAYS),
        ("bool primvars:arnold:visibility:shadow = 0", CAMERA_RAYS | INDIRECT_RAYS),
        ("uchar primvars:arnold:visibility = 1", CAMERA_RAYS),
        ("int primvars:ri:attributes:visibility:indirect = 0", CAMERA_RAYS | SHADOW_RAYS),
        ("int primvars:ri:attributes:visibility:transmission = 0", CAMERA_RAYS | INDIRECT_RAYS),
        ('string primvars:karma:object:rendervisibility = "*"', ALL_RAYS),
        (
            'string primvars:karma:object:rendervisibility = "-primary"',
            SHADOW_RAYS | INDIRECT_RAYS,
        ),
        (
            'string primvars:karma:object:rendervisibility = "* ^shadow"',
            CAMERA_RAYS | INDIRECT_RAYS,
        ),
        (
            'string primvars:karma:object:rendervisibility = "primary | shadow"',
            CAMERA_RAYS | SHADOW_RAYS,
        ),
    ],
)
def test_ray_visibility_is_inherited(flatten, primvars, expected):
    frame = flatten(f'def Xform "X" {{ {primvars}; def Mesh "M" {{ {QUAD} }} }}')
    assert frame.meshes[0].visibility == expected
    assert frame.warnings == []


def test_a_part_of_the_scattered_rays_is_said(flatten):
    hidden = "bool primvars:arnold:visibility:specular_reflect = 0"
    frame = flatten(f'def Mesh "M" {{ {QUAD} {hidden} }}')
    assert frame.meshes[0].visibility == ALL_RAYS
    assert frame.warnings == ["visible to some scattered rays only: visible to all of them (/M)"]


def test_what_no_ray_meets_is_left_out(flatten):
    hidden = 'string primvars:karma:object:rendervisibility = ""'
    assert flatten(f'def Mesh "M" {{ {QUAD} {hidden} }}').meshes == []


def test_lights_can_be_hidden_from_the_camera(flatten):
    frame = flatten(
        """def SphereLight "A" {int primvars:ri:attributes:visibility:camera = 0}
        def SphereLight "B" {}"""
    )
    assert [light["visible_to_camera"] for light in frame.lights] == [False, True]


def test_instances_hide_their_contents(flatten):
    frame = flatten(
        f"""def Xform "Asset" {{ def Mesh "M" {{ {QUAD} }} }}
        def Xform "I" (instanceable = true; references = </Asset>) {{
            bool primvars:arnold:visibility:camera = 0 }}"""
    )
    assert frame.instances[0].visibility == SHADOW_RAYS | INDIRECT_RAYS
