"""Points, drawn as spheres."""

from __future__ import annotations

from pxr import Usd, UsdGeom

from kilauea import payload
from kilauea.usd import geometry, primvars
from kilauea.usd.arrays import matrix
from kilauea.usd.context import Context, Inherited, Space
from kilauea.usd.points_based import point_keys, widths


def add_points(cx: Context, prim: Usd.Prim, inherited: Inherited, space: Space) -> None:
    """Append points with their material and the primvars that it reads."""
    points = UsdGeom.Points(prim)
    _, keys = point_keys(cx, points, (points.GetIdsAttr(),))
    if not len(keys[0]):
        cx.notes.add("Points without points", prim)
        return
    if primvars.normals(prim, points, cx.time):
        cx.notes.add("Points with normals are drawn as spheres, not as discs", prim)
    material = geometry.bound_material(cx, prim, prim, inherited, space)
    cx.frame.points.append(
        payload.Points(
            path=str(prim.GetPath()),
            prototype=space.index,
            prototype_from_points=matrix(inherited.space_from_prim),
            points=keys[0],
            later_points=keys[1:],
            widths=widths(points, cx.time),
            primvars=primvars.gather(cx, prim, cx.materials.primvars(material), inherited, space),
            material=material,
            visibility=inherited.visibility,
        )
    )
