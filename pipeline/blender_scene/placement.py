"""Prototypes as collections, instances as empties that show them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from mathutils import Matrix

from blender_scene.mesh import attribute_name, build_mesh

if TYPE_CHECKING:
    from blender_scene.material import Materials
    from exported import ExportedScene


class Placement:
    """Places every prototype of a scene; meshes are shared by all its instances."""

    def __init__(self, scene: ExportedScene, materials: Materials) -> None:
        self.scene = scene
        self.materials = materials
        self.meshes: dict[tuple[int, int], bpy.types.Mesh] = {}
        self.collections: dict[tuple[int, frozenset[str]], bpy.types.Collection] = {}

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
        for idx in range(len(record["chunks"])):
            collection.objects.link(self.chunk_object(prototype, idx, per_instance))
        for instances in record["instances"]:
            self.place(collection, record, instances, per_instance)

    def chunk_object(
        self, prototype: int, idx: int, per_instance: frozenset[str]
    ) -> bpy.types.Object:
        """Make an object that shares the chunk's mesh and has its own material."""
        chunk = self.scene.prototypes[prototype]["chunks"][idx]
        name = f"{prototype}:{idx}"
        mesh = self.meshes.get((prototype, idx))
        if mesh is None:
            fallbacks = self.materials.primvar_fallbacks(chunk["material"])
            mesh = build_mesh(self.scene, chunk, name, fallbacks)
            mesh.materials.append(None)
            self.meshes[prototype, idx] = mesh
        chunk_object = bpy.data.objects.new(name, mesh)
        exact_shading(chunk_object)
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
        shown = self.collection_of(instances["prototype"], names)
        values = [
            (attribute_name(attribute["name"]), padded(self.scene.values(attribute)))
            for attribute in attributes
        ]
        for idx, matrix in enumerate(self.scene.placed(parent, instances)):
            empty = bpy.data.objects.new(f"{shown.name}#{idx}", None)
            empty.instance_type = "COLLECTION"
            empty.instance_collection = shown
            empty.matrix_world = Matrix(matrix.tolist())
            for name, rows in values:
                empty[name] = rows[min(idx, len(rows) - 1)].tolist()
            collection.objects.link(empty)

    def collection_of(self, prototype: int, per_instance: frozenset[str]) -> bpy.types.Collection:
        """Return the collection of a prototype, filled when first asked for."""
        key = (prototype, per_instance)
        if key not in self.collections:
            collection = bpy.data.collections.new(f"prototype {len(self.collections)}")
            self.collections[key] = collection
            self.fill(collection, prototype, per_instance)
        return self.collections[key]


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
