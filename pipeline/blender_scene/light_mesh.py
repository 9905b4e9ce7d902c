"""Lights as meshes that emit on one side and let all light through."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from blender_scene.graph import Graph
from blender_scene.image import load_image
from blender_scene.mesh import add_attribute, triangle_mesh
from blender_scene.placement import exact_shading
from blender_scene.shaping import shaped_tint

if TYPE_CHECKING:
    from exported import ExportedScene

SEGMENTS = 512
"""Facets around a round light; the area falls short by (pi / SEGMENTS)^2 * 2 / 3."""
UV = "light uv"


def build_light_mesh(scene: ExportedScene, light: dict[str, Any]) -> bpy.types.Object:
    """Make a mesh of the light's shape, in light space, that emits outward (or toward -z)."""
    positions, triangles = SHAPES[light["shape"]["type"]](light["shape"])
    axes = scene.to_relative(light["world_from_light"])[:3, :3]
    if np.linalg.det(axes) < 0.0:
        triangles = triangles[:, ::-1]
    mesh = triangle_mesh(light["path"], positions, triangles)
    mesh.shade_flat()
    if light["texture"] is not None:
        corners = positions[triangles.ravel(), :2]
        size = np.float64([light["shape"]["width"], light["shape"]["height"]])
        # Upright as seen from where it shines, toward -z: the lower left is at (+x, -y).
        add_attribute(mesh, UV, "CORNER", 0.5 + corners / (size * (-1.0, 1.0)))
    mesh.materials.append(light_material(scene, light, -axes[:, 2] / np.linalg.norm(axes[:, 2])))
    light_object = bpy.data.objects.new(light["path"], mesh)
    exact_shading(light_object)
    return light_object


def light_material(
    scene: ExportedScene, light: dict[str, Any], axis: np.ndarray
) -> bpy.types.Material:
    """Emit from the front of the mesh; everything else passes."""
    material = bpy.data.materials.new(light["path"])
    material.cycles.emission_sampling = "FRONT"
    graph = Graph.of_material(material)
    emitted: Any = light["radiance"]
    if light["texture"] is not None:
        uv = graph.node("ShaderNodeAttribute")
        uv.attribute_name = UV
        image = graph.node("ShaderNodeTexImage", Vector=uv.outputs["Vector"])
        image.image = load_image(scene.textures[light["texture"]]["files"][0]["tiles"])
        image.extension = "EXTEND"
        emitted = graph.vector_math("MULTIPLY", image.outputs["Color"], emitted)
    if light["shaping"] is not None:
        tint = shaped_tint(graph, light["shaping"], axis)
        emitted = graph.vector_math("MULTIPLY", tint, emitted)
    backfacing = graph.node("ShaderNodeNewGeometry").outputs["Backfacing"]
    front = graph.math("SUBTRACT", 1.0, backfacing)
    emission = graph.node("ShaderNodeEmission", Color=emitted, Strength=front).outputs[0]
    clear = graph.node("ShaderNodeBsdfTransparent", Color=(1.0, 1.0, 1.0)).outputs[0]
    graph.surface(graph.added(emission, clear))
    return material


def rect(shape: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return two triangles that face -z."""
    x, y = 0.5 * shape["width"], 0.5 * shape["height"]
    positions = np.float32([(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)])
    return positions, np.int32([(0, 2, 1), (0, 3, 2)])


def disk(shape: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return a fan that faces -z."""
    angles = np.linspace(0.0, 2.0 * math.pi, SEGMENTS, endpoint=False)
    rim = shape["radius"] * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    this = np.arange(SEGMENTS)
    fan = np.stack([np.full(SEGMENTS, SEGMENTS), (this + 1) % SEGMENTS, this], axis=1)
    return np.float32([*rim, (0.0, 0.0, 0.0)]), fan.astype(np.int32)


def cylinder(shape: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return a tube along x without caps, facing outward."""
    angles = np.linspace(0.0, 2.0 * math.pi, SEGMENTS, endpoint=False)
    circle = shape["radius"] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    half = 0.5 * shape["length"]
    left = np.column_stack([np.full(SEGMENTS, -half), circle])
    right = np.column_stack([np.full(SEGMENTS, half), circle])
    this = np.arange(SEGMENTS)
    after = (this + 1) % SEGMENTS
    lower = np.stack([this, this + SEGMENTS, after + SEGMENTS], axis=1)
    upper = np.stack([this, after + SEGMENTS, after], axis=1)
    triangles = np.concatenate([lower, upper])[:, ::-1]
    return np.float32([*left, *right]), triangles.astype(np.int32)


def sphere(shape: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return a ball of rings around z, for spheres under non-uniform scale."""
    rings = SEGMENTS // 4
    phi = np.linspace(0.0, 2.0 * math.pi, SEGMENTS, endpoint=False)
    theta = np.linspace(0.0, math.pi, rings + 1)[:, None]
    ball = [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0.0 * phi]
    positions = shape["radius"] * np.stack(ball, axis=2).reshape(-1, 3)
    ring = SEGMENTS * np.arange(rings)[:, None]
    this = np.arange(SEGMENTS)
    after = (this + 1) % SEGMENTS
    a, b, c, d = ring + this, ring + SEGMENTS + this, ring + SEGMENTS + after, ring + after
    lower = np.stack([a, b, c], axis=2).reshape(-1, 3)
    upper = np.stack([a, c, d], axis=2).reshape(-1, 3)
    # The triangles at the poles that have no area stay out.
    triangles = np.concatenate([lower[:-SEGMENTS], upper[SEGMENTS:]])
    return positions.astype(np.float32), triangles.astype(np.int32)


SHAPES = {"rect": rect, "disk": disk, "cylinder": cylinder, "sphere": sphere}
"""Vertices and triangles of each shape, counter-clockwise seen from where it emits."""
