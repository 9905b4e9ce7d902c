from __future__ import annotations

import numpy as np
import pytest
from test_skel import INFLUENCES, rig

CAMERA = """
def Camera "Cam" {
    double shutter:open = -0.5
    double shutter:close = 0.5
    EXTRA
}
"""
OPEN = CAMERA.replace("EXTRA", "")
TOPOLOGY = """
        uniform token subdivisionScheme = "none"
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
"""
TRIANGLE = TOPOLOGY + "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)];"
MOVING = """
        double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 10: (10, 0, 0) }
        uniform token[] xformOpOrder = ["xformOp:translate"]
"""
SECONDS = "timeCodesPerSecond = 24"


def points(*x):
    return f"[({x[0]}, 0, 0), ({x[1]}, 0, 0), (0, 1, 0)]"


def shifts(instances):
    return [key[0, 3, 0] for key in keys_of(instances)]


def keys_of(instances):
    return [instances.parent_from_prototype, *instances.later_parent_from_prototype]


@pytest.mark.parametrize(
    ("camera", "options"),
    [
        ('def Camera "Cam" {}', {}),
        (OPEN, {"motion_blur": False}),
        (OPEN.replace("0.5", "0.0"), {}),
        ("", {}),
    ],
    ids=["no shutter", "disabled", "closed", "no camera"],
)
def test_nothing_moves_while_the_shutter_is_closed(flatten, camera, options):
    frame = flatten(f'{camera} def Mesh "M" {{ {TRIANGLE} {MOVING} }}', time=5.0, **options)
    assert frame.instances == []
    assert frame.meshes[0].later_keys == []
    assert frame.meshes[0].prototype_from_mesh[12] == 5
    assert frame.camera.get("later_world_from_camera", []) == []


def test_what_stands_still_has_no_keys(flatten):
    frame = flatten(f'{OPEN} def Mesh "M" {{ {TRIANGLE} }}', time=5.0)
    assert frame.instances == []
    assert frame.meshes[0].later_keys == []
    assert frame.camera["shutter"] == [-0.5, 0.5]
    assert frame.camera["later_world_from_camera"] == []


def test_moving_transforms_become_moving_instances(flatten):
    frame = flatten(
        f"""{OPEN} def Xform "X" {{ {MOVING}
            def Mesh "A" {{ {TRIANGLE} }} def Mesh "B" {{ {TRIANGLE} }} }}""",
        time=5.0,
    )
    (instances,) = frame.instances
    assert shifts(instances) == [4.5, 5.5]
    assert [mesh.prototype for mesh in frame.meshes] == [instances.prototype] * 2
    assert frame.meshes[0].prototype_from_mesh[12] == 0


def test_keys_fall_on_the_samples(flatten):
    bent = MOVING.replace(
        "0: (0, 0, 0), 10: (10, 0, 0)", "4: (0, 0, 0), 5: (1, 0, 0), 6: (9, 0, 0)"
    )
    frame = flatten(f'{OPEN} def Xform "X" {{ {bent} def Mesh "A" {{ {TRIANGLE} }} }}', time=5.0)
    assert shifts(frame.instances[0]) == pytest.approx([0.5, 1, 5])


def test_turns_have_as_many_keys_as_straight_lines_need(flatten):
    spinning = """float xformOp:rotateZ.timeSamples = { 0: 0, 10: 900 }
        uniform token[] xformOpOrder = ["xformOp:rotateZ"]"""
    frame = flatten(f'{OPEN} def Mesh "M" {{ {TRIANGLE} {spinning} }}', time=5.0)
    (instances,) = frame.instances
    keys = keys_of(instances)
    assert len(keys) == 9
    angles = np.unwrap([np.arctan2(key[0, 0, 1], key[0, 0, 0]) for key in keys])
    np.testing.assert_allclose(np.diff(angles), np.radians(90) / 8)


def test_moving_inside_moving(flatten):
    frame = flatten(
        f"""{OPEN} def Xform "X" {{ {MOVING} def Xform "Y" {{ {MOVING}
            def Mesh "A" {{ {TRIANGLE} }} }} }}""",
        time=5.0,
    )
    outer, inner = frame.instances
    assert (outer.parent, inner.parent) == (0, outer.prototype)
    assert shifts(inner) == [4.5, 5.5]


