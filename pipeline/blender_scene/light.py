"""Lights, measured to match UsdLux radiometry.

An area or point light of Cycles with `normalize` off emits the radiance `energy / pi`; a sun's
`energy` is its radiance (or, normalised, its irradiance); a world's strength is its radiance.
What Cycles has no light for becomes a mesh that emits and lets light through.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from mathutils import Matrix

from blender_scene.graph import Graph
from blender_scene.light_mesh import build_light_mesh
from blender_scene.shaping import shaped_tint

if TYPE_CHECKING:
    from exported import ExportedScene

SHEAR_TOLERANCE = 1e-5
"""Relative error in lengths and angles that counts as none."""


def build_lights(scene: ExportedScene, warnings: list[str]) -> None:
    """Build every light but the domes, which the world holds."""
    for light in scene.lights:
        if light["diffuse"] != 1.0 or light["specular"] != 1.0:
            warnings.append(f"{light['path']}: inputs:diffuse and :specular have no counterpart")
        if light["shape"]["type"] != "dome" and not is_dark(scene, light):
            build_light(scene, light, warnings)


def is_dark(scene: ExportedScene, light: dict[str, Any]) -> bool:
    """Whether a light has no radiance, or a texture that is missing."""
    texture = light["texture"]
    is_missing = texture is not None and not scene.textures[texture]["files"]
    return is_missing or max(light["radiance"]) <= 0.0


def build_light(scene: ExportedScene, light: dict[str, Any], warnings: list[str]) -> None:
    """Build a light as Cycles' own where that emits the same, as an emitting mesh otherwise."""
    relative_from_light = scene.to_relative(light["world_from_light"])
    axes = relative_from_light[:3, :3]
    lengths = np.linalg.norm(axes, axis=0)
    data = None
    if lengths.min() > 0.0:
        data = cycles_light(light, axes, lengths)
    if data is None:
        if light["shape"]["type"] == "distant":
            warnings.append(f"{light['path']}: distant light under a singular transform")
            return
        light_object = build_light_mesh(scene, light)
        light_object.matrix_world = Matrix(relative_from_light.tolist())
    else:
        set_colour(data, light, -axes[:, 2] / lengths[2])
        light_object = bpy.data.objects.new(light["path"], data)
        rigid = relative_from_light.copy()
        rigid[:3, :3] = axes / lengths
        light_object.matrix_world = Matrix(rigid.tolist())
    light_object.visible_camera = light["visible_to_camera"]
    bpy.context.scene.collection.objects.link(light_object)


def cycles_light(
    light: dict[str, Any], axes: np.ndarray, lengths: np.ndarray
) -> bpy.types.Light | None:
    """Return a light of the same emission, or None where Cycles has none."""
    shape = light["shape"]
    kind = shape["type"]
    if light["texture"] is not None:
        return None
    if kind == "distant":
        return sun(light["path"], shape["angle_degrees"])
    if kind == "sphere" and is_uniform(lengths) and is_orthogonal(axes):
        data = bpy.data.lights.new(light["path"], "POINT")
        data.use_soft_falloff = False
        data.shadow_soft_size = shape["radius"] * lengths[0]
    elif kind in ("rect", "disk") and is_orthogonal(axes[:, :2]) and faces_away(axes):
        data = bpy.data.lights.new(light["path"], "AREA")
        width = shape["width"] if kind == "rect" else 2.0 * shape["radius"]
        height = shape["height"] if kind == "rect" else width
        data.shape = "RECTANGLE" if kind == "rect" else "ELLIPSE"
        data.size = width * lengths[0]
        data.size_y = height * lengths[1]
    else:
        return None
    data.normalize = False
    data.energy = math.pi
    return data


def sun(name: str, angle_degrees: float) -> bpy.types.Light:
    """Make a sun of radiance one, or of irradiance one where it has no size."""
    data = bpy.data.lights.new(name, "SUN")
    data.angle = math.radians(angle_degrees)
    data.normalize = angle_degrees == 0.0
    data.energy = 1.0
    return data


def set_colour(data: bpy.types.Light, light: dict[str, Any], axis: np.ndarray) -> None:
    """Multiply the emission by the radiance and the shaping; `axis` is where the light points."""
    radiance = np.float64(light["radiance"])
    # Cycles weighs lights by energy, so the level belongs there and the hue in the colour.
    peak = float(radiance.max())
    data.energy *= peak
    data.color = (radiance / peak).tolist()
    if light["shaping"] is not None:
        graph = Graph.of_light(data)
        graph.emit(shaped_tint(graph, light["shaping"], axis))


def is_uniform(lengths: np.ndarray) -> bool:
    """Whether all lengths are the same."""
    return bool(np.ptp(lengths) <= SHEAR_TOLERANCE * lengths.max())


def is_orthogonal(axes: np.ndarray) -> bool:
    """Whether the columns are perpendicular to each other."""
    units = axes / np.linalg.norm(axes, axis=0)
    return bool(np.abs(units.T @ units - np.eye(axes.shape[1])).max() <= SHEAR_TOLERANCE)


def faces_away(axes: np.ndarray) -> bool:
    """Whether the third axis is the normal of the first two, neither sheared nor mirrored."""
    normal = np.cross(axes[:, 0], axes[:, 1])
    cosine = normal @ axes[:, 2] / (np.linalg.norm(normal) * np.linalg.norm(axes[:, 2]))
    return bool(cosine >= 1.0 - SHEAR_TOLERANCE)
