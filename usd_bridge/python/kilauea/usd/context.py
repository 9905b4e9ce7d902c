"""What the flattening of one frame carries along."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from kilauea import payload
from kilauea.usd.motion import MotionSampler
from kilauea.usd.options import FlattenOptions

if TYPE_CHECKING:
    from kilauea.usd.bindings import Bindings
    from kilauea.usd.lights import LightTable
    from kilauea.usd.materials import MaterialTable
    from kilauea.usd.skel import Skinning


@dataclass(slots=True)
class Inherited:
    """What a prim hands down to its children."""

    space_from_prim: Gf.Matrix4d
    """Row vectors, to the space of the prototype being filled."""
    purpose: str | None = None
    """Nearest authored purpose."""
    primvars: list[UsdGeom.Primvar] = field(default_factory=list)
    """Constant primvars of ancestors in the same space."""
    visibility: int = payload.ALL_RAYS
    """Rays that meet it, as far as ancestors in the same space say."""


@dataclass(slots=True)
class Space:
    """A payload prototype being filled."""

    index: int
    root: Usd.Prim
    """Its transform to the world is that of the space."""
    outside_primvars: frozenset[str] = frozenset()
    """Display primvars that instances of it bring along."""
    fallback_material: UsdShade.Material | None = None
    """Of the point instancer, for prototypes that bind nothing."""
    open_primvars: set[str] = field(default_factory=set)
    """Read by materials and absent inside: an instance may bring them."""
    closed_primvars: set[str] = field(default_factory=set)
    """Read by materials and found inside."""
    lights: list[tuple[Usd.Prim, Gf.Matrix4d, int]] = field(default_factory=list)
    """Lights with their transform to the space and the rays that meet them."""


class Notes:
    """Remarks, each with a count and the first prim that it was made of."""

    def __init__(self) -> None:
        self._counts: dict[str, int] = {}
        self._first: dict[str, str] = {}

    def add(self, remark: str, prim: Usd.Prim) -> None:
        """Count a remark."""
        self._counts[remark] = self._counts.get(remark, 0) + 1
        self._first.setdefault(remark, str(prim.GetPath()))

    def lines(self) -> list[str]:
        """Return one line per remark."""
        return [
            f"{remark} ({self._first[remark]})"
            if count == 1
            else f"{remark} ({count} prims, first {self._first[remark]})"
            for remark, count in self._counts.items()
        ]


@dataclass(slots=True)
class Context:
    """The frame being filled and what it takes to do so."""

    stage: Usd.Stage
    frame: payload.Frame
    time: Usd.TimeCode
    options: FlattenOptions
    purposes: frozenset[str]
    """Purposes that are rendered, `default` included."""
    bindings: Bindings
    materials: MaterialTable
    lights: LightTable
    motion: MotionSampler
    notes: Notes = field(default_factory=Notes)
    skins: dict[Sdf.Path, Skinning] = field(default_factory=dict)
    """By path of the skinned prim."""
    spaces: dict[Any, Space] = field(default_factory=dict)
    """Prototypes by what distinguishes them."""
    open_prototypes: set[Any] = field(default_factory=set)
    """Keys of the point instancers' prototypes that are being filled."""
    walk: Callable[[list[Usd.Prim], Inherited, Space], None] = field(init=False)
    """Visits prims and everything below them; set while the stage is traversed."""
