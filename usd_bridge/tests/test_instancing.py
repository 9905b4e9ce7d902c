from __future__ import annotations

import numpy as np
from conftest import material_path, translation
from kilauea import payload

QUAD = """
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
"""

MATERIALS = """
def Material "Red" {
    token outputs:surface.connect = </Red/S.outputs:surface>
    def Shader "S" { uniform token info:id = "UsdPreviewSurface"; token outputs:surface }
}
def Material "Blue" {
    token outputs:surface.connect = </Blue/S.outputs:surface>
    def Shader "S" { uniform token info:id = "UsdPreviewSurface"; token outputs:surface }
}
"""


def at(x, y=0, z=0):
    return f"""double3 xformOp:translate = ({x}, {y}, {z})
        uniform token[] xformOpOrder = ["xformOp:translate"]
    """


def placements(frame):
    """Follow instances from the world: (mesh path, world translation) of every copy."""
    found = []

    def visit(prototype, world_from_space):
        for mesh in frame.meshes:
            if mesh.prototype == prototype:
                m = np.array(mesh.prototype_from_mesh).reshape(4, 4) @ world_from_space
                found.append((mesh.path, [round(c, 5) for c in m[3, :3].tolist()]))
        for instances in frame.instances:
            if instances.parent == prototype:
                for m in instances.parent_from_prototype:
                    visit(instances.prototype, m @ world_from_space)

    visit(payload.WORLD, np.eye(4))
    return found


def test_native_instances_share_a_prototype(flatten):
    frame = flatten(
        f"""class "Asset" {{ def Mesh "M" {{ {QUAD} {at(0, 1)} }} }}
        def Xform "A" (instanceable = true; inherits = </Asset>) {{ {at(10)} }}
        def Xform "B" (instanceable = true; inherits = </Asset>) {{ {at(20)} }}"""
    )
    assert len(frame.meshes) == 1
    assert frame.prototypes == ["", "/A"]
    assert [i.path for i in frame.instances] == ["/A", "/B"]
    assert [p for _, p in placements(frame)] == [[10, 1, 0], [20, 1, 0]]
    assert frame.instances[0].parent_from_prototype.dtype == np.float64
    assert frame.instances[0].parent_from_prototype.shape == (1, 4, 4)


def test_material_from_outside_makes_another_prototype(flatten):
    frame = flatten(
        MATERIALS
        + f"""class "Asset" {{ def Mesh "M" {{ {QUAD} }} }}
        def Xform "Reds" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
            rel material:binding = </Red>
            def Xform "A" (instanceable = true; inherits = </Asset>) {{}}
            def Xform "B" (instanceable = true; inherits = </Asset>) {{}} }}
        def Xform "C" (
            instanceable = true; inherits = </Asset>; prepend apiSchemas = ["MaterialBindingAPI"]
        ) {{ rel material:binding = </Blue> }}"""
    )
    assert [material_path(frame, m.material) for m in frame.meshes] == ["/Red", "/Blue"]
    assert [i.prototype for i in frame.instances] == [1, 1, 2]


def test_collection_bindings_split_only_where_they_differ(flatten):
    frame = flatten(
        MATERIALS
        + f"""class "Asset" {{ def Mesh "M" {{ {QUAD} }} }}
        def Xform "World" (prepend apiSchemas = [
            "MaterialBindingAPI", "CollectionAPI:reds", "CollectionAPI:blues"]) {{
            rel material:binding:collection:reds = [</World.collection:reds>, </Red>]
            rel material:binding:collection:blues = [</World.collection:blues>, </Blue>]
            rel collection:reds:includes = [</World/A>, </World/B>]
            rel collection:blues:includes = [</World/C>]
            def Xform "A" (instanceable = true; inherits = </Asset>) {{}}
            def Xform "B" (instanceable = true; inherits = </Asset>) {{}}
            def Xform "C" (instanceable = true; inherits = </Asset>) {{}} }}"""
    )
    assert [material_path(frame, m.material) for m in frame.meshes] == ["/Red", "/Blue"]
    assert [i.prototype for i in frame.instances] == [1, 1, 2]


def test_purpose_from_outside_counts(flatten):
    frame = flatten(
        f"""class "Asset" {{ def Mesh "M" {{ {QUAD} }} }}
        def Xform "Guides" {{ uniform token purpose = "guide"
            def Xform "A" (instanceable = true; inherits = </Asset>) {{}} }}
        def Xform "B" (instanceable = true; inherits = </Asset>) {{}}
        def Xform "C" (instanceable = true; inherits = </Asset>) {{
            token visibility = "invisible" }}"""
    )
    assert [path for path, _ in placements(frame)] == ["/B/M"]


