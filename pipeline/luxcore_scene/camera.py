"""The camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from unsupported import UnsupportedError

if TYPE_CHECKING:
    from exported import ExportedScene, Raster


def camera_properties(scene: ExportedScene, raster: Raster) -> dict[str, Any]:
    """Return the camera; at 90 degrees its screen window lies at distance one, as ours does."""
    camera = scene.camera
    if camera["projection"] != "perspective":
        raise UnsupportedError("orthographic cameras")
    if camera["exposure_scale"] != 1.0:
        raise UnsupportedError("camera exposure")
    (matrix,) = scene.camera_keys[:1]
    eye, up, back = matrix[:3, 3], matrix[:3, 1], matrix[:3, 2]
    near, far = camera["clipping_range"]
    # LuxCore counts rows from the last one's top edge, where its bottom edge is meant.
    row = (raster.top - raster.bottom) / raster.height
    window = [raster.left, raster.right, raster.bottom - row, raster.top - row]
    return {
        "scene.camera.type": "perspective",
        "scene.camera.lookat.orig": eye.tolist(),
        "scene.camera.lookat.target": (eye - back).tolist(),
        "scene.camera.up": up.tolist(),
        "scene.camera.fieldofview": 90.0,
        "scene.camera.screenwindow": window,
        "scene.camera.autofocus.enable": False,
        "scene.camera.lensradius": camera["lens_radius"],
        "scene.camera.focaldistance": camera["focus_distance"] or 1.0,
        "scene.camera.cliphither": near,
        "scene.camera.clipyon": far,
    }
