"""Lights, measured to match UsdLux radiometry.

Rects and disks are surfaces here. Of glass that refracts nothing, they let paths through, as
lights of USD do, but no shadow rays; and a path counts them as a bounce.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from luxcore_scene.mesh import Triangles, add_object
from tiles import read_texels
from unsupported import UnsupportedError

if TYPE_CHECKING:
    import pyluxcore

    from exported import ExportedScene

N_DISK_CORNERS = 128
LUXCORE_FROM_DOME = np.float64([(0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
"""From dome space (+y up, image centre toward +z, its left toward +x) to that of LuxCore.

LuxCore's image has +z on top, starts at +x and goes on toward +y: this turns and mirrors.
"""


def add_lights(target: pyluxcore.Scene, scene: ExportedScene) -> dict[str, Any]:
    """Define what lights need; returns the properties of all of them."""
    properties: dict[str, Any] = {}
    for idx, light in enumerate(scene.lights):
        refuse_what_has_no_counterpart(light)
        name, kind = f"light{idx}", light["shape"]["type"]
        relative_from_light = scene.to_relative(light["world_from_light"])
        if kind == "dome":
            record = dome(target, scene, light, relative_from_light, name)
        elif kind == "distant":
            record = distant(light, relative_from_light)
        elif kind == "sphere":
            record = sphere(light, relative_from_light)
        else:
            properties |= flat_light(target, light, relative_from_light, name)
            continue
        properties |= {f"scene.lights.{name}.{key}": value for key, value in record.items()}
    return properties


def refuse_what_has_no_counterpart(light: dict[str, Any]) -> None:
    """Raise where a light would shine differently."""
    kind = light["shape"]["type"]
    if light["shaping"] is not None or (light["texture"] is not None and kind != "dome"):
        raise UnsupportedError(f"{light['path']}: textured and shaped lights")
    if (light["diffuse"], light["specular"]) != (1.0, 1.0):
        raise UnsupportedError(f"{light['path']}: inputs:diffuse and :specular")
    if kind == "cylinder":
        raise UnsupportedError(f"{light['path']}: cylinder lights")
    if kind == "sphere" and light["visible_to_camera"]:
        raise UnsupportedError(f"{light['path']}: sphere lights that the camera sees")


def dome(
    target: pyluxcore.Scene,
    scene: ExportedScene,
    light: dict[str, Any],
    relative_from_light: np.ndarray,
    name: str,
) -> dict[str, Any]:
    """Return a dome: constant, or an image that is looked up along the direction."""
    hidden = {"visibility.camera.enable": light["visible_to_camera"]}
    if light["texture"] is None:
        return {"type": "constantinfinite", "color": light["radiance"], **hidden}
    texels = read_texels(scene.textures[light["texture"]]["files"][0]["tiles"])
    if texels.is_srgb:
        raise UnsupportedError(f"{light['path']}: a dome in sRGB")
    rgb = np.ascontiguousarray(texels.rgba[::-1, :, :3] * np.float32(light["radiance"]))
    height, width, _ = rgb.shape
    target.DefineImageMap(name, rgb.ravel(), 1.0, 3, width, height)
    axes = relative_from_light[:3, :3] / np.linalg.norm(relative_from_light[:3, :3], axis=0)
    matrix = np.eye(4)
    matrix[:3, :3] = axes @ LUXCORE_FROM_DOME.T
    return {
        "type": "infinite",
        "file": name,
        "gamma": 1.0,
        "transformation": column_major(matrix),
        **hidden,
    }


def distant(light: dict[str, Any], relative_from_light: np.ndarray) -> dict[str, Any]:
    """Return a sun of our radiance, or of our irradiance where it has no size."""
    direction = -relative_from_light[:3, 2]
    record = {"direction": direction.tolist(), "color": light["radiance"]}
    angle = light["shape"]["angle_degrees"]
    if angle == 0.0:
        return {"type": "sharpdistant", **record}
    return {"type": "distant", "theta": 0.5 * angle, **record}


def sphere(light: dict[str, Any], relative_from_light: np.ndarray) -> dict[str, Any]:
    """Return a sphere of our radiance; LuxCore asks for its power, pi times area times radiance."""
    lengths = np.linalg.norm(relative_from_light[:3, :3], axis=0)
    if np.ptp(lengths) > 1e-5 * lengths.max():
        raise UnsupportedError(f"{light['path']}: ellipsoids")
    radius = float(light["shape"]["radius"] * lengths[0])
    power = 4.0 * (math.pi * radius) ** 2 * np.float64(light["radiance"])
    return {
        "type": "sphere",
        "position": relative_from_light[:3, 3].tolist(),
        "radius": radius,
        "color": power.tolist(),
    }


def flat_light(
    target: pyluxcore.Scene, light: dict[str, Any], relative_from_light: np.ndarray, name: str
) -> dict[str, Any]:
    """Add a rect or disk as a mesh that shines where it faces, -z of the light."""
    shape = light["shape"]
    if shape["type"] == "rect":
        x, y = 0.5 * shape["width"], 0.5 * shape["height"]
        corners = np.array([(-x, -y, 0.0), (-x, y, 0.0), (x, y, 0.0), (x, -y, 0.0)])
    else:
        angle = -2.0 * math.pi * np.arange(N_DISK_CORNERS) / N_DISK_CORNERS
        # As large as the disk, not inscribed.
        radius = shape["radius"] * math.sqrt(
            2.0 * math.pi / (N_DISK_CORNERS * math.sin(2.0 * math.pi / N_DISK_CORNERS))
        )
        corners = radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    fan = [(0, i, i + 1) for i in range(1, len(corners) - 1)]
    properties = {
        f"scene.materials.{name}.type": "glass",
        f"scene.materials.{name}.kr": [0.0, 0.0, 0.0],
        f"scene.materials.{name}.kt": [1.0, 1.0, 1.0],
        f"scene.materials.{name}.interiorior": 1.0,
        f"scene.materials.{name}.exteriorior": 1.0,
        f"scene.materials.{name}.emission": light["radiance"],
        f"scene.materials.{name}.emission.gain.normalizebycolor": False,
    }
    placed = Triangles(corners, np.array(fan), None).placed(relative_from_light)
    properties |= add_object(target, name, placed, material=name)
    properties[f"scene.objects.{name}.camerainvisible"] = not light["visible_to_camera"]
    return properties


def column_major(matrix: np.ndarray) -> list[float]:
    """Flatten as LuxCore wants matrices."""
    return matrix.T.ravel().tolist()
