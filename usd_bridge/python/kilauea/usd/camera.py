"""The camera record: which camera, its window on the image, its lens and its exposure."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdUtils

from kilauea.bounds import world_bounds
from kilauea.errors import UsageError
from kilauea.usd.arrays import matrix
from kilauea.usd.context import Context
from kilauea.usd.moving_space import transform_attributes
from kilauea.usd.settings import RenderSpec

DEFAULT_FRAMING = "<default framing>"
_TENTH = Gf.Camera.FOCAL_LENGTH_UNIT
_FRAMING_HALF_ANGLE = math.radians(20.0)
_FRAMING_MARGIN = 1.1


def choose(stage: Usd.Stage, spec: RenderSpec, time: Usd.TimeCode) -> UsdGeom.Camera | None:
    """Choose the asked camera, else `main_cam`, else the first of the stage."""
    prim = None
    if spec.camera and spec.camera.startswith("/"):
        prim = stage.GetPrimAtPath(spec.camera)
    found = [] if prim else _find(stage, time)
    if spec.camera:
        prim = prim or next((p for p in found if p.GetName() == spec.camera), None)
        if not prim or not prim.IsA(UsdGeom.Camera):
            raise UsageError(f"{spec.camera} is not a camera of the stage")
        return UsdGeom.Camera(prim)
    primary = UsdUtils.GetPrimaryCameraName()
    named = [p for p in found if p.GetName() == primary]
    return UsdGeom.Camera((named or found)[0]) if found else None


def _find(stage: Usd.Stage, time: Usd.TimeCode) -> list[Usd.Prim]:
    """Return the cameras of a stage that are not invisible, in its order."""
    everything = Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
    return [
        prim
        for prim in everything
        if prim.IsA(UsdGeom.Camera)
        and UsdGeom.Imageable(prim).ComputeVisibility(time) != UsdGeom.Tokens.invisible
    ]


def shutter(
    camera: UsdGeom.Camera | None, spec: RenderSpec, time: Usd.TimeCode
) -> tuple[float, float] | None:
    """Return when the shutter opens and closes, relative to the frame; None where nothing blurs."""
    if camera is None or not spec.motion_blur:
        return None
    opens = float(camera.GetShutterOpenAttr().Get(time))
    closes = float(camera.GetShutterCloseAttr().Get(time))
    if closes < opens:
        spec.warnings.append(f"{camera.GetPath()}: the shutter closes before it opens: no blur")
    return (opens, closes) if closes > opens else None


def record(cx: Context, spec: RenderSpec, camera: UsdGeom.Camera | None) -> dict[str, Any]:
    """Return the `kilauea_scene::Camera` record; may adjust the spec's pixel aspect ratio."""
    if camera is None:
        return _default_framing(cx, spec)
    time, path = cx.time, str(camera.GetPath())
    warnings = cx.frame.warnings

    def get(attribute: Usd.Attribute) -> float:
        return float(attribute.Get(time))

    perspective = camera.GetProjectionAttr().Get(time) != UsdGeom.Tokens.orthographic
    focal_length = get(camera.GetFocalLengthAttr())
    aperture = (get(camera.GetHorizontalApertureAttr()), get(camera.GetVerticalApertureAttr()))
    offset = (
        get(camera.GetHorizontalApertureOffsetAttr()),
        get(camera.GetVerticalApertureOffsetAttr()),
    )
    if perspective and focal_length <= 0:
        raise UsageError(f"{path}: focalLength {focal_length} is not positive")
    if min(aperture) <= 0:
        raise UsageError(f"{path}: aperture {aperture[0]} x {aperture[1]} is not positive")
    window = conform(aperture, spec)
    # On the plane at distance one, or in scene units: aperture counts tenths of them.
    scale = 1 / focal_length if perspective else _TENTH
    if camera.GetClippingPlanesAttr().Get(time):
        warnings.append(f"{path}: clippingPlanes are not rendered yet")

    focus_distance = get(camera.GetFocusDistanceAttr())
    f_stop = get(camera.GetFStopAttr())
    lens_radius = 0.0
    if perspective and spec.depth_of_field and f_stop > 0:
        if focus_distance > 0:
            lens_radius = _TENTH * focal_length / (2 * f_stop)
        else:
            warnings.append(f"{path}: fStop without focusDistance: everything is in focus")
    keys = _world_from_camera(cx, camera.GetPrim())
    return {
        "path": path,
        "world_from_camera": keys[0],
        "later_world_from_camera": keys[1:],
        "shutter": list(cx.motion.shutter or (0.0, 0.0)),
        "projection": "perspective" if perspective else "orthographic",
        "screen_window": [
            (offset[0] - window[0] / 2) * scale,
            (offset[1] - window[1] / 2) * scale,
            (offset[0] + window[0] / 2) * scale,
            (offset[1] + window[1] / 2) * scale,
        ],
        "lens_radius": lens_radius,
        "focus_distance": focus_distance if focus_distance > 0 else 1.0,
        "clipping_range": [float(v) for v in camera.GetClippingRangeAttr().Get(time)],
        "exposure_scale": float(camera.ComputeLinearExposureScale(time)),
    }