def test_display_color_from_outside_goes_with_the_instance(flatten):
    frame = flatten(
        f"""class "Asset" {{ def Mesh "M" {{ {QUAD} }} }}
        def Xform "A" (instanceable = true; inherits = </Asset>) {{
            color3f[] primvars:displayColor = [(1, 0, 0)] }}
        def Xform "B" (instanceable = true; inherits = </Asset>) {{
            color3f[] primvars:displayColor = [(0, 1, 0)] }}
        def Xform "C" (instanceable = true; inherits = </Asset>) {{}}"""
    )
    red, green, plain = frame.instances
    assert red.prototype == green.prototype != plain.prototype
    assert [(p.name, p.interpolation, p.values.tolist()) for p in red.primvars] == [
        ("displayColor", "constant", [1, 0, 0])
    ]
    assert green.primvars[0].values.tolist() == [0, 1, 0]
    assert plain.primvars == []


def test_primvar_that_some_parts_override_makes_another_prototype(flatten):
    frame = flatten(
        f"""class "Asset" {{
            def Mesh "Own" {{ {QUAD} color3f[] primvars:displayColor = [(0, 0, 1)] }}
            def Mesh "Open" {{ {QUAD} }} }}
        def Xform "A" (instanceable = true; inherits = </Asset>) {{
            color3f[] primvars:displayColor = [(1, 0, 0)] }}
        def Xform "B" (instanceable = true; inherits = </Asset>) {{
            color3f[] primvars:displayColor = [(0, 1, 0)] }}"""
    )
    colors = {}
    for instances in frame.instances:
        assert instances.primvars == []
        for mesh in frame.meshes:
            if mesh.prototype == instances.prototype:
                name = instances.path + mesh.path[2:]
                colors[name] = mesh.primvars[0].values.tolist()
    assert colors == {
        "/A/Own": [0, 0, 1],
        "/A/Open": [1, 0, 0],
        "/B/Own": [0, 0, 1],
        "/B/Open": [0, 1, 0],
    }


def test_nested_native_instances(flatten):
    frame = flatten(
        f"""class "Leaf" {{ def Mesh "M" {{ {QUAD} }} }}
        class "Branch" {{
            def Xform "L1" (instanceable = true; inherits = </Leaf>) {{ {at(0, 1)} }}
            def Xform "L2" (instanceable = true; inherits = </Leaf>) {{ {at(0, 2)} }} }}
        def Xform "A" (instanceable = true; inherits = </Branch>) {{ {at(10)} }}
        def Xform "B" (instanceable = true; inherits = </Branch>) {{ {at(20)} }}"""
    )
    assert len(frame.meshes) == 1
    assert [p for _, p in placements(frame)] == [[10, 1, 0], [10, 2, 0], [20, 1, 0], [20, 2, 0]]


def test_point_instancer_places_by_index_and_mask(flatten):
    frame = flatten(
        f"""def PointInstancer "I" {{ {at(100)}
            rel prototypes = [</I/P/Square>, </I/P/Other>]
            int[] protoIndices = [0, 1, 0, 0]
            point3f[] positions = [(1, 0, 0), (2, 0, 0), (3, 0, 0), (4, 0, 0)]
            float3[] scales = [(1, 1, 1), (2, 2, 2), (1, 1, 1), (1, 1, 1)]
            int64[] invisibleIds = [2]
            def Scope "P" {{
                def Mesh "Square" {{ {QUAD} {at(0, 5)} }}
                def Xform "Other" {{ def Mesh "M" {{ {QUAD} {at(0, 7)} }} }} }} }}"""
    )
    assert placements(frame) == [
        ("/I/P/Square", [101, 5, 0]),
        ("/I/P/Square", [104, 5, 0]),
        ("/I/P/Other/M", [102, 14, 0]),
    ]


def test_point_instancer_prototypes_elsewhere(flatten):
    frame = flatten(
        MATERIALS
        + f"""def PointInstancer "I" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
            rel material:binding = </Red>
            rel prototypes = [</Protos/Over>, </Visible>]
            int[] protoIndices = [0, 1]
            point3f[] positions = [(1, 0, 0), (2, 0, 0)] }}
        class "Protos" {{ over "Over" {{ def Mesh "M" {{ {QUAD} }} }} }}
        def Mesh "Visible" {{ {QUAD} }}"""
    )
    assert sorted(placements(frame)) == [
        ("/Protos/Over/M", [1, 0, 0]),
        ("/Visible", [0, 0, 0]),
        ("/Visible", [2, 0, 0]),
    ]
    red = [m.path for m in frame.meshes if material_path(frame, m.material) == "/Red"]
    assert sorted(red) == ["/Protos/Over/M", "/Visible"]


