"""Points as a point cloud, which Cycles draws as spheres."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from blender_scene.curves import add_attribute
from blender_scene.mesh import ATTRIBUTE_TYPES, attribute_name

if TYPE_CHECKING:
    from exported import ExportedScene


def build_points(
    scene: ExportedScene, chunk: dict[str, Any], name: str, fallbacks: dict[str, Any]
) -> bpy.types.PointCloud:
    """Make a point cloud of a chunk; `fallbacks` as for curves."""
    centers = scene.array(chunk["centers"], "<f4", 3)
    cloud = bpy.data.pointclouds.new(name)
    cloud.resize(len(centers))
    add_attribute(cloud, "position", centers, "FLOAT_VECTOR", "vector")
    radii = scene.array(chunk["radii"], "<f4", 1)
    add_attribute(cloud, "radius", radii, "FLOAT", "value")
    values = {}
    for attribute in chunk["attributes"]:
        found = scene.values(attribute)
        is_constant = attribute["interpolation"] == "constant"
        values[attribute["name"]] = np.tile(found, (len(centers), 1)) if is_constant else found
    for primvar in fallbacks.keys() - values.keys():
        values[primvar] = np.tile(np.float32(fallbacks[primvar]), (len(centers), 1))
    for primvar, value in values.items():
        add_attribute(cloud, attribute_name(primvar), value, *ATTRIBUTE_TYPES[value.shape[-1]])
    return cloud
