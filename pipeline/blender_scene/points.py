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
    vertices = bpy.data.meshes.new(name)
    vertices.vertices.add(len(centers))
    vertices.vertices.foreach_set("co", centers.ravel())
    radii = scene.array(chunk["radii"], "<f4", 1)
    add_attribute(vertices, "radius", radii, "FLOAT", "value")
    values = {}
    for attribute in chunk["attributes"]:
        found = scene.values(attribute)
        is_constant = attribute["interpolation"] == "constant"
        values[attribute["name"]] = np.tile(found, (len(centers), 1)) if is_constant else found
    for primvar in fallbacks.keys() - values.keys():
        values[primvar] = np.tile(np.float32(fallbacks[primvar]), (len(centers), 1))
    for primvar, value in values.items():
        storage = ATTRIBUTE_TYPES[value.shape[-1]]
        add_attribute(vertices, attribute_name(primvar), value, *storage)
    return as_cloud(vertices)


def as_cloud(vertices: bpy.types.Mesh) -> bpy.types.PointCloud:
    """Turn vertices into a point cloud, attributes included: none can be sized directly."""
    carrier = bpy.data.objects.new(vertices.name, vertices)
    collection = bpy.context.scene.collection
    collection.objects.link(carrier)
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = carrier
    carrier.select_set(True)
    bpy.ops.object.convert(target="POINTCLOUD")
    converted = bpy.context.view_layer.objects.active
    cloud = converted.data
    collection.objects.unlink(converted)
    bpy.data.objects.remove(converted)
    return cloud