def test_point_instancer_primvars_follow_the_selected_instances(flatten):
    frame = flatten(
        f"""def PointInstancer "I" {{
            rel prototypes = [</I/A>, </I/B>]
            int[] protoIndices = [0, 1, 0]
            point3f[] positions = [(1, 0, 0), (2, 0, 0), (3, 0, 0)]
            color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (interpolation = "vertex")
            int[] primvars:displayColor:indices = [0, 1, 1]
            float[] primvars:unread = [1, 2, 3] (interpolation = "vertex")
            def Mesh "A" {{ {QUAD} }}
            def Mesh "B" {{ {QUAD} }} }}"""
    )
    a, b = frame.instances
    assert [(p.name, p.interpolation, p.values.tolist()) for p in a.primvars] == [
        ("displayColor", "vertex", [1, 0, 0, 0, 1, 0])
    ]
    assert b.primvars[0].values.tolist() == [0, 1, 0]


def test_point_instancers_nest_in_each_other_and_in_native_instances(flatten):
    frame = flatten(
        f"""class "Asset" {{
            def PointInstancer "Outer" {{
                rel prototypes = </Asset/Outer/Inner>
                int[] protoIndices = [0, 0]
                point3f[] positions = [(1, 0, 0), (2, 0, 0)]
                def PointInstancer "Inner" {{
                    rel prototypes = </Asset/Outer/Inner/M>
                    int[] protoIndices = [0, 0]
                    point3f[] positions = [(0, 1, 0), (0, 2, 0)]
                    def Mesh "M" {{ {QUAD} }} }} }} }}
        def Xform "A" (instanceable = true; inherits = </Asset>) {{ {at(10)} }}
        def Xform "B" (instanceable = true; inherits = </Asset>) {{ {at(20)} }}"""
    )
    assert len(frame.meshes) == 1
    expected = [[x + i, j, 0] for x in (10, 20) for i in (1, 2) for j in (1, 2)]
    assert [p for _, p in placements(frame)] == expected


def test_native_instances_in_a_point_instancer(flatten):
    frame = flatten(
        f"""class "Asset" {{ def Mesh "M" {{ {QUAD} }} }}
        def PointInstancer "I" {{
            rel prototypes = </I/P>
            int[] protoIndices = [0, 0]
            point3f[] positions = [(1, 0, 0), (2, 0, 0)]
            def Xform "P" (instanceable = true; inherits = </Asset>) {{ {at(0, 3)} }} }}"""
    )
    assert [p for _, p in placements(frame)] == [[1, 3, 0], [2, 3, 0]]


def test_broken_point_instancers_are_said(flatten):
    frame = flatten(
        f"""def PointInstancer "Outside" {{
            rel prototypes = </M>
            int[] protoIndices = [0, 1]
            point3f[] positions = [(1, 0, 0), (2, 0, 0)] }}
        def PointInstancer "Count" {{
            rel prototypes = </M>
            int[] protoIndices = [0, 0]
            point3f[] positions = [(1, 0, 0)] }}
        def PointInstancer "Gone" {{
            rel prototypes = </Nowhere>
            int[] protoIndices = [0]
            point3f[] positions = [(1, 0, 0)] }}
        def PointInstancer "Self" {{
            rel prototypes = </Self>
            int[] protoIndices = [0]
            point3f[] positions = [(1, 0, 0)] }}
        def Mesh "M" {{ {QUAD} }}"""
    )
    for name in ("/Outside", "/Count", "/Gone", "/Self"):
        assert any(name in w for w in frame.warnings), name


def test_lights_in_instances_shine_from_every_placement(flatten):
    frame = flatten(
        f"""class "Lamp" {{ def SphereLight "L" {{ {at(0, 1)} }} }}
        def Xform "A" (instanceable = true; inherits = </Lamp>) {{ {at(10)} }}
        def PointInstancer "I" {{
            rel prototypes = </I/P>
            int[] protoIndices = [0, 0]
            point3f[] positions = [(1, 0, 0), (2, 0, 0)]
            def Xform "P" (instanceable = true; inherits = </Lamp>) {{ {at(0, 0, 3)} }} }}"""
    )
    positions = sorted(translation(light["world_from_light"]) for light in frame.lights)
    assert positions == [[1, 1, 3], [2, 1, 3], [10, 1, 0]]
