"""Which material each prim is bound to."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

from pxr import Sdf, Usd, UsdGeom, UsdShade

_NAMESPACE = "material"
"""Holds `material:binding` itself, and those with a purpose or collection below it."""


class Bindings:
    """Material binding as UsdShadeMaterialBindingAPI resolves it."""

    def __init__(self, purposes: Sequence[str], enabled: bool = True) -> None:
        self._purpose = next((p for p in purposes if p), "")
        self._enabled = enabled
        self._canonical: dict[Sdf.Path, UsdShade.Material] = {}
        self._keys: dict[Sdf.Path, tuple[Hashable, ...]] = {}
        self._collections: dict[Sdf.Path, bool] = {}
        self._dangling: dict[Sdf.Path, str | None] = {}

    def dangling(self) -> list[str]:
        """Return a line for each binding found so far whose material does not exist."""
        return [line for line in self._dangling.values() if line]

    def resolve(self, prim: Usd.Prim) -> UsdShade.Material | None:
        """Return the material of a prim or GeomSubset; the same object wherever shared."""
        if not self._enabled:
            return None
        bound, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(self._purpose)
        if not bound:
            self._find_dangling(prim)
            return None
        return self._canonical.setdefault(_shared_path(bound.GetPrim()), bound)

    def key_from_outside(self, instance: Usd.Prim) -> Hashable:
        """Identify what an instance's descendants inherit from it and its ancestors.

        Collections choose by path, so where one is bound the key is every material below.
        """
        if not self._enabled:
            return ()
        if not self._has_collections(instance):
            return self._inherited(instance)
        proxies = Usd.PrimRange(instance, Usd.TraverseInstanceProxies())
        bindables = [p for p in proxies if p.IsA(UsdGeom.Gprim) or p.IsA(UsdGeom.Subset)]
        materials = (self.resolve(p) for p in bindables)
        return tuple(m.GetPath() if m else None for m in materials)

    def _inherited(self, prim: Usd.Prim) -> tuple[Hashable, ...]:
        path = prim.GetPath()
        if path.isEmpty or prim.IsPseudoRoot():
            return ()
        if path not in self._keys:
            if prim.GetAuthoredPropertiesInNamespace(_NAMESPACE):
                self._keys[path] = self._key(prim)
            else:
                self._keys[path] = self._inherited(prim.GetParent())
        return self._keys[path]

    def _key(self, prim: Usd.Prim) -> tuple[Hashable, ...]:
        key: list[Hashable] = []
        for purpose in {self._purpose, ""}:
            bound, relationship = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(purpose)
            if bound:
                strength = UsdShade.MaterialBindingAPI.GetMaterialBindingStrength(relationship)
                key += [purpose, _shared_path(bound.GetPrim()), strength]
        return tuple(key)

    def _find_dangling(self, prim: Usd.Prim) -> None:
        """Look at the bindings of an unbound prim and its ancestors, each prim once."""
        while prim and not prim.IsPseudoRoot() and prim.GetPath() not in self._dangling:
            path = prim.GetPath()
            self._dangling[path] = None
            for relationship in prim.GetAuthoredPropertiesInNamespace(_NAMESPACE):
                direct = UsdShade.MaterialBindingAPI.DirectBinding(relationship)
                target = direct.GetMaterialPath()
                if not target.isEmpty and not direct.GetMaterial():
                    name = relationship.GetName()
                    self._dangling[path] = f"{path}: {name}: there is no material {target}"
            prim = prim.GetParent()

    def _has_collections(self, prim: Usd.Prim) -> bool:
        if prim.IsPseudoRoot():
            return False
        path = prim.GetPath()
        if path not in self._collections:
            own = bool(prim.GetAuthoredPropertiesInNamespace("material:binding:collection"))
            self._collections[path] = own or self._has_collections(prim.GetParent())
        return self._collections[path]


def _shared_path(prim: Usd.Prim) -> Sdf.Path:
    return prim.GetPrimInPrototype().GetPath() if prim.IsInstanceProxy() else prim.GetPath()
