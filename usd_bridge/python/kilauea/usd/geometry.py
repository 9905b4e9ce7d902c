"""Meshes and implicit shapes."""

from __future__ import annotations

from pxr import Usd, UsdGeom, UsdShade

from kilauea import payload
from kilauea.usd import primvars
from kilauea.usd.arrays import matrix, read_floats, read_ints, read_points
from kilauea.usd.context import Context, Inherited, Space
from kilauea.usd.points_based import point_keys

IMPLICIT_TYPES = (
    *("Sphere", "Cube", "Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1", "Plane"),
)


def add_mesh(cx: Context, prim: Usd.Prim, inherited: Inherited, space: Space) -> None:
    """Append a mesh with its materials and the primvars that they read."""
    mesh = UsdGeom.Mesh(prim)
    face_vertex_counts = read_ints(mesh.GetFaceVertexCountsAttr(), cx.time)
    if not len(face_vertex_counts) and not len(read_points(mesh.GetPointsAttr(), cx.time)):
        cx.notes.add("Mesh without points", prim)
        return
    face_vertex_indices = read_ints(mesh.GetFaceVertexIndicesAttr(), cx.time)
    subdivision = _subdivision(mesh, cx.time)
    skinning = cx.skins.get(prim.GetPath())
    if skinning:
        space_from_mesh, poses = skinning.poses(cx, mesh, face_vertex_indices, space)
    else:
        space_from_mesh, poses = inherited.space_from_prim, _poses(cx, mesh)
    if subdivision:
        # A limit surface has normals of its own.
        for pose in poses:
            pose.normals = None

    material = bound_material(cx, prim, prim, inherited, space)
    subsets = _subsets(cx, prim, material, inherited, space)
    read = cx.materials.primvars(material).union(
        *(cx.materials.primvars(s.material) for s in subsets)
    )
    holes = read_ints(mesh.GetHoleIndicesAttr(), cx.time)
    cx.frame.meshes.append(
        payload.Mesh(
            path=str(prim.GetPath()),
            prototype=space.index,
            prototype_from_mesh=matrix(space_from_mesh),
            points=poses[0].points,
            face_vertex_counts=face_vertex_counts,
            face_vertex_indices=face_vertex_indices,
            material=material,
            hole_indices=holes if len(holes) else None,
            left_handed=mesh.GetOrientationAttr().Get(cx.time) == UsdGeom.Tokens.leftHanded,
            double_sided=bool(mesh.GetDoubleSidedAttr().Get(cx.time)),
            normals=poses[0].normals,
            primvars=primvars.gather(cx, prim, read, inherited, space),
            subsets=subsets,
            subdivision=subdivision,
            later_keys=poses[1:],
            visibility=inherited.visibility,
        )
    )


def add_implicit(cx: Context, prim: Usd.Prim, inherited: Inherited, space: Space) -> None:
    """Append a sphere, cube, cylinder, cone, capsule or plane."""
    shape = UsdGeom.Gprim(prim)
    axis = prim.GetAttribute("axis")
    kind = str(prim.GetTypeName()).removesuffix("_1")
    material = bound_material(cx, prim, prim, inherited, space)
    read = cx.materials.primvars(material)
    cx.frame.implicits.append(
        payload.Implicit(
            path=str(prim.GetPath()),
            prototype=space.index,
            prototype_from_mesh=matrix(inherited.space_from_prim),
            kind=kind,
            axis=str(axis.Get(cx.time)) if axis else "Z",
            dimensions=_dimensions(prim, kind, cx.time),
            material=material,
            left_handed=shape.GetOrientationAttr().Get(cx.time) == UsdGeom.Tokens.leftHanded,
            double_sided=bool(shape.GetDoubleSidedAttr().Get(cx.time)),
            primvars=_constant_only(cx, prim, read, inherited, space),
            visibility=inherited.visibility,
        )
    )


def _poses(cx: Context, mesh: UsdGeom.Mesh) -> list[payload.MeshKey]:
    """Read points and normals at their motion keys."""
    topology = (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr())
    times, keys = point_keys(cx, mesh, topology)
    return [
        payload.MeshKey(points, primvars.normals(mesh.GetPrim(), mesh, Usd.TimeCode(time)))
        for time, points in zip(times, keys, strict=True)
    ]


