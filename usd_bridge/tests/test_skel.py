from __future__ import annotations

import numpy as np
import pytest

RIG = """
def SkelRoot "Root" {
    double3 xformOp:translate = (100, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Skeleton "Skel" (prepend apiSchemas = ["SkelBindingAPI"]) {
        uniform token[] joints = ["A", "B"]
        uniform matrix4d[] bindTransforms = [
            ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)), ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))]
        uniform matrix4d[] restTransforms = [
            ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)), ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))]
        rel skel:animationSource = </Root/Anim>
    }
    def SkelAnimation "Anim" {
        uniform token[] joints = ["A", "B"]
        float3[] translations.timeSamples = {
            0: [(0, 0, 0), (0, 0, 0)], 10: [(0, 10, 0), (0, 0, 0)] }
        quatf[] rotations = [(1, 0, 0, 0), (0.70710678, 0, 0, 0.70710678)]
        half3[] scales = [(1, 1, 1), (1, 1, 1)]
        uniform token[] blendShapes = ["Bulge"]
        float[] blendShapeWeights = [0.5]
    }
    MESH
}
"""

MESH = """
    def Mesh "M" (prepend apiSchemas = ["SkelBindingAPI"]) {
        uniform token subdivisionScheme = "none"
        point3f[] points = [(1, 0, 0), (2, 0, 0), (3, 0, 0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        normal3f[] normals = [(1, 0, 0), (1, 0, 0), (1, 0, 0)] (interpolation = "INTERPOLATION")
        rel skel:skeleton = </Root/Skel>
        EXTRA
    }
"""

INFLUENCES = """
        int[] primvars:skel:jointIndices = [0, 1, 1] (interpolation = "vertex"; elementSize = 1)
        float[] primvars:skel:jointWeights = [1, 1, 1] (interpolation = "vertex"; elementSize = 1)
"""

SHAPES = """
        uniform token[] skel:blendShapes = ["Bulge"]
        rel skel:blendShapeTargets = </Root/M/Bulge>
        def BlendShape "Bulge" {
            uniform vector3f[] offsets = [(0, 0, 4)]
            uniform int[] pointIndices = [2]
        }
"""


MOVED = """
    double3 xformOp:translate = (7, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
"""


def rig(extra, interpolation="vertex"):
    mesh = MESH.replace("EXTRA", extra).replace("INTERPOLATION", interpolation)
    return RIG.replace("MESH", mesh)


def world_points(mesh):
    m = np.array(mesh.prototype_from_mesh).reshape(4, 4)
    return mesh.points @ m[:3, :3] + m[3, :3]


@pytest.mark.parametrize("interpolation", ["vertex", "faceVarying"])
def test_points_and_normals_follow_the_joints(flatten, interpolation):
    (mesh,) = flatten(rig(INFLUENCES, interpolation), time=5.0).meshes
    # Joint A has risen by 5; joint B turns by 90 degrees around z.
    expected = [[101, 5, 0], [100, 2, 0], [100, 3, 0]]
    np.testing.assert_allclose(world_points(mesh), expected, atol=1e-5)
    assert mesh.normals.interpolation == interpolation
    normals = mesh.normals.values.reshape(-1, 3)
    np.testing.assert_allclose(normals, [[1, 0, 0], [0, 1, 0], [0, 1, 0]], atol=1e-5)


def test_meshes_may_name_fewer_joints_and_in_another_order(flatten):
    fewer = 'uniform token[] skel:joints = ["B"]' + INFLUENCES.replace("[0, 1, 1]", "[0, 0, 0]")
    (mesh,) = flatten(rig(fewer), time=5.0).meshes
    expected = [[100, 1, 0], [100, 2, 0], [100, 3, 0]]
    np.testing.assert_allclose(world_points(mesh), expected, atol=1e-5)
    normals = mesh.normals.values.reshape(-1, 3)
    np.testing.assert_allclose(normals, [[0, 1, 0]] * 3, atol=1e-5)


def test_blend_shapes_come_before_joints(flatten):
    (mesh,) = flatten(rig(INFLUENCES + SHAPES), time=0.0).meshes
    expected = [[101, 0, 0], [100, 2, 0], [100, 3, 2]]
    np.testing.assert_allclose(world_points(mesh), expected, atol=1e-5)


def test_blend_shapes_alone(flatten):
    (mesh,) = flatten(rig(SHAPES), time=0.0).meshes
    expected = [[101, 0, 0], [102, 0, 0], [103, 0, 2]]
    np.testing.assert_allclose(world_points(mesh), expected, atol=1e-5)


def test_rigid_meshes_move_as_one(flatten):
    rigid = INFLUENCES.replace("vertex", "constant").replace("[0, 1, 1]", "[1]")
    (mesh,) = flatten(rig(rigid.replace("[1, 1, 1]", "[1]")), time=0.0).meshes
    expected = [[100, 1, 0], [100, 2, 0], [100, 3, 0]]
    np.testing.assert_allclose(world_points(mesh), expected, atol=1e-5)


def test_skinning_inside_instances(flatten):
    body = rig(INFLUENCES).replace('def SkelRoot "Root"', 'def Xform "Asset" {def SkelRoot "Root"')
    body = body.replace("</Root/", "</Asset/Root/") + MOVED + "}"
    frame = flatten(
        f"""{body}
        def Xform "A" (instanceable = true; references = </Asset>) {{
            double3 xformOp:translate = (0, 0, 50)
            uniform token[] xformOpOrder = ["xformOp:translate"] }}""",
        time=5.0,
    )
    direct, instanced = frame.meshes
    assert instanced.prototype != direct.prototype
    np.testing.assert_allclose(
        world_points(instanced) + np.array([7, 0, 0]), world_points(direct), atol=1e-5
    )
    assert frame.instances[0].parent_from_prototype[0, 3].tolist() == [0, 0, 50, 1]
