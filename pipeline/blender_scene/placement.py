"""Prototypes as collections, instances as empties that show them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from blender_scene.curves import build_curves
from blender_scene.mesh import attribute_name, build_mesh
from blender_scene.motion import deform, move, set_steps
from blender_scene.points import build_points

if TYPE_CHECKING:
    from blender_scene.material import Materials
    from exported import ExportedScene


BUILDERS = {"chunks": build_mesh, "curves": build_curves, "points": build_points}
"""What makes Blender's data of each kind of chunk."""

CAMERA_RAYS, SHADOW_RAYS, INDIRECT_RAYS = 1, 2, 4
ALL_RAYS = CAMERA_RAYS | SHADOW_RAYS | INDIRECT_RAYS


class Placement:
    """Places every prototype of a scene; their data is shared by all instances."""

    def __init__(self, scene: ExportedScene, materials: Materials, warnings: list[str]) -> None:
        self.warnings = warnings
        self.scene = scene
        self.materials = materials
        self.data: dict[tuple[int, str, int], bpy.types.ID] = {}
        self.collections: dict[tuple[int, frozenset[str], int], bpy.types.Collection] = {}
        self.visibility = ALL_RAYS
        """Of the instances that are being filled in."""

    def build(self) -> None:
        """Put the world prototype, and what it holds, into the active scene."""
        self.fill(bpy.context.scene.collection, 0, frozenset())

    def fill(
        self, collection: bpy.types.Collection, prototype: int, per_instance: frozenset[str]
    ) -> None:
        """Add a prototype's chunks and instances to a collection.

        `per_instance` names the primvars that some instancer above gives per instance.
        """
        record = self.scene.prototypes[prototype]
        for kind in BUILDERS:
            for idx in range(len(record.get(kind, ()))):
                collection.objects.link(self.chunk_object(prototype, kind, idx, per_instance))
        for instances in record["instances"]:
            self.place(collection, record, instances, per_instance)

    def chunk_object(
        self, prototype: int, kind: str, idx: int, per_instance: frozenset[str]
    ) -> bpy.types.Object:
        """Make an object that shares the chunk's data and has its own material."""
        chunk = self.scene.prototypes[prototype][kind][idx]
        name = f"{prototype}:{kind}:{idx}"
        data = self.data.get((prototype, kind, idx))
        is_new = data is None
        if data is None:
            fallbacks = self.materials.primvar_fallbacks(chunk["material"])
            data = BUILDERS[kind](self.scene, chunk, name, fallbacks)
            data.materials.append(None)
            self.data[prototype, kind, idx] = data
        chunk_object = bpy.data.objects.new(name, data)
        exact_shading(chunk_object)
        see(chunk_object, chunk.get("visibility", ALL_RAYS) & self.visibility)
        if kind == "chunks":
            keys = self.scene.position_keys(chunk)
            if is_new:
                deform(chunk_object, keys)
            elif len(keys) > 1:
                set_steps(chunk_object, len(keys))
        elif chunk.get("later_points") or chunk.get("later_centers"):
            self.warnings.append(f"{name}: curves and points that deform: not blurred")
        slot = chunk_object.material_slots[0]
        slot.link = "OBJECT"
        slot.material = self.materials.get(chunk["material"], per_instance)
        return chunk_object

    def place(
        self,
        collection: bpy.types.Collection,
        parent: dict[str, Any],
        instances: dict[str, Any],
        per_instance: frozenset[str],
    ) -> None:
        """Add one empty per instance, which shows the prototype's collection."""
        attributes = instances.get("attributes", [])
        names = per_instance | {attribute["name"] for attribute in attributes}
        outside = self.visibility
        self.visibility &= instances.get("visibility", ALL_RAYS)
        shown = self.collection_of(instances["prototype"], names)
        self.visibility = outside
        values = [
            (attribute_name(attribute["name"]), padded(self.scene.values(attribute)))
            for attribute in attributes
        ]
        keys = self.scene.placed(parent, instances)
        for idx, matrices in enumerate(zip(*keys, strict=True)):
            empty = bpy.data.objects.new(f"{shown.name}#{idx}", None)
            empty.instance_type = "COLLECTION"
            empty.instance_collection = shown
            move(empty, list(matrices))
            for name, rows in values:
                empty[name] = rows[min(idx, len(rows) - 1)].tolist()
            collection.objects.link(empty)

    def collection_of(self, prototype: int, per_instance: frozenset[str]) -> bpy.types.Collection:
        """Return the collection of a prototype, filled when first asked for."""
        key = (prototype, per_instance, self.visibility)
        if key not in self.collections:
            collection = bpy.data.collections.new(f"prototype {len(self.collections)}")
            self.collections[key] = collection
            self.fill(collection, prototype, per_instance)
        return self.collections[key]


def see(chunk_object: bpy.types.Object, visibility: int) -> None:
    """Choose the rays that meet an object."""
    chunk_object.visible_camera = bool(visibility & CAMERA_RAYS)
    chunk_object.visible_shadow = bool(visibility & SHADOW_RAYS)
    is_met = bool(visibility & INDIRECT_RAYS)
    chunk_object.visible_diffuse = is_met
    chunk_object.visible_glossy = is_met
    chunk_object.visible_transmission = is_met


def exact_shading(mesh_object: bpy.types.Object) -> None:
    """Turn off the offsets that hide the facets of smooth meshes, for they add bias."""
    mesh_object.shadow_terminator_normal_offset = 0.0
    mesh_object.shadow_terminator_geometry_offset = 0.0
    mesh_object.shadow_terminator_shading_offset = 0.0


def padded(values: np.ndarray) -> np.ndarray:
    """Extend rows to four channels: zeros, and one for the last."""
    rows = np.tile(np.float32([0.0, 0.0, 0.0, 1.0]), (len(values), 1))
    rows[:, : values.shape[1]] = values
    return rows