def test_a_reset_stack_inside_what_moves_stands_still(flatten):
    reset = """double3 xformOp:translate = (0, 7, 0)
        uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"]"""
    frame = flatten(
        f'{OPEN} def Xform "X" {{ {MOVING} def Mesh "A" {{ {TRIANGLE} {reset} }} }}', time=5.0
    )
    outer, inner = frame.instances
    for first, second in zip(keys_of(outer), keys_of(inner), strict=True):
        np.testing.assert_allclose((second @ first)[0, 3], [0, 7, 0, 1], atol=1e-12)


def test_points_are_sampled(flatten):
    samples = f"{{ 4: {points(0, 1)}, 6: {points(4, 5)} }}"
    frame = flatten(
        f'{OPEN} def Mesh "M" {{ {TOPOLOGY} point3f[] points.timeSamples = {samples} }}', time=5.0
    )
    (mesh,) = frame.meshes
    assert mesh.points[:, 0].tolist() == [1, 2, 0]
    assert [key.points[:, 0].tolist() for key in mesh.later_keys] == [[3, 4, 0]]


def test_points_that_change_their_number_are_not_blurred(flatten):
    fewer = TOPOLOGY.replace("= [0, 1, 2]", ".timeSamples = { 4: [0, 1, 2], 5.25: [0, 1, 1] }")
    samples = f"{{ 4: {points(0, 1)}, 5.25: [(0, 0, 0), (9, 0, 0)] }}"
    frame = flatten(
        f'{OPEN} def Mesh "M" {{ {fewer} point3f[] points.timeSamples = {samples} }}', time=5.0
    )
    assert frame.meshes[0].later_keys == []
    assert frame.meshes[0].points[:, 0].tolist() == [0, 1, 0]
    assert frame.warnings == ["topology changes while the shutter is open: not blurred (/M)"]


@pytest.mark.parametrize("kind", ["Mesh", "Points", "BasisCurves"])
def test_velocities_are_per_second(flatten, kind):
    body = {
        "Mesh": TOPOLOGY,
        "Points": "",
        "BasisCurves": 'int[] curveVertexCounts = [3]; uniform token type = "linear";',
    }[kind]
    frame = flatten(
        f"""{OPEN} def {kind} "P" {{ {body}
            point3f[] points.timeSamples = {{ 5: {points(0, 1)} }}
            vector3f[] velocities.timeSamples = {{ 5: [(24, 0, 0), (48, 0, 0), (0, 0, 0)] }} }}""",
        header=SECONDS,
        time=5.0,
    )
    if kind == "Mesh":
        (mesh,) = frame.meshes
        first, later = mesh.points, [key.points for key in mesh.later_keys]
    else:
        (prim,) = frame.points or frame.curves
        first, later = prim.points, prim.later_points
    np.testing.assert_allclose(first[:, 0], [-0.5, 0, 0], atol=1e-6)
    np.testing.assert_allclose(later[0][:, 0], [0.5, 2, 0], atol=1e-6)
    assert len(later) == 1


def test_accelerations_bend_the_way(flatten):
    frame = flatten(
        f"""{OPEN} def Points "P" {{
            point3f[] points.timeSamples = {{ 5: [(0, 0, 0)] }}
            vector3f[] velocities.timeSamples = {{ 5: [(0, 0, 0)] }}
            vector3f[] accelerations.timeSamples = {{ 5: [(0, 1152, 0)] }} }}""",
        header=SECONDS,
        time=5.0,
    )
    (cloud,) = frame.points
    # Half of 1152 times (a 48th of a second) squared.
    heights = [cloud.points[0, 1], *(key[0, 1] for key in cloud.later_points)]
    np.testing.assert_allclose(heights, [0.25, 0, 0.25], atol=1e-6)


def test_blur_scale(flatten):
    scaled = 'prepend apiSchemas = ["MotionAPI"]'
    frame = flatten(
        f"""{OPEN} def Xform "X" ({scaled}) {{ float motion:blurScale = 2
            def Mesh "A" {{ {TRIANGLE} {MOVING} }} }}""",
        time=5.0,
    )
    assert shifts(frame.instances[0]) == [4, 6]


