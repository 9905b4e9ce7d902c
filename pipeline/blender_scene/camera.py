"""The camera: projection, window, depth of field, clipping and exposure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from blender_scene.motion import move

if TYPE_CHECKING:
    from exported import ExportedScene, Raster

MM_PER_UNIT = 1000.0
"""Blender divides focal lengths by this where it turns f-stops into lens radii."""


def build_camera(scene: ExportedScene, raster: Raster) -> None:
    """Make the record's camera the active one and set the resolution of the raster."""
    record = scene.camera
    keys = scene.camera_keys
    for relative_from_camera in keys:
        # Lengths of the record are in scene units: scale on a camera only turns its axes.
        relative_from_camera[:3, :3] /= np.linalg.norm(relative_from_camera[:3, :3], axis=0)

    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "HORIZONTAL"
    data.clip_start = record["clipping_range"][0]
    data.clip_end = record["clipping_range"][1]
    window_width = raster.right - raster.left
    if record["projection"] == "orthographic":
        data.type = "ORTHO"
        data.ortho_scale = window_width
    set_lens(data, window_width, record["lens_radius"])
    data.dof.focus_distance = record["focus_distance"]
    data.shift_x = 0.5 * (raster.left + raster.right) / window_width
    data.shift_y = 0.5 * (raster.bottom + raster.top) / window_width

    camera = bpy.data.objects.new("camera", data)
    move(camera, keys)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera

    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = raster.width, raster.height
    render.resolution_percentage = 100
    render.pixel_aspect_x = max(1.0, raster.pixel_aspect)
    render.pixel_aspect_y = max(1.0, 1.0 / raster.pixel_aspect)
    bpy.context.scene.cycles.film_exposure = record["exposure_scale"]


def set_lens(data: bpy.types.Camera, window_width: float, lens_radius: float) -> None:
    """Choose sensor and focal length for the field of view, f-stop for the lens radius."""
    # Only the ratio of sensor to focal length matters, and neither may be below a millimetre.
    unit = 36.0 * max(1.0, 1.0 / window_width)
    data.lens = unit
    data.sensor_width = unit * window_width
    data.dof.use_dof = lens_radius > 0.0
    if lens_radius > 0.0:
        aperture_unit = 1.0 if data.type == "ORTHO" else data.lens / MM_PER_UNIT
        data.dof.aperture_fstop = aperture_unit / (2.0 * lens_radius)