def _world_from_camera(cx: Context, prim: Usd.Prim) -> list[list[float]]:
    """Return the transform at each motion key, without scale and shear."""

    def rigid(time: float) -> Any:
        world_from_prim = cx.motion.xforms(time).GetLocalToWorldTransform(prim)
        return np.array(world_from_prim.GetOrthonormalized(False))

    times = cx.motion.times(prim, transform_attributes(prim, with_ancestors=True))
    return [key.ravel().tolist() for key in cx.motion.matrices(times, rigid)]


def conform(aperture: tuple[float, float], spec: RenderSpec) -> tuple[float, float]:
    """Fit the aperture to the image's aspect ratio by the settings' aspectRatioConformPolicy."""
    width, height = aperture
    resolution_aspect = spec.resolution[0] / spec.resolution[1]
    image_aspect = spec.pixel_aspect_ratio * resolution_aspect
    wider = width / height > image_aspect
    match spec.conform_policy:
        case "adjustPixelAspectRatio":
            spec.pixel_aspect_ratio = width / height / resolution_aspect
            return aperture
        case "adjustApertureWidth":
            adjust_width = True
        case "adjustApertureHeight":
            adjust_width = False
        case "cropAperture":
            adjust_width = wider
        case _:
            adjust_width = not wider
    return (height * image_aspect, height) if adjust_width else (width, width / image_aspect)


def _default_framing(cx: Context, spec: RenderSpec) -> dict[str, Any]:
    """Look at the stage's bounds from the front, far enough away to see all of them."""
    box = world_bounds(cx.frame)
    low, high = box.tolist() if box is not None else ((-1.0,) * 3, (1.0,) * 3)
    bounds = Gf.Range3d(Gf.Vec3d(*low), Gf.Vec3d(*high))
    z_up = UsdGeom.GetStageUpAxis(cx.stage) == UsdGeom.Tokens.z
    size = bounds.GetSize()
    wide, high, deep = (size[0], size[2], size[1]) if z_up else (size[0], size[1], size[2])
    image_aspect = spec.pixel_aspect_ratio * spec.resolution[0] / spec.resolution[1]
    tangent = math.tan(_FRAMING_HALF_ANGLE)
    half_height = max(high, wide / image_aspect, 1e-6) / 2 * _FRAMING_MARGIN
    distance = half_height / tangent + deep / 2

    toward_viewer = Gf.Vec3d(0, -1, 0) if z_up else Gf.Vec3d(0, 0, 1)
    turn = Gf.Rotation(Gf.Vec3d(1, 0, 0), 90 if z_up else 0)
    eye = bounds.GetMidpoint() + distance * toward_viewer
    cx.frame.notes.append("the stage has no camera: framing its bounds from the front")
    return {
        "path": DEFAULT_FRAMING,
        "world_from_camera": list(matrix(Gf.Matrix4d(turn, eye))),
        "projection": "perspective",
        "screen_window": [
            *(-tangent * image_aspect, -tangent, tangent * image_aspect, tangent),
        ],
        "lens_radius": 0.0,
        "focus_distance": distance,
        "clipping_range": [distance * 1e-4, distance * 1e4],
        "exposure_scale": 1.0,
    }
