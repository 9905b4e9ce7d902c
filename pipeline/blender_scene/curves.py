"""Tubes as hair, ribbons as strips of quads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from blender_scene.mesh import ATTRIBUTE_TYPES, attribute_name, triangle_mesh

if TYPE_CHECKING:
    from exported import ExportedScene

PIECES = 8
"""Straight enough parts of a cubic segment: Cycles' own curves are Catmull-Rom splines."""


def build_curves(
    scene: ExportedScene, chunk: dict[str, Any], name: str, fallbacks: dict[str, Any]
) -> bpy.types.ID:
    """Make hair of round curves, one strand per segment, and a mesh of oriented ribbons.

    `fallbacks` are the values, by primvar name, for primvars that the chunk's material reads and
    the chunk may lack.
    """
    segments = scene.array(chunk["segments"], "<u4", 1)[:, 0]
    basis = chunk["basis"]

    def at_keys(file: str, width: int) -> np.ndarray:
        return evaluate(scene.array(file, "<f4", width), segments, basis)

    points = at_keys(chunk["points"], 3)
    radii = at_keys(chunk["radii"], 1)
    values = {}
    for attribute in chunk["attributes"]:
        values[attribute["name"]] = per_key(scene, attribute, segments, basis, points.shape[1])
    for primvar in fallbacks.keys() - values.keys():
        fallback = np.float32(fallbacks[primvar]).reshape(1, 1, -1)
        values[primvar] = np.tile(fallback, (*points.shape[:2], 1))
    if chunk["normals"]:
        normals = at_keys(chunk["normals"], 3)
        return ribbon_mesh(name, points, radii, normals, values)
    return hair(name, points, radii, values)


def evaluate(controls: np.ndarray, segments: np.ndarray, basis: str) -> np.ndarray:
    """Return (n_segments, n_keys, width) values along the segments."""
    if basis == "linear":
        weights = np.eye(2)
    else:
        t = np.linspace(0.0, 1.0, PIECES + 1)
        s = 1.0 - t
        weights = np.stack([s**3, 3 * s * s * t, 3 * s * t * t, t**3], axis=1)
    order = weights.shape[1]
    of_segment = controls[segments[:, None] + np.arange(order)]
    return np.einsum("kc,scw->skw", weights, of_segment)


def per_key(
    scene: ExportedScene,
    attribute: dict[str, Any],
    segments: np.ndarray,
    basis: str,
    n_keys: int,
) -> np.ndarray:
    """Return an attribute's values at all keys of all segments."""
    values = scene.values(attribute)
    match attribute["interpolation"]:
        case "constant":
            return np.tile(values[None], (len(segments), n_keys, 1))
        case "uniform":
            return np.repeat(values[:, None], n_keys, axis=1)
        case _:
            return evaluate(values, segments, basis)


def hair(
    name: str, points: np.ndarray, radii: np.ndarray, values: dict[str, np.ndarray]
) -> bpy.types.ID:
    """Make one strand per segment."""
    curves = bpy.data.hair_curves.new(name)
    curves.add_curves([points.shape[1]] * len(points))
    add_attribute(curves, "position", points, "FLOAT_VECTOR", "vector")
    add_attribute(curves, "radius", radii, "FLOAT", "value")
    for primvar, value in values.items():
        add_attribute(curves, attribute_name(primvar), value, *ATTRIBUTE_TYPES[value.shape[-1]])
    return curves


def ribbon_mesh(
    name: str,
    points: np.ndarray,
    radii: np.ndarray,
    normals: np.ndarray,
    values: dict[str, np.ndarray],
) -> bpy.types.Mesh:
    """Make two triangles between each pair of keys."""
    n_segments, n_keys = points.shape[:2]
    across = np.cross(normals, np.gradient(points, axis=1))
    across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-30)
    edges = np.stack([points - radii * across, points + radii * across], axis=2)
    first = np.arange(n_segments)[:, None] * n_keys + np.arange(n_keys - 1)
    quads = 2 * first.reshape(-1, 1)
    triangles = np.concatenate([quads + np.array([0, 1, 3]), quads + np.array([0, 3, 2])])
    mesh = triangle_mesh(name, np.float32(edges.reshape(-1, 3)), triangles)
    for primvar, value in values.items():
        both = np.repeat(value.reshape(-1, value.shape[-1]), 2, axis=0)
        add_attribute(mesh, attribute_name(primvar), both, *ATTRIBUTE_TYPES[value.shape[-1]])
    return mesh


def add_attribute(data: Any, name: str, values: np.ndarray, storage: str, prop: str) -> None:
    """Set a float attribute of all points, adding it where it is new."""
    attribute = data.attributes.get(name) or data.attributes.new(name, storage, "POINT")
    flat = np.ascontiguousarray(values, dtype=np.float32).ravel()
    attribute.data.foreach_set(prop, flat)
