"""Lights as emitters."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from unsupported import UnsupportedError

CLEAR = {"type": "mask", "opacity": 0.0, "bsdf": {"type": "diffuse"}}
"""Lets paths through, as lights of USD do, but no shadow rays."""


def emitter(light: dict[str, Any], relative_from_light: np.ndarray) -> dict[str, Any]:
    """Return the record of an emitter, or of a shape that emits."""
    if light["texture"] is not None or light["shaping"] is not None:
        raise UnsupportedError(f"{light['path']}: textured and shaped lights")
    if (light["diffuse"], light["specular"]) != (1.0, 1.0):
        raise UnsupportedError(f"{light['path']}: inputs:diffuse and :specular")
    shape = light["shape"]
    radiance = {"type": "rgb", "value": light["radiance"]}
    if shape["type"] == "dome":
        return {"type": "constant", "radiance": radiance}
    if shape["type"] == "distant":
        if shape["angle_degrees"] != 0.0:
            raise UnsupportedError(f"{light['path']}: a distant light with an angle")
        direction = -relative_from_light[:3, 2]
        return {"type": "directional", "direction": direction.tolist(), "irradiance": radiance}
    record = area_shape(shape, relative_from_light)
    return record | {"emitter": {"type": "area", "radiance": radiance}, "bsdf": CLEAR}


def area_shape(shape: dict[str, Any], relative_from_light: np.ndarray) -> dict[str, Any]:
    """Return a shape that faces where the light shines."""
    kind = shape["type"]
    if kind == "rect":
        sizes, plugin = (-0.5 * shape["width"], 0.5 * shape["height"], -1.0), "rectangle"
    elif kind == "disk":
        sizes, plugin = (-shape["radius"], shape["radius"], -1.0), "disk"
    elif kind == "sphere":
        sizes, plugin = (shape["radius"],) * 3, "sphere"
    else:
        raise UnsupportedError("cylinder lights")
    to_world = relative_from_light @ np.diag([*sizes, 1.0])
    return {"type": plugin, "to_world": mi.ScalarTransform4f(to_world)}
