from __future__ import annotations

import numpy as np
import pytest
from conftest import material_path, translation

QUAD = """
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
"""
POLYGONS = 'uniform token subdivisionScheme = "none";'

TEXTURED = """
def Material "Textured" {
    token outputs:surface.connect = </Textured/Surface.outputs:surface>
    def Shader "Surface" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </Textured/Reader.outputs:result>
        token outputs:surface
    }
    def Shader "Reader" {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "paint"
        float3 outputs:result
    }
}
def Material "Plain" {
    token outputs:surface.connect = </Plain/Surface.outputs:surface>
    def Shader "Surface" {
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
    }
}
"""


def test_arrays_pass_as_authored(flatten):
    frame = flatten(f'def Mesh "M" {{ {QUAD} {POLYGONS} int[] holeIndices = [0] }}')
    (mesh,) = frame.meshes
    assert mesh.path == "/M"
    assert mesh.points.dtype == np.float32
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert mesh.face_vertex_counts.tolist() == [4]
    assert mesh.face_vertex_indices.tolist() == [0, 1, 2, 3]
    assert mesh.hole_indices.tolist() == [0]
    assert mesh.subdivision is None
    assert mesh.normals is None


def test_nonsense_is_passed_on(flatten):
    frame = flatten(
        f"""def Mesh "M" {{ {POLYGONS}
            point3f[] points = [(nan, 0, 0)]
            int[] faceVertexCounts = [3, -1]
            int[] faceVertexIndices = [0, 7] }}"""
    )
    (mesh,) = frame.meshes
    assert np.isnan(mesh.points[0, 0])
    assert mesh.face_vertex_counts.tolist() == [3, -1]
    assert mesh.face_vertex_indices.tolist() == [0, 7]


def test_transforms_pass_through_typeless_prims(flatten):
    frame = flatten(
        f"""def Xform "A" {{
            double3 xformOp:translate = (1, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
            def "Typeless" {{
                def Mesh "M" {{ {QUAD}
                    double3 xformOp:translate = (0, 2, 0)
                    float3 xformOp:scale = (2, 2, 2)
                    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"] }}
                def Mesh "Reset" {{ {QUAD}
                    double3 xformOp:translate = (0, 5, 0)
                    uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"] }}
            }} }}"""
    )
    scaled, reset = frame.meshes
    assert translation(scaled.prototype_from_mesh) == [1, 2, 0]
    assert scaled.prototype_from_mesh[0] == 2
    assert translation(reset.prototype_from_mesh) == [0, 5, 0]


def test_subdivision_drops_normals_and_keeps_creases(flatten):
    frame = flatten(
        f"""def Mesh "M" {{ {QUAD}
            normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)]
            int[] creaseIndices = [0, 1]
            int[] creaseLengths = [2]
            float[] creaseSharpnesses = [3]
            uniform token interpolateBoundary = "edgeOnly" }}"""
    )
    (mesh,) = frame.meshes
    assert mesh.normals is None
    assert mesh.subdivision.scheme == "catmullClark"
    assert mesh.subdivision.interpolate_boundary == "edgeOnly"
    assert mesh.subdivision.face_varying_linear_interpolation == "cornersPlus1"
    assert mesh.subdivision.crease_indices.tolist() == [0, 1]
    assert mesh.subdivision.crease_sharpnesses.tolist() == [3]


def test_primvars_normals_stand_before_normals(flatten):
    frame = flatten(
        f"""def Mesh "M" {{ {QUAD} {POLYGONS}
            normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)]
            normal3f[] primvars:normals = [(1, 0, 0)] (interpolation = "faceVarying")
            int[] primvars:normals:indices = [0, 0, 0, 0] }}"""
    )
    normals = frame.meshes[0].normals
    assert normals.interpolation == "faceVarying"
    assert normals.values.tolist() == [1, 0, 0]
    assert normals.indices.tolist() == [0, 0, 0, 0]


def test_orientation_and_sides(flatten):
    frame = flatten(
        f"""def Mesh "M" {{ {QUAD}
            uniform token orientation = "leftHanded"
            uniform bool doubleSided = 1 }}"""
    )
    assert frame.meshes[0].left_handed
    assert frame.meshes[0].double_sided


