"""Native instances and point instancers, as payload prototypes placed by `Instances`."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom, UsdShade, UsdSkel

from kilauea import payload
from kilauea.usd import primvars
from kilauea.usd.arrays import indices_within, read_ints
from kilauea.usd.context import Context, Inherited, Space

DISPLAY_PRIMVARS = ("displayColor", "displayOpacity")


def add_native(cx: Context, prim: Usd.Prim, inherited: Inherited, space: Space) -> None:
    """Place the prototype of a native instance, filling it at its first use.

    Instances share a payload prototype while they share the USD prototype and all that its
    descendants inherit. Constant primvars from outside go with the instance, unless parts of the
    prototype have their own value: then that value makes another prototype.
    """
    outside = _outside(prim, inherited, space)
    key: tuple[Hashable, ...] = (
        prim.GetPrototype().GetPath(),
        inherited.purpose,
        cx.bindings.key_from_outside(prim),
        space.fallback_material and space.fallback_material.GetPath(),
        outside,
        _skel_key(cx, prim),
    )

    def fill(key: Hashable, constants: list[UsdGeom.Primvar]) -> Space:
        if key in cx.spaces:
            return cx.spaces[key]
        target = _new_space(cx, prim, prim, outside)
        target.fallback_material = space.fallback_material
        cx.spaces[key] = target
        start = Inherited(Gf.Matrix4d(1), inherited.purpose, constants)
        cx.walk(prim.GetFilteredChildren(Usd.TraverseInstanceProxies()), start, target)
        return target

    target = fill(key, [])
    mixed = [
        p
        for p in inherited.primvars
        if p.GetPrimvarName() in target.open_primvars & target.closed_primvars
    ]
    if mixed:
        values = tuple((p.GetPrimvarName(), str(p.Get(cx.time))) for p in mixed)
        target = fill((*key, values), mixed)

    carried = primvars.gather(cx, prim, target.open_primvars, inherited, space)
    cx.frame.instances.append(
        payload.Instances(
            path=str(prim.GetPath()),
            parent=space.index,
            prototype=target.index,
            parent_from_prototype=np.array(inherited.space_from_prim, np.float64)[None],
            primvars=[p for p in carried if p.interpolation == "constant"],
            visibility=inherited.visibility,
        )
    )


def add_point_instancer(cx: Context, prim: Usd.Prim, inherited: Inherited, space: Space) -> None:
    """Place each prototype of a point instancer at its visible, active instances."""
    instancer = UsdGeom.PointInstancer(prim)
    targets = instancer.GetPrototypesRel().GetForwardedTargets()
    indices = read_ints(instancer.GetProtoIndicesAttr(), cx.time)
    if not len(indices):
        cx.notes.add("PointInstancer without instances", prim)
        return
    if indices.min() < 0 or indices.max() >= len(targets):
        cx.notes.add("PointInstancer skipped: protoIndices point outside prototypes", prim)
        return
    local = _instance_keys(cx, instancer, len(indices))
    if not local:
        cx.notes.add("PointInstancer skipped: positions do not match protoIndices", prim)
        return
    keys = [key @ np.array(inherited.space_from_prim) for key in local]
    mask = instancer.ComputeMaskAtTime(cx.time)
    visible = np.array(mask, bool) if len(mask) else np.ones(len(indices), bool)

    varying = _instance_primvars(cx, prim, len(indices))
    outside = _outside(prim, inherited, space) | {n for n in DISPLAY_PRIMVARS if n in varying}
    material = cx.bindings.resolve(prim) or space.fallback_material
    for idx, path in enumerate(targets):
        selected = np.flatnonzero(visible & (indices == idx))
        if not len(selected):
            continue
        root = cx.stage.GetPrimAtPath(path)
        if not root:
            cx.notes.add(f"PointInstancer prototype {path} does not exist", prim)
            continue
        target = _point_prototype(cx, root, inherited.purpose, outside, material)
        if target is None:
            cx.notes.add(f"PointInstancer prototype {path} contains its instancer", prim)
            continue
        own = varying.keys() & (target.open_primvars | target.closed_primvars)
        carried = primvars.gather(cx, prim, target.open_primvars - own, inherited, space)
        cx.frame.instances.append(
            payload.Instances(
                path=str(prim.GetPath()),
                parent=space.index,
                prototype=target.index,
                parent_from_prototype=np.ascontiguousarray(keys[0][selected]),
                later_parent_from_prototype=[
                    np.ascontiguousarray(key[selected]) for key in keys[1:]
                ],
                visibility=inherited.visibility,
                primvars=[p for p in carried if p.interpolation == "constant"]
                + [primvars.one_per_instance(varying[name], selected) for name in sorted(own)],
            )
        )


def _instance_keys(
    cx: Context, instancer: UsdGeom.PointInstancer, n_instances: int
) -> list[NDArray[np.float64]]:
    """Return (n, 4, 4) transforms at each motion key; nothing where positions do not match."""
    prim = instancer.GetPrim()

    def transforms(time: float) -> NDArray[np.float64]:
        found = instancer.ComputeInstanceTransformsAtTime(
            Usd.TimeCode(time),
            cx.time,
            UsdGeom.PointInstancer.ExcludeProtoXform,
            UsdGeom.PointInstancer.IgnoreMask,
        )
        return np.asarray(found, np.float64).reshape(-1, 4, 4)

    speeds = (instancer.GetVelocitiesAttr(), instancer.GetAngularVelocitiesAttr())
    places = (
        *(instancer.GetPositionsAttr(), instancer.GetScalesAttr()),
        *(instancer.GetOrientationsAttr(), instancer.GetOrientationsfAttr()),
    )
    if any(speed.HasAuthoredValue() for speed in speeds):
        times = cx.motion.evenly_spaced(prim, 1)
    else:
        times = cx.motion.times(prim, places)
    if len(transforms(cx.motion.frame)) != n_instances:
        return []
    if any(len(transforms(time)) != n_instances for time in times):
        cx.notes.add("instances change while the shutter is open: not blurred", prim)
        times = [cx.motion.frame]
    return cx.motion.matrices(times, transforms)


class LightPlacement:
    """Hands every light to the light table, once per placement of the prototype that holds it.

    Lights stand still while the shutter is open, where they are at the frame's time.
    """

    def __init__(self, cx: Context) -> None:
        self._cx = cx
        self._lights = cx.lights
        self._spaces = {space.index: space for space in cx.spaces.values()}
        self._placed: dict[int, list[payload.Instances]] = {}
        for instances in cx.frame.instances:
            self._placed.setdefault(instances.parent, []).append(instances)
        self._lit: dict[int, bool] = {}

    def place(self, index: int, world_from_space: Gf.Matrix4d) -> None:
        """Place the lights of a prototype and of those inside it."""
        for prim, space_from_light, visibility in self._spaces[index].lights:
            is_seen = bool(visibility & payload.CAMERA_RAYS)
            self._lights.add(prim, space_from_light * world_from_space, is_seen)
        for instances in self._placed.get(index, ()):
            if self._holds_lights(instances.prototype):
                for m in self._at_frame(instances):
                    self.place(instances.prototype, Gf.Matrix4d(m.tolist()) * world_from_space)

    def _at_frame(self, instances: payload.Instances) -> NDArray[np.float64]:
        keys = [instances.parent_from_prototype, *instances.later_parent_from_prototype]
        if len(keys) == 1:
            return keys[0]
        root = self._spaces[instances.prototype].root
        self._cx.notes.add("lights do not move while the shutter is open: not blurred", root)
        position = self._cx.motion.frame_position * (len(keys) - 1)
        before = min(int(position), len(keys) - 2)
        share = position - before
        return (1 - share) * keys[before] + share * keys[before + 1]

    def _holds_lights(self, index: int) -> bool:
        if index not in self._lit:
            self._lit[index] = bool(self._spaces[index].lights) or any(
                self._holds_lights(i.prototype) for i in self._placed.get(index, ())
            )
        return self._lit[index]


def _new_space(
    cx: Context, root: Usd.Prim, named_after: Usd.Prim, outside: frozenset[str]
) -> Space:
    cx.frame.prototypes.append(str(named_after.GetPath()))
    return Space(len(cx.frame.prototypes) - 1, root, outside)


def _point_prototype(
    cx: Context,
    root: Usd.Prim,
    purpose: str | None,
    outside: frozenset[str],
    material: UsdShade.Material | None,
) -> Space | None:
    """Return the prototype of a point instancer in the space of the root's parent."""
    fallback = material and material.GetPath()
    key = ("points", root.GetPath(), purpose, outside, fallback)
    if key in cx.open_prototypes:
        return None
    if key not in cx.spaces:
        parent = root.GetParent()
        target = _new_space(cx, parent, root, outside)
        target.fallback_material = material
        cx.spaces[key] = target
        cx.open_prototypes.add(key)
        constants = UsdGeom.PrimvarsAPI(parent).FindInheritablePrimvars() if parent else []
        cx.walk([root], Inherited(Gf.Matrix4d(1), purpose, constants), target)
        cx.open_prototypes.remove(key)
    return cx.spaces[key]


