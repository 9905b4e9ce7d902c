"""BasisCurves."""

from __future__ import annotations

from pxr import Usd, UsdGeom

from kilauea import payload
from kilauea.usd import geometry, primvars
from kilauea.usd.arrays import matrix, read_ints
from kilauea.usd.context import Context, Inherited, Space
from kilauea.usd.points_based import point_keys, widths


def add_curves(cx: Context, prim: Usd.Prim, inherited: Inherited, space: Space) -> None:
    """Append curves with their material and the primvars that it reads."""
    curves = UsdGeom.BasisCurves(prim)
    counts = curves.GetCurveVertexCountsAttr()
    _, keys = point_keys(cx, curves, (counts,))
    if not len(keys[0]):
        cx.notes.add("BasisCurves without points", prim)
        return
    material = geometry.bound_material(cx, prim, prim, inherited, space)
    cx.frame.curves.append(
        payload.Curves(
            path=str(prim.GetPath()),
            prototype=space.index,
            prototype_from_curves=matrix(inherited.space_from_prim),
            points=keys[0],
            later_points=keys[1:],
            curve_vertex_counts=read_ints(counts, cx.time),
            curve_type=str(curves.GetTypeAttr().Get(cx.time)),
            basis=str(curves.GetBasisAttr().Get(cx.time)),
            wrap=str(curves.GetWrapAttr().Get(cx.time)),
            widths=widths(curves, cx.time),
            normals=primvars.normals(prim, curves, cx.time),
            primvars=primvars.gather(cx, prim, cx.materials.primvars(material), inherited, space),
            material=material,
            visibility=inherited.visibility,
        )
    )
