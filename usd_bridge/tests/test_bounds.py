from __future__ import annotations

import numpy as np
import pytest
from kilauea.bounds import world_bounds


@pytest.mark.parametrize(
    ("body", "low", "high"),
    [
        ('def Sphere "S" { double radius = 2 }', (-2, -2, -2), (2, 2, 2)),
        (
            'def Cone "S" { double radius = 1; double height = 6; token axis = "X" }',
            *((-3, -1, -1), (3, 1, 1)),
        ),
        (
            'def Plane "S" { double width = 4; double length = 6; token axis = "Y" }',
            *((-2, 0, -3), (2, 0, 3)),
        ),
        (
            'def Mesh "M" { point3f[] points = [(1, 2, 3), (nan, 9, 9), (4, 5, 6)]; '
            "int[] faceVertexCounts = [3]; int[] faceVertexIndices = [0, 1, 2] }",
            *((1, 2, 3), (4, 5, 6)),
        ),
        (
            """def PointInstancer "I" { rel prototypes = </I/S>; int[] protoIndices = [0, 0]
            point3f[] positions = [(0, 0, 0), (10, 0, 0)]; def Sphere "S" {} }""",
            *((-1, -1, -1), (11, 1, 1)),
        ),
    ],
)
def test_world_bounds(flatten, body, low, high):
    box = world_bounds(flatten(body))
    np.testing.assert_allclose(box, [low, high])


def test_nothing_has_no_bounds(flatten):
    assert world_bounds(flatten('def Xform "X" {}')) is None