def _subdivision(mesh: UsdGeom.Mesh, time: Usd.TimeCode) -> payload.Subdivision | None:
    scheme = str(mesh.GetSubdivisionSchemeAttr().Get(time))
    if scheme == UsdGeom.Tokens.none:
        return None
    return payload.Subdivision(
        scheme=scheme,
        interpolate_boundary=str(mesh.GetInterpolateBoundaryAttr().Get(time)),
        face_varying_linear_interpolation=str(
            mesh.GetFaceVaryingLinearInterpolationAttr().Get(time)
        ),
        triangle_subdivision_rule=str(mesh.GetTriangleSubdivisionRuleAttr().Get(time)),
        crease_indices=read_ints(mesh.GetCreaseIndicesAttr(), time),
        crease_lengths=read_ints(mesh.GetCreaseLengthsAttr(), time),
        crease_sharpnesses=read_floats(mesh.GetCreaseSharpnessesAttr(), time),
        corner_indices=read_ints(mesh.GetCornerIndicesAttr(), time),
        corner_sharpnesses=read_floats(mesh.GetCornerSharpnessesAttr(), time),
    )


def bound_material(
    cx: Context, bound: Usd.Prim, shape: Usd.Prim, inherited: Inherited, space: Space
) -> int:
    """Return the material that is bound, or one for `shape`'s display primvars."""
    material = cx.bindings.resolve(bound) or space.fallback_material
    return _material_index(cx, material, shape, inherited, space)


def _material_index(
    cx: Context,
    material: UsdShade.Material | None,
    shape: Usd.Prim,
    inherited: Inherited,
    space: Space,
) -> int:
    if material:
        return cx.materials.index(material, False, False)
    return cx.materials.index(
        None,
        primvars.has(shape, "displayColor", inherited, space),
        primvars.has(shape, "displayOpacity", inherited, space),
    )


def _subsets(
    cx: Context, prim: Usd.Prim, mesh_material: int, inherited: Inherited, space: Space
) -> list[payload.Subset]:
    result = []
    for child in prim.GetFilteredChildren(Usd.TraverseInstanceProxies()):
        if child.GetTypeName() != "GeomSubset":
            continue
        subset = UsdGeom.Subset(child)
        if subset.GetFamilyNameAttr().Get() != UsdShade.Tokens.materialBind:
            continue
        element_type = subset.GetElementTypeAttr().Get()
        if element_type != UsdGeom.Tokens.face:
            cx.notes.add(f"GeomSubset of {element_type} elements is not rendered", child)
            continue
        material = bound_material(cx, child, prim, inherited, space)
        if material != mesh_material:
            faces = read_ints(subset.GetIndicesAttr(), cx.time)
            result.append(payload.Subset(faces=faces, material=material))
    return result


def _dimensions(prim: Usd.Prim, kind: str, time: Usd.TimeCode) -> tuple[float, float, float]:
    def get(name: str) -> float:
        return float(prim.GetAttribute(name).Get(time))

    match kind:
        case "Sphere":
            return get("radius"), 0.0, 0.0
        case "Cube":
            return get("size"), 0.0, 0.0
        case "Cone":
            return get("radius"), 0.0, get("height")
        case "Plane":
            return get("width"), get("length"), 0.0
        case _ if prim.HasAttribute("radiusBottom"):
            return get("radiusBottom"), get("radiusTop"), get("height")
        case _:
            return get("radius"), get("radius"), get("height")


def _constant_only(
    cx: Context, prim: Usd.Prim, names: frozenset[str], inherited: Inherited, space: Space
) -> list[payload.Primvar]:
    result = []
    for primvar in primvars.gather(cx, prim, names, inherited, space):
        if primvar.interpolation != "constant" and primvar.values.size != primvar.width:
            cx.notes.add(f"primvars:{primvar.name} varies over an implicit shape: not read", prim)
            continue
        primvar.interpolation = "constant"
        result.append(primvar)
    return result
