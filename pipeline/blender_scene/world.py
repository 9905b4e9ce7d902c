"""Dome lights as the background."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from blender_scene.graph import Graph
from blender_scene.image import load_image
from blender_scene.light import is_dark

if TYPE_CHECKING:
    from exported import ExportedScene

CYCLES_FROM_DOME = np.float64([(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
"""Turns dome space (+y up, image centre toward +z) into that of Cycles' lat-long (+z, +x)."""


def build_world(scene: ExportedScene) -> None:
    """Sum all domes into the background; black where there is none."""
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    bpy.context.scene.world = world
    graph = Graph.of_world(world)
    total = None
    for light in scene.lights:
        if light["shape"]["type"] == "dome" and not is_dark(scene, light):
            shader = background(graph, scene, light)
            total = shader if total is None else graph.added(total, shader)
    if total is None:
        total = graph.node("ShaderNodeBackground", Strength=0.0).outputs[0]
    graph.surface(total)


def background(graph: Graph, scene: ExportedScene, light: dict[str, Any]) -> bpy.types.NodeSocket:
    """Make the background of one dome."""
    colour: Any = light["radiance"]
    texture = light["texture"]
    if texture is not None:
        direction = lat_long_direction(graph, scene, light)
        image = graph.node("ShaderNodeTexEnvironment", Vector=direction)
        image.image = load_image(scene.textures[texture]["files"][0]["tiles"])
        colour = graph.vector_math("MULTIPLY", image.outputs["Color"], colour)
    strength: Any = 1.0
    if not light["visible_to_camera"]:
        is_camera_ray = graph.node("ShaderNodeLightPath").outputs["Is Camera Ray"]
        strength = graph.math("SUBTRACT", 1.0, is_camera_ray)
    return graph.node("ShaderNodeBackground", Color=colour, Strength=strength).outputs[0]


def lat_long_direction(
    graph: Graph, scene: ExportedScene, light: dict[str, Any]
) -> bpy.types.NodeSocket:
    """Return the ray's direction in the space of Cycles' environment textures."""
    relative_from_dome = scene.to_relative(light["world_from_light"])[:3, :3]
    # Scale has no meaning at infinity.
    relative_from_dome = relative_from_dome / np.linalg.norm(relative_from_dome, axis=0)
    rows = CYCLES_FROM_DOME @ np.linalg.inv(relative_from_dome)
    direction = graph.node("ShaderNodeTexCoord").outputs["Generated"]
    return graph.combined(
        [graph.vector_math("DOT_PRODUCT", direction, row.tolist()) for row in rows]
    )
