"""Writes scene folders by hand, in the format of `Scene.export`."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

IDENTITY = np.eye(4)
ELEMENTS = ("u1", "<f2", "<f4")
"""NumPy types by the tile header's element type."""


def column_major(matrix: np.ndarray) -> list[float]:
    return [float(x) for x in np.asarray(matrix, dtype=np.float64).T.ravel()]


def constant_material(shader: str, **inputs: Any) -> dict[str, Any]:
    """A material whose inputs are numbers or triples."""
    nodes, named = [], {}
    for name, value in inputs.items():
        four = [*value, 1.0] if np.ndim(value) else [value, 0.0, 0.0, 1.0]
        named[name] = {"node": len(nodes), "channel": "rgb" if np.ndim(value) else "r"}
        nodes.append({"type": "constant", "value": [float(x) for x in four]})
    return {"path": f"/{shader}", "shader": shader, "inputs": named, "nodes": nodes}


def light(shape: dict[str, Any], world_from_light: np.ndarray, **fields: Any) -> dict[str, Any]:
    return {
        "path": "/light",
        "shape": shape,
        "world_from_light": column_major(world_from_light),
        "radiance": [1.0, 1.0, 1.0],
        "texture": None,
        "diffuse": 1.0,
        "specular": 1.0,
        "shaping": None,
        "visible_to_camera": True,
    } | fields


def camera(world_from_camera: np.ndarray, **fields: Any) -> dict[str, Any]:
    return {
        "path": "/camera",
        "world_from_camera": column_major(world_from_camera),
        "projection": "perspective",
        "screen_window": [-0.01, -0.01, 0.01, 0.01],
        "lens_radius": 0.0,
        "focus_distance": 0.0,
        "clipping_range": [0.01, 1e4],
        "exposure_scale": 1.0,
    } | fields


def look_down(height: float = 3.0) -> np.ndarray:
    """A camera on the y axis that sees the origin; its right is +x."""
    matrix = np.eye(4)
    matrix[:3, 1] = (0.0, 0.0, -1.0)
    matrix[:3, 2] = (0.0, 1.0, 0.0)
    matrix[1, 3] = height
    return matrix


def pointing_down(height: float = 0.0) -> np.ndarray:
    """Turns -z down and moves up."""
    return look_down(height)


class SceneWriter:
    """Collects chunks and writes the folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self.n_files = 0
        self.record: dict[str, Any] = {
            "origin_world": [0.0, 0.0, 0.0],
            "prim_paths": ["/mesh"],
            "prototypes": [],
            "materials": [],
            "textures": [],
            "lights": [],
            "camera": camera(look_down()),
            "settings": {
                "resolution": [8, 8],
                "pixel_aspect_ratio": 1.0,
                "data_window": None,
                "samples_per_pixel": 64,
                "max_depth": 1,
                "seed": 1,
                "filter": "box",
                "filter_radius": None,
                "threads": 0,
                "time_limit_secs": None,
                "aovs": [],
                "texture_memory_bytes": 1 << 30,
                "specialize": True,
            },
        }
        self.prototype("")

    def prototype(self, path: str, center: tuple[float, ...] = (0.0, 0.0, 0.0)) -> dict[str, Any]:
        record = {"path": path, "center": list(center), "chunks": [], "instances": []}
        self.record["prototypes"].append(record)
        return record

    def array(self, values: Any, dtype: str) -> str:
        name = f"{self.n_files}.bin"
        self.n_files += 1
        np.asarray(values, dtype=dtype).tofile(self.folder / name)
        return name

    def chunk(
        self,
        positions: Any,
        triangles: Any,
        material: int = 0,
        normals: Any = None,
        attributes: tuple[dict[str, Any], ...] = (),
        prototype: int = 0,
    ) -> None:
        record = {
            "prim_idx": 0,
            "material": material,
            "double_sided": False,
            "n_vertices": len(positions),
            "n_triangles": len(triangles),
            "positions": self.array(positions, "<f4"),
            "triangles": self.array(triangles, "<u4"),
            "normals": None if normals is None else self.array(normals, "<f4"),
            "attributes": [a | {"data": self.array(a["data"], "<f4")} for a in attributes],
        }
        self.record["prototypes"][prototype]["chunks"].append(record)

    def texture(
        self, *tiles: tuple[int, np.ndarray], element: str = "<f4", transfer: int = 0
    ) -> int:
        """Write images of (height, width, 3), lowest row first; (0, image) for a plain one.

        They must be smaller than a tile. A transfer of 1 is sRGB.
        """
        files = []
        for udim, image in tiles:
            height, width, channels = image.shape
            fixed = [1, width, height, channels, ELEMENTS.index(element), transfer, 0, 0, 1, 0]
            header = struct.pack("<8s10I", b"KLTILES\0", *fixed)
            name = self.folder / f"{len(self.record['textures'])}.{udim}.tiles"
            level = struct.pack("<2IQ", width, height, 64)
            name.write_bytes(header + level + image.astype(element).tobytes())
            files.append({"udim": udim, "tiles": str(name)})
        self.record["textures"].append({"path": "image.exr", "files": files})
        return len(self.record["textures"]) - 1

    def floor(self, half: float = 1.0, material: int = 0, **fields: Any) -> None:
        """A square that faces +y, with st over it: (0, 0) at (-x, +z)."""
        corners = [(-half, 0, half), (half, 0, half), (half, 0, -half), (-half, 0, -half)]
        self.chunk(corners, [(0, 1, 2), (0, 2, 3)], material, **fields)

    def inward_box(self, material: dict[str, Any]) -> None:
        """A closed box from -1 to 1, seen from its centre."""
        self.record["materials"] = [material]
        corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        self.chunk(corners, [t for a, b, c, d in quads for t in ((a, c, b), (a, d, c))])
        self.record["camera"] = camera(np.eye(4), screen_window=[-1, -1, 1, 1])

    def write(self) -> Path:
        (self.folder / "scene.json").write_text(json.dumps(self.record))
        return self.folder