def test_only_primvars_that_are_read_cross(flatten):
    frame = flatten(
        TEXTURED
        + f"""def Xform "A" {{
            color3f primvars:paint = (1, 0.5, 0.25)
            def Mesh "Painted" (prepend apiSchemas = ["MaterialBindingAPI"]) {{ {QUAD}
                rel material:binding = </Textured>
                color3f[] primvars:unread = [(0, 0, 0)] }}
            def Mesh "Plain" (prepend apiSchemas = ["MaterialBindingAPI"]) {{ {QUAD}
                rel material:binding = </Plain> }} }}"""
    )
    painted, plain = frame.meshes
    assert material_path(frame, painted.material) == "/Textured"
    (paint,) = painted.primvars
    assert (paint.name, paint.width, paint.interpolation) == ("paint", 3, "constant")
    assert paint.values.tolist() == [1, 0.5, 0.25]
    assert plain.primvars == []


def test_half_and_double_primvars_become_float(flatten):
    frame = flatten(
        TEXTURED
        + f"""def Mesh "M" (prepend apiSchemas = ["MaterialBindingAPI"]) {{ {QUAD}
            rel material:binding = </Textured>
            half3[] primvars:paint = [(1, 2, 3)] (interpolation = "uniform") }}"""
    )
    (paint,) = frame.meshes[0].primvars
    assert paint.values.dtype == np.float32
    assert paint.values.tolist() == [1, 2, 3]
    assert paint.interpolation == "uniform"


def test_display_color_reaches_unbound_meshes(flatten):
    frame = flatten(
        f"""def Xform "A" {{
            color3f[] primvars:displayColor = [(1, 0, 0)]
            def Mesh "Red" {{ {QUAD} }} }}
        def Mesh "Grey" {{ {QUAD} }}"""
    )
    red, grey = frame.meshes
    assert [p.values.tolist() for p in red.primvars] == [[1, 0, 0]]
    assert grey.primvars == []
    assert red.material != grey.material


def test_subset_binding_beats_the_mesh(flatten):
    frame = flatten(
        TEXTURED
        + f"""def Mesh "M" (prepend apiSchemas = ["MaterialBindingAPI"]) {{ {QUAD}
            rel material:binding = </Plain>
            color3f[] primvars:paint = [(1, 0, 0)] (interpolation = "uniform")
            def GeomSubset "S" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
                uniform token elementType = "face"
                uniform token familyName = "materialBind"
                int[] indices = [0]
                rel material:binding = </Textured>
            }}
            def GeomSubset "Other" {{
                uniform token familyName = "selection"
                int[] indices = [0]
            }} }}"""
    )
    (mesh,) = frame.meshes
    assert material_path(frame, mesh.material) == "/Plain"
    (subset,) = mesh.subsets
    assert material_path(frame, subset.material) == "/Textured"
    assert subset.faces.tolist() == [0]
    assert [p.name for p in mesh.primvars] == ["paint"]


def test_stronger_and_purposeful_bindings(flatten):
    frame = flatten(
        TEXTURED
        + f"""def Xform "A" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
            rel material:binding = </Plain> (bindMaterialAs = "strongerThanDescendants")
            def Mesh "M" (prepend apiSchemas = ["MaterialBindingAPI"]) {{ {QUAD}
                rel material:binding = </Textured> }} }}
        def Mesh "Full" (prepend apiSchemas = ["MaterialBindingAPI"]) {{ {QUAD}
            rel material:binding = </Plain>
            rel material:binding:full = </Textured> }}"""
    )
    assert [material_path(frame, m.material) for m in frame.meshes] == ["/Plain", "/Textured"]


@pytest.mark.parametrize(
    ("purposes", "expected"),
    [
        (None, ["/Default", "/Render", "/Guide/Shown"]),
        (frozenset({"proxy"}), ["/Default", "/Proxy/M", "/Guide/Shown"]),
    ],
)
def test_purposes_and_visibility(flatten, purposes, expected):
    frame = flatten(
        f"""def Mesh "Default" {{ {QUAD} }}
        def Mesh "Render" {{ {QUAD} uniform token purpose = "render" }}
        def Xform "Proxy" {{ uniform token purpose = "proxy"; def Mesh "M" {{ {QUAD} }} }}
        def Xform "Guide" {{ uniform token purpose = "guide"
            def Mesh "M" {{ {QUAD} }}
            def Mesh "Shown" {{ {QUAD} uniform token purpose = "default" }} }}
        def Xform "Hidden" {{ token visibility = "invisible"; def Mesh "M" {{ {QUAD} }} }}""",
        purposes=purposes,
    )
    assert [m.path for m in frame.meshes] == expected


