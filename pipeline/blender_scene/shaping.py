"""UsdLuxShapingAPI as shader nodes: cone, softness, focus and focus tint."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import bpy
    import numpy as np

    from blender_scene.graph import Graph


def shaped_tint(
    graph: Graph, shaping: dict[str, Any], axis: np.ndarray
) -> bpy.types.NodeSocket | None:
    """Return the colour that multiplies the emission; `axis` is the unit direction of the cone."""
    incoming = graph.node("ShaderNodeNewGeometry").outputs["Incoming"]
    cosine = graph.vector_math("DOT_PRODUCT", incoming, axis.tolist())
    return multiplied(graph, focus(graph, shaping, cosine), cone(graph, shaping, cosine))


def focus(
    graph: Graph, shaping: dict[str, Any], cosine: bpy.types.NodeSocket
) -> bpy.types.NodeSocket | None:
    """`lerp(|cos|^focus, tint, 1)` per channel."""
    if shaping["focus"] == 0.0:
        return None
    weight = graph.math("POWER", graph.math("ABSOLUTE", cosine), shaping["focus"])
    tint = shaping["focus_tint"]
    channels = [graph.math("MULTIPLY_ADD", weight, 1.0 - t, t) for t in tint]
    return graph.combined(channels)


def cone(
    graph: Graph, shaping: dict[str, Any], cosine: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    """`1 - smoothstep(start, angle, theta)`, a step where start and angle are the same."""
    angle = math.radians(shaping["cone_angle_degrees"])
    start = angle * (1.0 - shaping["cone_softness"])
    theta = graph.math("ARCCOSINE", graph.math("MAXIMUM", graph.math("MINIMUM", cosine, 1.0), -1.0))
    if start >= angle:
        return graph.math("SUBTRACT", 1.0, graph.math("GREATER_THAN", theta, angle))
    t = graph.math("DIVIDE", graph.math("SUBTRACT", theta, start), angle - start)
    t = graph.math("MAXIMUM", graph.math("MINIMUM", t, 1.0), 0.0)
    falling = graph.math("MULTIPLY_ADD", t, -2.0, 3.0)
    smooth = graph.math("MULTIPLY", graph.math("MULTIPLY", t, t), falling)
    return graph.math("SUBTRACT", 1.0, smooth)


def multiplied(
    graph: Graph, tint: bpy.types.NodeSocket | None, level: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    """Multiply a colour, or white, by a number."""
    return level if tint is None else graph.vector_math("SCALE", tint, level)