INSTANCER = """
def PointInstancer "PI" {
    rel prototypes = </PI/M>
    int[] protoIndices = [0, 0]
    EXTRA
    def Mesh "M" { TRIANGLE }
}
""".replace("TRIANGLE", TRIANGLE)


def test_instancer_velocities(flatten):
    frame = flatten(
        OPEN
        + INSTANCER.replace(
            "EXTRA",
            """point3f[] positions.timeSamples = { 5: [(0, 0, 0), (1, 0, 0)] }
            vector3f[] velocities.timeSamples = { 5: [(24, 0, 0), (0, 0, 0)] }
            quath[] orientations.timeSamples = { 5: [(1, 0, 0, 0), (1, 0, 0, 0)] }
            vector3f[] angularVelocities.timeSamples = { 5: [(0, 0, 0), (0, 0, 2160)] }""",
        ),
        header=SECONDS,
        time=5.0,
    )
    (instances,) = frame.instances
    keys = np.array(keys_of(instances))
    assert keys[[0, -1], 0, 3, 0].tolist() == pytest.approx([-0.5, 0.5])
    angles = np.unwrap(np.arctan2(keys[:, 1, 0, 1], keys[:, 1, 0, 0]))
    # 90 degrees in a frame, from 45 before to 45 after; orientations are halves.
    np.testing.assert_allclose(angles[[0, -1]], np.radians([-45, 45]), atol=2e-3)
    assert len(keys) == 9


def test_instances_between_samples(flatten):
    frame = flatten(
        OPEN
        + INSTANCER.replace(
            "EXTRA",
            "point3f[] positions.timeSamples = "
            "{ 4: [(0, 0, 0), (1, 0, 0)], 6: [(2, 0, 0), (1, 0, 0)] }",
        ),
        time=5.0,
    )
    assert shifts(frame.instances[0]) == pytest.approx([0.5, 1.5])


def test_skinned_meshes_are_posed_at_each_key(flatten):
    (mesh,) = flatten(OPEN + rig(INFLUENCES), time=5.0).meshes
    poses = [mesh.points, *(key.points for key in mesh.later_keys)]
    # Joint A rises by one in a frame.
    np.testing.assert_allclose([pose[0, 1] for pose in poses], [4.5, 5, 5.5], atol=1e-5)
    assert all(key.normals is not None for key in mesh.later_keys)


def test_a_skeleton_that_moves_takes_its_meshes_along(flatten):
    body = rig(INFLUENCES).replace(
        "double3 xformOp:translate = (100, 0, 0)",
        "double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 10: (100, 0, 0) }",
    )
    frame = flatten(OPEN + body, time=5.0)
    (mesh,) = frame.meshes
    (instances,) = frame.instances
    assert mesh.prototype == instances.prototype
    assert shifts(instances) == pytest.approx([45, 55])
    poses = [mesh.points, *(key.points for key in mesh.later_keys)]
    np.testing.assert_allclose([pose[0, 0] for pose in poses], [1, 1, 1], atol=1e-5)


def test_moving_camera(flatten):
    camera = CAMERA.replace("EXTRA", MOVING)
    frame = flatten(camera + f'def Mesh "M" {{ {TRIANGLE} }}', time=5.0)
    keys = [frame.camera["world_from_camera"], *frame.camera["later_world_from_camera"]]
    assert [key[12] for key in keys] == [4.5, 5.5]


def test_moving_lights_stay_where_they_are_at_the_frame(flatten):
    frame = flatten(f'{OPEN} def SphereLight "L" {{ {MOVING} }}', time=5.0)
    assert frame.lights[0]["world_from_light"][12] == 5
    expected = "lights do not move while the shutter is open: not blurred (/L)"
    assert frame.warnings == [expected]


def test_moving_native_instances(flatten):
    frame = flatten(
        f"""{OPEN} def Xform "Asset" {{ def Mesh "M" {{ {TRIANGLE} }} }}
        def Xform "I" (instanceable = true; references = </Asset>) {{ {MOVING} }}""",
        time=5.0,
    )
    moving, placed = frame.instances
    assert shifts(moving) == [4.5, 5.5]
    assert (placed.parent, shifts(placed)) == (moving.prototype, [0])