def test_points_and_visibility_at_the_time(flatten):
    body = f"""def Mesh "M" {{ {POLYGONS}
        point3f[] points.timeSamples = {{ 0: [(0, 0, 0)], 10: [(10, 0, 0)] }}
        int[] faceVertexCounts = [1]
        int[] faceVertexIndices = [0]
        token visibility.timeSamples = {{ 0: "inherited", 8: "invisible" }} }}"""
    assert flatten(body, time=5.0).meshes[0].points.tolist() == [[5, 0, 0]]
    assert flatten(body, time=9.0).meshes == []


def test_velocities_are_per_second(flatten):
    frame = flatten(
        f"""def Mesh "M" {{ {POLYGONS}
        point3f[] points.timeSamples = {{ 0: [(0, 0, 0)], 10: [(99, 0, 0)] }}
        vector3f[] velocities.timeSamples = {{ 0: [(24, 0, 0)], 10: [(24, 0, 0)] }}
        int[] faceVertexCounts = [1]
        int[] faceVertexIndices = [0] }}""",
        time=2.0,
    )
    assert frame.meshes[0].points.tolist() == [[2, 0, 0]]


@pytest.mark.parametrize(
    ("prim", "kind", "axis", "dimensions"),
    [
        ('def Sphere "S" { double radius = 2 }', "Sphere", "Z", (2, 0, 0)),
        ('def Cube "S" { double size = 3 }', "Cube", "Z", (3, 0, 0)),
        (
            'def Cylinder "S" { double radius = 2; double height = 5; token axis = "X" }',
            *("Cylinder", "X", (2, 2, 5)),
        ),
        (
            'def Cylinder_1 "S" { double radiusBottom = 1; '
            "double height = 5; double radiusTop = 2 }",
            *("Cylinder", "Z", (1, 2, 5)),
        ),
        ('def Cone "S" { double radius = 2; double height = 5 }', "Cone", "Z", (2, 0, 5)),
        (
            'def Capsule "S" { double radius = 2; double height = 5; token axis = "Y" }',
            *("Capsule", "Y", (2, 2, 5)),
        ),
        ('def Capsule_1 "S" { double radiusTop = 2 }', "Capsule", "Z", (0.5, 2, 1)),
        ('def Plane "S" { double width = 4; double length = 6 }', "Plane", "Z", (4, 6, 0)),
    ],
)
def test_implicit_shapes(flatten, prim, kind, axis, dimensions):
    (shape,) = flatten(prim).implicits
    assert (shape.kind, shape.axis, shape.dimensions) == (kind, axis, dimensions)
    assert shape.double_sided == (kind == "Plane")


def test_implicit_shapes_take_constant_primvars_only(flatten):
    frame = flatten(
        """def Sphere "One" { color3f[] primvars:displayColor = [(1, 0, 0)] (
            interpolation = "vertex") }
        def Sphere "Many" { color3f[] primvars:displayColor = [(1, 0, 0), (0, 0, 0)] (
            interpolation = "vertex") }"""
    )
    one, many = frame.implicits
    assert [(p.interpolation, p.values.tolist()) for p in one.primvars] == [("constant", [1, 0, 0])]
    assert many.primvars == []
    assert any("displayColor" in w and "/Many" in w for w in frame.warnings)


def test_what_is_not_rendered_is_said_once_per_type(flatten):
    frame = flatten(
        """def NurbsCurves "A" {} def NurbsCurves "B" {} def Points "P" {}
        def Volume "V" {} def ArnoldThing "X" {} def Scope "S" {} def Skeleton "K" {}"""
    )
    assert sorted(frame.warnings) == [
        "ArnoldThing is not a known prim type (/X)",
        "NurbsCurves is not rendered yet (2 prims, first /A)",
        "Points without points (/P)",
        "Volume is not rendered yet (/V)",
    ]