def _outside(prim: Usd.Prim, inherited: Inherited, space: Space) -> frozenset[str]:
    return frozenset(n for n in DISPLAY_PRIMVARS if primvars.has(prim, n, inherited, space))


def _instance_primvars(cx: Context, prim: Usd.Prim, n_instances: int) -> dict[str, Any]:
    """Read the primvars of an instancer that have a value per instance."""
    result = {}
    for primvar in _varying(UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithValues()):
        converted = primvars.convert(primvar, cx.time)
        if converted is None:
            continue
        n_values = converted.values.size // converted.width
        n_elements = n_values if converted.indices is None else len(converted.indices)
        if n_elements != n_instances:
            cx.notes.add(f"primvars:{converted.name} does not match the instances: not read", prim)
            continue
        if converted.indices is not None and not indices_within(converted.indices, n_values):
            cx.notes.add(f"primvars:{converted.name} has indices out of range: not read", prim)
            continue
        result[converted.name] = converted
    return result


def _varying(candidates: Iterable[UsdGeom.Primvar]) -> Iterable[UsdGeom.Primvar]:
    return (p for p in candidates if p.GetInterpolation() != UsdGeom.Tokens.constant)


def _skel_key(cx: Context, instance: Usd.Prim) -> Hashable:
    """Identify the pose that reaches an instance from outside of it."""
    path = instance.GetPath()
    if any(skinned.HasPrefix(path) for skinned in cx.skins):
        return path
    prim = instance
    while prim and not prim.IsPseudoRoot():
        if prim.HasAPI(UsdSkel.BindingAPI):
            api = UsdSkel.BindingAPI(prim)
            poses = (api.GetAnimationSourceRel(), api.GetSkeletonRel())
            return tuple(tuple(p.GetForwardedTargets()) if p else () for p in poses)
        prim = prim.GetParent()
    return ()
