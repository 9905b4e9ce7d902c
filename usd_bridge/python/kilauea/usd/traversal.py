"""One walk over the stage that hands every prim to whoever translates its kind."""

from __future__ import annotations

from pxr import Gf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade, UsdSkel, UsdVol

from kilauea.usd import curves, geometry, instancing, moving_space, points, skel, visibility
from kilauea.usd.context import Context, Inherited, Space

_NOT_RENDERED = (UsdGeom.Gprim, UsdVol.Volume, UsdLux.LightFilter)
_NO_GEOMETRY_BELOW = (
    *(UsdShade.Material, UsdShade.NodeGraph, UsdShade.Shader),
    *(UsdSkel.Skeleton, UsdSkel.Animation, UsdSkel.BlendShape),
    *(UsdRender.SettingsBase, UsdRender.Var, UsdRender.Pass, UsdGeom.Subset),
)


class Traversal:
    """Visits prims in stage order; what a subtree inherits travels along."""

    def __init__(self, cx: Context) -> None:
        self._cx = cx
        self._kinds: dict[str, str] = {}
        self._predicate = Usd.TraverseInstanceProxies()

    def run(self, roots: list[Usd.Prim], inherited: Inherited, space: Space) -> None:
        """Visit the whole stage."""
        self._cx.walk = self.walk
        try:
            self.walk(roots, inherited, space)
        finally:
            # Nothing may keep the stage alive once the frame is filled.
            del self._cx.walk

    def walk(self, roots: list[Usd.Prim], inherited: Inherited, space: Space) -> None:
        """Visit prims and everything below them."""
        pending = [(prim, inherited, space) for prim in reversed(roots)]
        while pending:
            prim, above, outer = pending.pop()
            below = self._visit(prim, above, outer)
            if below is not None:
                children = reversed(self._children(prim))
                pending.extend((child, *below) for child in children)

    def _visit(
        self, prim: Usd.Prim, above: Inherited, space: Space
    ) -> tuple[Inherited, Space] | None:
        """Translate one prim; return what its children inherit and the space that they are in.

        None leaves the children out.
        """
        cx = self._cx
        kind = self._kind(prim)
        if kind == "prune":
            return None
        if kind == "unknown type":
            cx.notes.add(f"{prim.GetTypeName()} is not a known prim type", prim)
        below = above
        if kind not in ("group", "unknown type"):
            visibility = prim.GetAttribute("visibility")
            if visibility and visibility.Get(cx.time) == UsdGeom.Tokens.invisible:
                return None
            below = self._inherit(prim, above, space)
            space = self._moving_space(prim, above, below, space)
        rendered = (below.purpose or UsdGeom.Tokens.default_) in cx.purposes
        if rendered and prim.HasAPI(UsdLux.LightAPI) and cx.options.scene_lights:
            space.lights.append((prim, below.space_from_prim, below.visibility))
        rendered = rendered and bool(below.visibility)
        match kind:
            case "skel root":
                skel.find_skinned(cx, prim)
            case "mesh" if rendered:
                geometry.add_mesh(cx, prim, below, space)
            case "implicit" if rendered:
                geometry.add_implicit(cx, prim, below, space)
            case "curves" if rendered:
                curves.add_curves(cx, prim, below, space)
            case "points" if rendered:
                points.add_points(cx, prim, below, space)
            case "not rendered" if rendered:
                cx.notes.add(f"{prim.GetTypeName()} is not rendered yet", prim)
            case "point instancer":
                if rendered:
                    instancing.add_point_instancer(cx, prim, below, space)
                return None
        if prim.IsInstance():
            instancing.add_native(cx, prim, below, space)
            return None
        return below, space

    def _inherit(self, prim: Usd.Prim, above: Inherited, space: Space) -> Inherited:
        cx = self._cx
        purpose = prim.GetAttribute("purpose")
        authored = purpose.HasAuthoredValue() if purpose else False
        constants = UsdGeom.PrimvarsAPI(prim).FindIncrementallyInheritablePrimvars(above.primvars)
        rays = above.visibility
        if constants:
            rays, is_partial = visibility.rays(constants, cx.time)
            if is_partial:
                cx.notes.add("visible to some scattered rays only: visible to all of them", prim)
        return Inherited(
            self._transform(prim, above, space),
            str(purpose.Get(cx.time)) if authored else above.purpose,
            constants or above.primvars,
            rays,
        )

    def _moving_space(
        self, prim: Usd.Prim, above: Inherited, below: Inherited, space: Space
    ) -> Space:
        """Return a space of its own for a prim whose transform moves, else the one it is in."""
        if self._cx.motion.shutter is None:
            return space
        keys = moving_space.transform_keys(self._cx, prim, above, space)
        if len(keys) == 1:
            return space
        below.space_from_prim = Gf.Matrix4d(1)
        return moving_space.add(self._cx, prim, keys, space)

    def _transform(self, prim: Usd.Prim, above: Inherited, space: Space) -> Gf.Matrix4d:
        if not prim.IsA(UsdGeom.Xformable):
            return above.space_from_prim
        local, resets = self._cx.motion.xforms().GetLocalTransformation(prim)
        if not resets:
            return local * above.space_from_prim
        return local * moving_space.world_from(self._cx, space).GetInverse()

    def _children(self, prim: Usd.Prim) -> list[Usd.Prim]:
        if prim.IsDefined() and not prim.IsAbstract():
            return prim.GetFilteredChildren(self._predicate)
        # A point instancer's prototype may be an `over` or a `class`.
        return prim.GetFilteredChildren(Usd.PrimIsActive & Usd.PrimIsLoaded)

    def _kind(self, prim: Usd.Prim) -> str:
        type_name = prim.GetTypeName()
        if type_name not in self._kinds:
            self._kinds[type_name] = _classify(prim)
        return self._kinds[type_name]


def _classify(prim: Usd.Prim) -> str:
    type_name = prim.GetTypeName()
    if type_name in geometry.IMPLICIT_TYPES:
        return "implicit"
    for schema, kind in (
        (UsdGeom.Mesh, "mesh"),
        (UsdGeom.PointInstancer, "point instancer"),
        (UsdSkel.Root, "skel root"),
        (UsdGeom.BasisCurves, "curves"),
        (UsdGeom.Points, "points"),
    ):
        if prim.IsA(schema):
            return kind
    if any(prim.IsA(schema) for schema in _NO_GEOMETRY_BELOW):
        return "prune"
    if any(prim.IsA(schema) for schema in _NOT_RENDERED):
        return "not rendered"
    if prim.IsA(UsdGeom.Imageable):
        return "imageable"
    if type_name and not prim.IsA(Usd.Typed):
        return "unknown type"
    return "group"
