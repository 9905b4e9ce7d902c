"""Prims whose transform moves while the shutter is open, as spaces that move.

All below such a prim is gathered in a payload prototype of its own, placed once, with motion keys:
that costs a few matrices, however large the subtree is.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom

from kilauea import payload
from kilauea.usd.context import Context, Inherited, Space


def world_from(cx: Context, space: Space, time: float | None = None) -> Gf.Matrix4d:
    """Return the transform of the space's first placement to the world; at the frame's time."""
    if space.index == payload.WORLD:
        return Gf.Matrix4d(1)
    return cx.motion.xforms(time).GetLocalToWorldTransform(space.root)


def transform_keys(cx: Context, prim: Usd.Prim, above: Inherited, space: Space) -> list[Any]:
    """Return (4, 4) matrices from a prim to its space at their motion keys; one if it is still."""
    xformable = UsdGeom.Xformable(prim)
    still: list[Any] = [None]
    if not xformable:
        return still
    resets = xformable.GetResetXformStack()
    if not resets and not xformable.TransformMightBeTimeVarying():
        return still
    times = cx.motion.times(prim, transform_attributes(prim, with_ancestors=resets))
    if len(times) == 1:
        return still

    def space_from_prim(time: float) -> Any:
        local = xformable.GetLocalTransformation(Usd.TimeCode(time))
        outer = world_from(cx, space, time).GetInverse() if resets else above.space_from_prim
        return np.array(local * outer)

    return cx.motion.matrices(times, space_from_prim)


def transform_attributes(prim: Usd.Prim, with_ancestors: bool) -> list[Usd.Attribute]:
    """Return the attributes that a prim's transform is made of."""
    attributes = []
    while prim and not prim.IsPseudoRoot():
        if prim.IsA(UsdGeom.Xformable):
            ops = UsdGeom.Xformable(prim).GetOrderedXformOps()
            attributes += [op.GetAttr() for op in ops]
        prim = prim.GetParent() if with_ancestors else None
    return attributes


def add(cx: Context, prim: Usd.Prim, keys: list[Any], outer: Space) -> Space:
    """Place a new space in another; what its contents need from outside goes through both."""
    cx.frame.prototypes.append(str(prim.GetPath()))
    moving = Space(
        len(cx.frame.prototypes) - 1,
        prim,
        outer.outside_primvars,
        outer.fallback_material,
        outer.open_primvars,
        outer.closed_primvars,
    )
    cx.spaces["moving", moving.index] = moving
    cx.frame.instances.append(
        payload.Instances(
            path=str(prim.GetPath()),
            parent=outer.index,
            prototype=moving.index,
            parent_from_prototype=keys[0][None],
            later_parent_from_prototype=[key[None] for key in keys[1:]],
        )
    )
    return moving
