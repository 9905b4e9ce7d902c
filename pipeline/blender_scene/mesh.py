"""Triangle meshes from chunks, without a Python loop over their elements."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

if TYPE_CHECKING:
    from exported import ExportedScene

ATTRIBUTE_TYPES = {
    1: ("FLOAT", "value"),
    2: ("FLOAT2", "vector"),
    3: ("FLOAT_VECTOR", "vector"),
    4: ("FLOAT_COLOR", "color"),
}
"""Blender's storage type and its property for each width."""


def attribute_name(primvar: str) -> str:
    """Return the mesh attribute of a primvar; the prefix keeps clear of Blender's own names."""
    return f"primvar:{primvar}"


def build_mesh(
    scene: ExportedScene, chunk: dict[str, Any], name: str, fallbacks: dict[str, Any]
) -> bpy.types.Mesh:
    """Make a mesh of a chunk's triangles.

    `fallbacks` are the values, by primvar name, for primvars that the chunk's material reads and
    the chunk may lack.
    """
    positions = scene.positions(chunk)
    triangles = scene.triangles(chunk)
    mesh = triangle_mesh(name, positions, triangles)
    normals = scene.normals(chunk)
    if normals is None:
        mesh.shade_flat()
    else:
        add_attribute(mesh, "custom_normal", "POINT", normals)
    found = {attribute["name"] for attribute in chunk["attributes"]}
    for attribute in chunk["attributes"]:
        add_primvar(mesh, attribute, scene.values(attribute), triangles)
    for primvar in sorted(fallbacks.keys() - found):
        values = np.tile(np.float32(fallbacks[primvar]), (len(positions), 1))
        add_attribute(mesh, attribute_name(primvar), "POINT", values)
    return mesh


def triangle_mesh(name: str, positions: np.ndarray, triangles: np.ndarray) -> bpy.types.Mesh:
    """Make a mesh of (n, 3) positions and (n, 3) vertex indices, smooth shaded."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(positions))
    mesh.vertices.foreach_set("co", positions.ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", triangles.astype(np.int32).ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    return mesh


def add_primvar(
    mesh: bpy.types.Mesh, attribute: dict[str, Any], values: np.ndarray, triangles: np.ndarray
) -> None:
    """Store a primvar under its attribute name."""
    name = attribute_name(attribute["name"])
    interpolation = attribute["interpolation"]
    if interpolation == "constant":
        add_attribute(mesh, name, "POINT", np.tile(values, (len(mesh.vertices), 1)))
    elif interpolation == "uniform":
        add_attribute(mesh, name, "FACE", values)
    elif attribute["width"] == 2:
        # Tangents for normal maps are found only for UV maps, which live on corners.
        add_attribute(mesh, name, "CORNER", values[triangles.ravel()])
    else:
        add_attribute(mesh, name, "POINT", values)


def add_attribute(mesh: bpy.types.Mesh, name: str, domain: str, values: np.ndarray) -> None:
    """Add a generic attribute of (n, width) floats."""
    storage, prop = ATTRIBUTE_TYPES[values.shape[1]]
    attribute = mesh.attributes.new(name, storage, domain)
    flat = np.ascontiguousarray(values, dtype=np.float32).ravel()
    attribute.data.foreach_set(prop, flat)
