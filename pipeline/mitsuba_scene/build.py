"""The whole scene: sensor, integrator, emitters and shapes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import mitsuba as mi
import numpy as np

from mitsuba_scene.emitter import emitter
from mitsuba_scene.material import Materials
from mitsuba_scene.shapes import add_shapes
from unsupported import UnsupportedError

if TYPE_CHECKING:
    from exported import ExportedScene, Raster

TURN_AROUND = np.diag([-1.0, 1.0, -1.0, 1.0])
"""Mitsuba's cameras and flat shapes face +z, ours -z."""


def build_scene(scene: ExportedScene, raster: Raster, sampler: str) -> mi.Scene:
    """Build a scene that is rendered as the record says.

    Raises
    ------
    UnsupportedError
        Something in the scene has no counterpart here.
    """
    materials = Materials(scene)
    record: dict[str, Any] = {
        "type": "scene",
        "integrator": integrator(scene, materials),
        "sensor": sensor(scene, raster, sampler),
    }
    for idx, light in enumerate(scene.lights):
        relative_from_light = scene.to_relative(light["world_from_light"])
        record[f"light{idx}"] = emitter(light, relative_from_light)
    add_shapes(record, scene, materials)
    return mi.load_dict(record)


def integrator(scene: ExportedScene, materials: Materials) -> dict[str, Any]:
    """Path tracing to the same depth; Mitsuba counts segments, we count bounces."""
    hidden = {not light["visible_to_camera"] for light in scene.lights}
    if True in hidden and (False in hidden or materials.any_emits()):
        raise UnsupportedError("some emitters visible to the camera and some not")
    return {
        "type": "path",
        "max_depth": scene.settings["max_depth"] + 1,
        "hide_emitters": True in hidden,
    }


def sensor(scene: ExportedScene, raster: Raster, sampler: str) -> dict[str, Any]:
    """Return the camera and the film."""
    camera = scene.camera
    if scene.settings["filter"] != "box" or scene.settings.get("filter_radius") not in (None, 0.5):
        raise UnsupportedError("pixel filters other than a box of one pixel")
    if abs(raster.pixel_aspect - 1.0) > 1e-4:
        raise UnsupportedError("pixels that are not square")
    if camera["exposure_scale"] != 1.0:
        raise UnsupportedError("camera exposure")
    if camera["projection"] != "perspective":
        raise UnsupportedError("orthographic cameras")
    to_world = scene.to_relative(camera["world_from_camera"]) @ TURN_AROUND
    to_world[:3, :3] /= np.linalg.norm(to_world[:3, :3], axis=0)
    width, height = raster.right - raster.left, raster.top - raster.bottom
    record: dict[str, Any] = {
        "type": "perspective",
        "to_world": mi.ScalarTransform4f(to_world),
        "fov_axis": "x",
        "fov": math.degrees(2.0 * math.atan(0.5 * width)),
        "principal_point_offset_x": 0.5 * (raster.left + raster.right) / width,
        "principal_point_offset_y": -0.5 * (raster.bottom + raster.top) / height,
        "near_clip": max(camera["clipping_range"][0], 1e-4),
        "far_clip": camera["clipping_range"][1],
        "film": {
            "type": "hdrfilm",
            "width": raster.width,
            "height": raster.height,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": sampler},
    }
    if camera["lens_radius"] > 0.0:
        record |= {
            "type": "thinlens",
            "aperture_radius": camera["lens_radius"],
            "focus_distance": camera["focus_distance"],
        }
    return record
