"""The whole scene: camera, lights, materials and instanced meshes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pyluxcore

from luxcore_scene.camera import camera_properties
from luxcore_scene.light import add_lights, column_major
from luxcore_scene.material import Materials
from luxcore_scene.mesh import Triangles, define
from still_meshes import placements, refuse_what_is_no_still_mesh

if TYPE_CHECKING:
    from exported import ExportedScene, Raster


def build_scene(scene: ExportedScene, raster: Raster) -> pyluxcore.Scene:
    """Build a scene.

    Raises
    ------
    UnsupportedError
        Something in the scene has no counterpart here.
    """
    refuse_what_is_no_still_mesh(scene)
    target = pyluxcore.Scene()
    target.Parse(as_properties(camera_properties(scene, raster)))
    properties = add_lights(target, scene)
    materials = Materials(scene)
    objects: dict[str, Any] = {}
    defined: set[str] = set()
    for place, (prototype, matrix) in enumerate(placements(scene)):
        for idx, chunk in enumerate(scene.prototypes[prototype]["chunks"]):
            for side, triangles in enumerate(sides(scene, materials, chunk)):
                shape, name = f"chunk{prototype}_{idx}_{side}", f"object{place}_{idx}_{side}"
                if shape not in defined:
                    defined.add(shape)
                    define(target, shape, triangles)
                objects[f"scene.objects.{name}.shape"] = shape
                objects[f"scene.objects.{name}.material"] = materials.name_of(chunk)
                if place > 0:
                    objects[f"scene.objects.{name}.transformation"] = column_major(matrix)
    target.Parse(as_properties(materials.properties | properties | objects))
    return target


def sides(
    scene: ExportedScene, materials: Materials, chunk: dict[str, Any]
) -> tuple[Triangles, ...]:
    """Return a chunk's triangles; what shines has a back of its own, as LuxCore has only fronts."""
    front = Triangles(scene.positions(chunk), scene.triangles(chunk), scene.normals(chunk))
    return (front, front.back()) if materials.shines(chunk) else (front,)


def as_properties(values: dict[str, Any]) -> pyluxcore.Properties:
    """Convert names and values."""
    properties = pyluxcore.Properties()
    for name, value in values.items():
        listed = list(value) if isinstance(value, list | tuple) else [value]
        properties.Set(pyluxcore.Property(name, listed))
    return properties
