"""Reads a scene folder as `Scene.export` of `kilauea._native` writes it.

`scene.json` holds the records of `kilauea-scene`; bulk arrays are little-endian files beside it.
This needs NumPy alone, so that Blender's and Mitsuba's Python can use it too.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np


@dataclass(frozen=True)
class ExportedScene:
    """An exported scene; arrays are read when asked for."""

    folder: Path
    record: dict[str, Any]

    @classmethod
    def open(cls, folder: str | Path) -> ExportedScene:
        """Open the folder that holds `scene.json`."""
        folder = Path(folder)
        return cls(folder, json.loads((folder / "scene.json").read_text(encoding="utf-8")))

    def array(self, name: str, dtype: str, width: int) -> np.ndarray:
        """Read a raw file as rows of `width` values."""
        return np.fromfile(self.folder / name, dtype=dtype).reshape(-1, width)

    def positions(self, chunk: dict[str, Any]) -> np.ndarray:
        """Return (n, 3) points, relative to the prototype's centre."""
        return self.array(chunk["positions"], "<f4", 3)

    def triangles(self, chunk: dict[str, Any]) -> np.ndarray:
        """Return (n, 3) vertex indices."""
        return self.array(chunk["triangles"], "<u4", 3)

    def normals(self, chunk: dict[str, Any]) -> np.ndarray | None:
        """Return (n, 3) unit normals, or None where the mesh is faceted."""
        name = chunk.get("normals")
        return None if name is None else self.array(name, "<f4", 3)

    def position_keys(self, chunk: dict[str, Any]) -> list[np.ndarray]:
        """Return a mesh's (n, 3) points at each motion key; one where it stands still."""
        keys = [chunk, *chunk.get("later_keys", ())]
        return [self.array(key["positions"], "<f4", 3) for key in keys]

    def values(self, attribute: dict[str, Any]) -> np.ndarray:
        """Return (n, width) values of an attribute."""
        return self.array(attribute["data"], "<f4", attribute["width"])

    def instance_keys(self, instances: dict[str, Any]) -> list[np.ndarray]:
        """Return (n, 4, 4) matrices for column vectors, prototype to parent, at each key."""
        files = [instances["matrices"], *instances.get("later_matrices", ())]
        columns = (self.array(file, "<f8", 16) for file in files)
        return [matrices.reshape(-1, 4, 4).transpose(0, 2, 1) for matrices in columns]

    @cached_property
    def has_motion(self) -> bool:
        """Whether anything moves while the shutter is open."""
        return bool(self.camera.get("later_world_from_camera")) or any(
            any(chunk.get("later_keys") for chunk in prototype["chunks"])
            or any(chunk["later_points"] for chunk in prototype.get("curves", ()))
            or any(chunk["later_centers"] for chunk in prototype.get("points", ()))
            or any(instances.get("later_matrices") for instances in prototype["instances"])
            for prototype in self.prototypes
        )

    @property
    def camera_keys(self) -> list[np.ndarray]:
        """The camera's (4, 4) matrices to the shifted world, at each key."""
        later = self.camera.get("later_world_from_camera", ())
        return [self.to_relative(m) for m in (self.camera["world_from_camera"], *later)]

    @property
    def prototypes(self) -> list[dict[str, Any]]:
        """Geometry; entry 0 is the world."""
        return self.record["prototypes"]

    @property
    def materials(self) -> list[dict[str, Any]]:
        """`Material` records."""
        return self.record["materials"]

    @property
    def textures(self) -> list[dict[str, Any]]:
        """`TextureSource` records."""
        return self.record["textures"]

    @property
    def lights(self) -> list[dict[str, Any]]:
        """`Light` records."""
        return self.record["lights"]

    @property
    def camera(self) -> dict[str, Any]:
        """The `Camera` record."""
        return self.record["camera"]

    @property
    def settings(self) -> dict[str, Any]:
        """The `RenderSettings` record."""
        return self.record["settings"]

    @cached_property
    def relative_from_world(self) -> np.ndarray:
        """The shift that puts the scene's origin at zero, where `float32` is finest."""
        return translation(-np.asarray(self.record["origin_world"], dtype=np.float64))

    def to_relative(self, column_major: list[float]) -> np.ndarray:
        """Return a (4, 4) matrix to the shifted world from a record's matrix to the world."""
        world_from_local = np.asarray(column_major, dtype=np.float64).reshape(4, 4).T
        return self.relative_from_world @ world_from_local

    def placed(self, parent: dict[str, Any], instances: dict[str, Any]) -> list[np.ndarray]:
        """Return (n, 4, 4) matrices between the two prototypes' centred spaces, at each key."""
        child = self.prototypes[instances["prototype"]]
        return [
            translation(-np.asarray(parent["center"]))
            @ (parent_from_child @ translation(np.asarray(child["center"])))
            for parent_from_child in self.instance_keys(instances)
        ]


def translation(offset: np.ndarray) -> np.ndarray:
    """Return the (4, 4) matrix that adds `offset`."""
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


@dataclass(frozen=True)
class Raster:
    """The pixels that are rendered and the part of the image plane that they cover."""

    width: int
    height: int
    left: float
    bottom: float
    right: float
    top: float

    @classmethod
    def of(cls, scene: ExportedScene) -> Raster:
        """Restrict the camera's screen window to the data window, overscan included."""
        left, bottom, right, top = scene.camera["screen_window"]
        width, height = scene.settings["resolution"]
        window = scene.settings.get("data_window") or {"min": [0, 0], "max": [width, height]}
        (x0, y0), (x1, y1) = window["min"], window["max"]
        per_column = (right - left) / width
        per_row = (top - bottom) / height
        return cls(
            width=x1 - x0,
            height=y1 - y0,
            left=left + x0 * per_column,
            bottom=top - y1 * per_row,
            right=left + x1 * per_column,
            top=top - y0 * per_row,
        )

    @property
    def pixel_aspect(self) -> float:
        """Width of a pixel over its height on the image plane."""
        per_column = (self.right - self.left) / self.width
        return per_column / ((self.top - self.bottom) / self.height)
