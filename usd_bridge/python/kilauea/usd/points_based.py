"""What meshes, curves and points have in common: points that move, and widths."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from kilauea import payload
from kilauea.usd import primvars
from kilauea.usd.arrays import read_floats, read_ints, read_points
from kilauea.usd.context import Context
from kilauea.usd.motion import moving


def point_keys(
    cx: Context, schema: UsdGeom.PointBased, topology: tuple[Usd.Attribute, ...]
) -> tuple[list[float], list[Any]]:
    """Read points at their motion keys: times, and an (n, 3) array for each.

    Velocities and accelerations take the place of interpolation between samples. Where the
    topology changes while the shutter is open, and there are no velocities, nothing moves.
    """
    prim, frame = schema.GetPrim(), cx.motion.frame
    velocities = schema.GetVelocitiesAttr()
    if velocities.HasAuthoredValue():
        accelerated = schema.GetAccelerationsAttr().HasAuthoredValue()
        times = cx.motion.evenly_spaced(prim, _curved(prim, frame) if accelerated else 1)
        keys = [_with_velocity(schema, time, frame) for time in times]
    else:
        times = cx.motion.times(prim, [schema.GetPointsAttr()])
        keys = [read_points(schema.GetPointsAttr(), Usd.TimeCode(t)) for t in times]
        if len(times) > 1 and not _same_topology(keys, topology, times, frame):
            cx.notes.add("topology changes while the shutter is open: not blurred", prim)
            times = [frame]
            keys = [read_points(schema.GetPointsAttr(), Usd.TimeCode(frame))]
    keys = moving(keys)
    return times[: len(keys)] if len(keys) > 1 else [frame], keys


def widths(schema: Any, time: Usd.TimeCode) -> payload.Primvar | None:
    """Read the diameters of curves or points: `primvars:widths` stands before `widths`."""
    primvar = UsdGeom.PrimvarsAPI(schema.GetPrim()).GetPrimvar("widths")
    if primvar and primvar.HasValue():
        return primvars.convert(primvar, time)
    attribute = schema.GetWidthsAttr()
    if not attribute.HasValue():
        return None
    return payload.Primvar(
        name="widths",
        width=1,
        interpolation=str(schema.GetWidthsInterpolation()),
        values=read_floats(attribute, time).reshape(-1),
    )


def _with_velocity(schema: UsdGeom.PointBased, time: float, frame: float) -> Any:
    points = schema.ComputePointsAtTime(Usd.TimeCode(time), Usd.TimeCode(frame))
    return np.asarray(points, np.float32).reshape(-1, 3)


def _curved(prim: Usd.Prim, frame: float) -> int:
    """Return how many intervals a prim wants for motion that is not straight."""
    n_samples = UsdGeom.MotionAPI(prim).ComputeNonlinearSampleCount(Usd.TimeCode(frame))
    return max(int(n_samples) - 1, 1)


def _same_topology(
    keys: list[Any], topology: tuple[Usd.Attribute, ...], times: list[float], frame: float
) -> bool:
    if any(len(key) != len(keys[0]) for key in keys):
        return False
    for attribute in topology:
        if attribute.ValueMightBeTimeVarying():
            at_frame = read_ints(attribute, Usd.TimeCode(frame))
            at_keys = (read_ints(attribute, Usd.TimeCode(time)) for time in times)
            if not all(np.array_equal(at_frame, found) for found in at_keys):
                return False
    return True
