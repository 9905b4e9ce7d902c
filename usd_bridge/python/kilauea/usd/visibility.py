"""Which kinds of rays meet a prim, as renderers' own primvars say; USD has no word for it.

Read are Arnold's `arnold:visibility`, Karma's `karma:object:rendervisibility` and RenderMan's
`ri:attributes:visibility`. They are primvars, so that what a prim says holds for all below it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

from pxr import Usd, UsdGeom

from kilauea.payload import ALL_RAYS, CAMERA_RAYS, INDIRECT_RAYS, SHADOW_RAYS

_PREFIXES = ("arnold:visibility", "karma:object:rendervisibility", "ri:attributes:visibility:")
_SINGLE = {
    "arnold:visibility:camera": CAMERA_RAYS,
    "arnold:visibility:shadow": SHADOW_RAYS,
    "ri:attributes:visibility:camera": CAMERA_RAYS,
    "ri:attributes:visibility:transmission": SHADOW_RAYS,
    "ri:attributes:visibility:indirect": INDIRECT_RAYS,
}
_ARNOLD_BITS = {"diffuse_transmit": 4, "specular_transmit": 8}
_ARNOLD_BITS |= {"diffuse_reflect": 32, "specular_reflect": 64}
_KARMA_SCATTERED = frozenset(("diffuse", "reflect", "refract"))
_KARMA_WORDS = {"primary": CAMERA_RAYS, "shadow": SHADOW_RAYS}


def rays(primvars: Iterable[UsdGeom.Primvar], time: Usd.TimeCode) -> tuple[int, bool]:
    """Return the rays that meet a prim with these primvars, and whether that is not all they say.

    There is one switch for all scattered rays: it is off where every kind of them is.
    """
    values = {p.GetPrimvarName(): p.Get(time) for p in primvars if _is_read(p.GetPrimvarName())}
    if not values:
        return ALL_RAYS, False
    mask = ALL_RAYS
    for name, bit in _SINGLE.items():
        if name in values and not values[name]:
            mask &= ~bit
    scattered: list[set[bool]] = [_arnold(values)]
    if "arnold:visibility" in values:
        bits = int(values["arnold:visibility"])
        mask &= ~0 if bits & 1 else ~CAMERA_RAYS
        mask &= ~0 if bits & 2 else ~SHADOW_RAYS
    if "karma:object:rendervisibility" in values:
        seen = _karma(str(values["karma:object:rendervisibility"]))
        for word, bit in _KARMA_WORDS.items():
            mask &= ~0 if word in seen else ~bit
        scattered.append({word in seen for word in _KARMA_SCATTERED})
    for found in scattered:
        if found == {False}:
            mask &= ~INDIRECT_RAYS
    return mask, any(len(found) == 2 for found in scattered)


def _is_read(name: str) -> bool:
    return name.startswith(_PREFIXES)


def _arnold(values: dict[str, Any]) -> set[bool]:
    bits = int(values.get("arnold:visibility", 255))
    return {
        bool(values.get(f"arnold:visibility:{name}", bits & bit))
        for name, bit in _ARNOLD_BITS.items()
    }


def _karma(mask: str) -> set[str]:
    """Return the words that a trace mask includes; `-` and `^` exclude, `*` is everything."""
    everything = {*_KARMA_WORDS, *_KARMA_SCATTERED}
    terms = re.findall(r"[-^]?[\w*]+", mask)
    seen = set(everything) if terms and terms[0][0] in "-^" else set()
    for term in terms:
        words = everything if "*" in term else {term.lstrip("-^")}
        seen = seen - words if term[0] in "-^" else seen | words
    return seen
