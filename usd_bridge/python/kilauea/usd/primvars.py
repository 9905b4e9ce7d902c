"""Primvars and normals as the engine reads them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from kilauea import payload
from kilauea.usd.arrays import floats, ints, read_points
from kilauea.usd.context import Context, Inherited, Space

MAX_WIDTH = 4


def convert(primvar: UsdGeom.Primvar, time: Usd.TimeCode) -> payload.Primvar | None:
    """Read a primvar; None where it has no value or is not up to four numbers per element."""
    value = primvar.Get(time)
    if value is None:
        return None
    array = np.asarray(value)
    if array.dtype.kind not in "fiub":
        return None
    components = np.prod(array.shape[1:]) if primvar.GetTypeName().isArray else array.size
    width = int(components) * primvar.GetElementSize()
    if not 1 <= width <= MAX_WIDTH:
        return None
    return payload.Primvar(
        name=primvar.GetPrimvarName(),
        width=width,
        interpolation=str(primvar.GetInterpolation()),
        values=floats(array).reshape(-1),
        indices=ints(primvar.GetIndices(time)) if primvar.IsIndexed() else None,
    )


def find(prim: Usd.Prim, name: str, inherited: Inherited) -> UsdGeom.Primvar | None:
    """Find a primvar on the prim or, where constant, on an ancestor in the same space."""
    found = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name, inherited.primvars)
    return found if found and found.HasValue() else None


def has(prim: Usd.Prim, name: str, inherited: Inherited, space: Space) -> bool:
    """Return whether a value reaches the prim, from outside of an instance included."""
    return name in space.outside_primvars or find(prim, name, inherited) is not None


def gather(
    cx: Context, prim: Usd.Prim, names: Iterable[str], inherited: Inherited, space: Space
) -> list[payload.Primvar]:
    """Read the named primvars of a prim, noting in `space` what may come from outside."""
    result = []
    for name in sorted(names):
        primvar = find(prim, name, inherited)
        if primvar is None:
            space.open_primvars.add(name)
            continue
        space.closed_primvars.add(name)
        converted = convert(primvar, cx.time)
        if converted is None:
            cx.notes.add(f"primvars:{name} of type {primvar.GetTypeName()} cannot be read", prim)
        else:
            result.append(converted)
    return result


def normals(prim: Usd.Prim, mesh: UsdGeom.Mesh, time: Usd.TimeCode) -> payload.Primvar | None:
    """Read the normals of a polygon mesh: `primvars:normals` stands before `normals`."""
    primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("normals")
    if primvar and primvar.HasValue():
        return convert(primvar, time)
    attribute = mesh.GetNormalsAttr()
    if not attribute.HasValue():
        return None
    return payload.Primvar(
        name="normals",
        width=3,
        interpolation=str(mesh.GetNormalsInterpolation()),
        values=read_points(attribute, time).reshape(-1),
    )


def one_per_instance(primvar: payload.Primvar, selected: Any) -> payload.Primvar:
    """Reduce a primvar of a point instancer to the selected instances."""
    values = primvar.values.reshape(-1, primvar.width)
    if primvar.indices is not None:
        values = values[primvar.indices]
    return payload.Primvar(
        name=primvar.name,
        width=primvar.width,
        interpolation="vertex",
        values=np.ascontiguousarray(values[selected]).reshape(-1),
    )
