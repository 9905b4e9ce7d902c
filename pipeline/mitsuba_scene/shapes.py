"""Triangle meshes, shared between instances where there are any."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Any

import mitsuba as mi
import numpy as np

from still_meshes import placements, refuse_what_is_no_still_mesh
from unsupported import UnsupportedError

if TYPE_CHECKING:
    from exported import ExportedScene
    from mitsuba_scene.material import Materials


def add_shapes(record: dict[str, Any], scene: ExportedScene, materials: Materials) -> None:
    """Add every chunk of every prototype to a scene's record."""
    refuse_what_is_no_still_mesh(scene)
    places: dict[int, list[np.ndarray]] = defaultdict(list)
    for prototype, matrix in placements(scene):
        places[prototype].append(matrix)
    for prototype, matrices in places.items():
        chunks = scene.prototypes[prototype]["chunks"]
        if not chunks:
            continue
        if len(matrices) == 1:
            for idx, chunk in enumerate(chunks):
                shape = mesh(scene, chunk, materials, matrices[0])
                record[f"prototype{prototype}_{idx}"] = shape
            continue
        group: dict[str, Any] = {"type": "shapegroup"}
        for idx, chunk in enumerate(chunks):
            if materials.emission(chunk["material"]) is not None:
                raise UnsupportedError("instances that shine")
            group[f"chunk{idx}"] = mesh(scene, chunk, materials, np.eye(4))
        record[f"prototype{prototype}"] = group
        for idx, matrix in enumerate(matrices):
            record[f"instance{prototype}_{idx}"] = {
                "type": "instance",
                "to_world": mi.ScalarTransform4f(matrix),
                "shapegroup": {"type": "ref", "id": f"prototype{prototype}"},
            }


def mesh(
    scene: ExportedScene, chunk: dict[str, Any], materials: Materials, matrix: np.ndarray
) -> mi.Mesh:
    """Make a mesh of a chunk, transformed."""
    positions = scene.positions(chunk) @ matrix[:3, :3].T + matrix[:3, 3]
    triangles = scene.triangles(chunk)
    if np.linalg.det(matrix[:3, :3]) < 0.0:
        triangles = triangles[:, ::-1]
    normals = scene.normals(chunk)
    names = {attribute["name"]: attribute_name(attribute) for attribute in chunk["attributes"]}
    properties = mi.Properties()
    properties["mesh_bsdf"] = mi.load_dict(materials.bsdf(chunk["material"], names))
    properties["face_normals"] = normals is None
    emission = materials.emission(chunk["material"])
    if emission is not None:
        properties["mesh_emitter"] = mi.load_dict({"type": "area", "radiance": emission})
    shape = mi.Mesh(
        f"chunk{chunk['prim_idx']}",
        vertex_count=len(positions),
        face_count=len(triangles),
        has_vertex_normals=normals is not None,
        has_vertex_texcoords=False,
        props=properties,
    )
    parameters = mi.traverse(shape)
    parameters["vertex_positions"] = np.float32(positions).ravel()
    parameters["faces"] = np.uint32(triangles).ravel()
    if normals is not None:
        turned = normals @ np.linalg.inv(matrix[:3, :3])
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        parameters["vertex_normals"] = np.float32(turned).ravel()
    parameters.update()
    for attribute in chunk["attributes"]:
        values = scene.values(attribute)
        if attribute["interpolation"] == "constant":
            values = np.tile(values, (len(positions), 1))
        shape.add_attribute(attribute_name(attribute), attribute["width"], values.ravel())
    return shape


def attribute_name(attribute: dict[str, Any]) -> str:
    """Return the name under which a mesh holds a primvar; Mitsuba reads the domain from it."""
    domain = "face" if attribute["interpolation"] == "uniform" else "vertex"
    return f"{domain}_{attribute['name']}"
