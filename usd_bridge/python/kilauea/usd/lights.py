"""UsdLux lights as `kilauea_scene::Light` records."""

from __future__ import annotations

import math
from typing import Any

from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from kilauea import payload
from kilauea.usd.remarks import Remarks
from kilauea.usd.textures import TextureTable

_POINT_RADIUS = 1e-3
"""Stands in for radius 0, in light space."""

_MAX_EXPOSURE = 1000.0
"""Beyond any number that f32 holds."""
_MAX_F32 = 3.4e38

_SHADOW_DEFAULTS = {
    "enable": True,
    "color": Gf.Vec3f(0.0),
    "distance": -1.0,
    "falloff": -1.0,
    "falloffGamma": 1.0,
}
_DOMES = (UsdLux.DomeLight, UsdLux.DomeLight_1)


class LightTable:
    """The frame's lights."""

    def __init__(self, frame: payload.Frame, options: Any, textures: TextureTable) -> None:
        self._frame = frame
        self._time = Usd.TimeCode(options.time)
        self._textures = textures
        self._remarks = Remarks(frame.warnings)
        self._records: list[dict[str, Any]] = []

    def add(
        self, prim: Usd.Prim, world_from_light: Gf.Matrix4d, visible_to_camera: bool = True
    ) -> None:
        """Add a light, or say why it is not rendered; visibility is for the caller to judge."""
        light = _Light(prim, world_from_light, self._time, self._textures, self._remarks)
        record = light.record()
        if record is not None:
            self._records.append(record | {"visible_to_camera": visible_to_camera})

    def finish(self) -> None:
        """List the lights in the frame."""
        self._frame.lights += self._records
        self._records = []


class _Light:
    """One light prim being read."""

    def __init__(
        self,
        prim: Usd.Prim,
        world_from_light: Gf.Matrix4d,
        time: Usd.TimeCode,
        textures: TextureTable,
        remarks: Remarks,
    ) -> None:
        self._prim = prim
        self._world_from_light = world_from_light
        self._time = time
        self._textures = textures
        self._remarks = remarks

    def record(self) -> dict[str, Any] | None:
        """Return the record; None where there is nothing to render."""
        shape = self._shape()
        if shape is None:
            return None
        radiance = self._radiance(shape)
        if radiance is None:
            return None
        self._remark_on_the_rest()
        record = {
            "path": str(self._prim.GetPath()),
            "shape": shape,
            "world_from_light": self._oriented(),
            "radiance": radiance,
            "texture": self._texture(),
            "diffuse": float(self._input("diffuse", 1.0)),
            "specular": float(self._input("specular", 1.0)),
            "shaping": self._shaping(shape),
        }
        if not _is_finite(record):
            self._remark("a number is not finite: not rendered")
            return None
        return record

    def _shape(self) -> dict[str, Any] | None:
        prim = self._prim
        if prim.IsA(UsdLux.RectLight):
            width, height = self._size("width", 1.0), self._size("height", 1.0)
            return {"type": "rect", "width": width, "height": height}
        if prim.IsA(UsdLux.DiskLight):
            return {"type": "disk", "radius": self._size("radius", 0.5)}
        if prim.IsA(UsdLux.SphereLight):
            return {"type": "sphere", "radius": self._size("radius", 0.5)}
        if prim.IsA(UsdLux.CylinderLight):
            radius, length = self._size("radius", 0.5), self._size("length", 1.0)
            return {"type": "cylinder", "radius": radius, "length": length}
        if prim.IsA(UsdLux.DistantLight):
            return {"type": "distant", "angle_degrees": self._size("angle", 0.53)}
        if any(prim.IsA(dome) for dome in _DOMES):
            return {"type": "dome"}
        kind = str(prim.GetTypeName())
        if prim.HasAPI(UsdLux.MeshLightAPI):
            kind += " with MeshLightAPI"
        self._remark(f"{kind} lights are not rendered")
        return None

    def _radiance(self, shape: dict[str, Any]) -> list[float] | None:
        """Return the radiance (UsdLuxLightAPI); None where the light is black or has no extent."""
        strength = float(self._input("intensity", 1.0)) * 2.0 ** min(
            float(self._input("exposure", 0.0)), _MAX_EXPOSURE
        )
        color = Gf.Vec3f(self._input("color", Gf.Vec3f(1.0)))
        radiance = [float(c) * strength for c in color]
        if self._input("enableColorTemperature", False):
            kelvin = float(self._input("colorTemperature", 6500.0))
            blackbody = UsdLux.BlackbodyTemperatureAsRgb(kelvin)
            radiance = [r * max(float(b), 0.0) for r, b in zip(radiance, blackbody, strict=True)]
        if not any(radiance):
            return None
        is_point = self._is_point(shape)
        if not is_point and not self._input("normalize", False):
            return radiance
        size = _normalization(shape, self._world_from_light)
        if size <= 0.0:
            self._remark("the light has no area to normalize by: not rendered")
            return None
        return [r / size for r in radiance]

    def _is_point(self, shape: dict[str, Any]) -> bool:
        """Give a light of radius 0 a small one, whose emission is then normalised."""
        if shape.get("radius") != 0.0:
            return False
        shape["radius"] = _POINT_RADIUS
        if not self._input("normalize", False):
            self._remark("radius 0 emits nothing: its intensity is taken as normalized")
        return True

    def _texture(self) -> int | None:
        attribute = self._attribute("texture:file")
        if not attribute:
            return None
        index = self._textures.index_of_attribute(attribute)
        image_format = str(self._input("texture:format", "automatic"))
        if index is not None and image_format not in ("automatic", "latlong"):
            self._remark(f"texture format {image_format} is not supported: read as latlong")
        if index is None or self._textures.is_missing(index):
            return None
        return index

    def _oriented(self) -> list[float]:
        """Return the transform as column vectors, with the dome's pole where `poleAxis` says.

        `OrientToStageUpAxis` writes an ordinary transform operation, so it needs nothing here.
        """
        world_from_light = self._world_from_light
        if self._prim.IsA(UsdLux.DomeLight_1):
            axis = str(self._prim.GetAttribute("poleAxis").Get(self._time))
            if axis == "scene":
                axis = str(UsdGeom.GetStageUpAxis(self._prim.GetStage()))
            if axis == UsdGeom.Tokens.z:
                # +y to +z, and +z, the centre of the image, to -y.
                z_up = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d.XAxis(), 90.0))
                world_from_light = z_up * world_from_light
        # Row vectors row by row are column vectors column by column.
        return [float(world_from_light[row][column]) for row in range(4) for column in range(4)]

    def _shaping(self, shape: dict[str, Any]) -> dict[str, Any] | None:
        if not self._prim.HasAPI(UsdLux.ShapingAPI):
            return None
        profile = self._input("shaping:ies:file", None)
        if isinstance(profile, Sdf.AssetPath) and profile.path:
            self._remark("IES profiles are not rendered")
        focus_tint = Gf.Vec3f(self._input("shaping:focusTint", Gf.Vec3f(0.0)))
        shaping = {
            "cone_angle_degrees": float(self._input("shaping:cone:angle", 90.0)),
            "cone_softness": float(self._input("shaping:cone:softness", 0.0)),
            "focus": float(self._input("shaping:focus", 0.0)),
            "focus_tint": [float(c) for c in focus_tint],
        }
        if shaping["cone_angle_degrees"] >= 180.0 and shaping["focus"] == 0.0:
            return None
        if shape["type"] in ("dome", "distant"):
            self._remark("shaping of a light at infinity is not rendered")
            return None
        return shaping

    def _remark_on_the_rest(self) -> None:
        prim = self._prim
        light = UsdLux.LightAPI(prim)
        if prim.HasAPI(UsdLux.ShadowAPI):
            for name, default in _SHADOW_DEFAULTS.items():
                if self._input(f"shadow:{name}", default) != default:
                    self._remark(f"inputs:shadow:{name} is not rendered")
        for name, collection in (
            ("light", light.GetLightLinkCollectionAPI()),
            ("shadow", light.GetShadowLinkCollectionAPI()),
        ):
            if not _links_everything(collection):
                self._remark(f"{name} linking is not rendered: it applies to everything")
        if light.GetFiltersRel().GetTargets():
            self._remark("light filters are not rendered")
        if self._names_targets("portals"):
            self._remark("portals are not rendered")
        if self._flag("treatAsPoint") or self._flag("treatAsLine"):
            self._remark("treatAsPoint and treatAsLine are hints: rendered with its extent")

    def _size(self, name: str, default: float) -> float:
        return max(float(self._input(name, default)), 0.0)

    def _input(self, name: str, default: Any) -> Any:
        attribute = self._attribute(name)
        value = attribute.Get(self._time) if attribute else None
        return default if value is None else value

    def _attribute(self, name: str) -> Usd.Attribute:
        """Return an input's attribute; stages older than USD 21.02 have it without `inputs:`."""
        attribute = self._prim.GetAttribute(f"inputs:{name}")
        old = self._prim.GetAttribute(name)
        if not (attribute and attribute.HasAuthoredValue()) and old and old.HasAuthoredValue():
            self._remark(f"{name} has no inputs: prefix, as before USD 21.02; read all the same")
            return old
        return attribute

    def _flag(self, name: str) -> bool:
        attribute = self._prim.GetAttribute(name)
        return bool(attribute and attribute.Get(self._time))

    def _names_targets(self, name: str) -> bool:
        relationship = self._prim.GetRelationship(name)
        return bool(relationship and relationship.GetTargets())

    def _remark(self, text: str) -> None:
        self._remarks.add(str(self._prim.GetPath()), text)


def _normalization(shape: dict[str, Any], world_from_light: Gf.Matrix4d) -> float:
    """Return what `normalize` divides by: world-space area, or for distant lights an angle."""

    def world(x: float, y: float, z: float) -> Gf.Vec3d:
        return world_from_light.TransformDir(Gf.Vec3d(x, y, z))

    match shape["type"]:
        case "rect":
            u, v = world(shape["width"], 0.0, 0.0), world(0.0, shape["height"], 0.0)
            return Gf.Cross(u, v).GetLength()
        case "disk":
            r = shape["radius"]
            return math.pi * Gf.Cross(world(r, 0.0, 0.0), world(0.0, r, 0.0)).GetLength()
        case "sphere":
            r = shape["radius"]
            axes = (world(r, 0.0, 0.0), world(0.0, r, 0.0), world(0.0, 0.0, r))
            return _ellipsoid_area(*(axis.GetLength() for axis in axes))
        case "cylinder":
            r = shape["radius"]
            circumference = _ellipse_circumference(
                world(0.0, r, 0.0).GetLength(), world(0.0, 0.0, r).GetLength()
            )
            return circumference * world(shape["length"], 0.0, 0.0).GetLength()
        case "distant":
            return _illuminance_of_unit_radiance(shape["angle_degrees"])
        case _:
            return 1.0


def _ellipsoid_area(a: float, b: float, c: float) -> float:
    """Thomsen's formula with p = 1.6, as in hdEmbree; within 1.4 %."""
    p = 1.6
    mean = ((a * b) ** p + (a * c) ** p + (b * c) ** p) / 3.0
    return 4.0 * math.pi * mean ** (1.0 / p)


def _ellipse_circumference(a: float, b: float) -> float:
    """Ramanujan's second formula."""
    if a + b == 0.0:
        return 0.0
    h = 3.0 * ((a - b) / (a + b)) ** 2
    return math.pi * (a + b) * (1.0 + h / (10.0 + math.sqrt(4.0 - h)))


def _illuminance_of_unit_radiance(angle_degrees: float) -> float:
    """Lux of a distant light of one nit, so that a normalised one's intensity is in lux."""
    theta = min(max(math.radians(angle_degrees) / 2.0, 0.0), math.pi)
    if theta == 0.0:
        return 1.0
    sin_squared = math.sin(theta) ** 2
    return math.pi * (sin_squared if theta <= math.pi / 2.0 else 2.0 - sin_squared)


def _is_finite(value: Any) -> bool:
    """Return whether every number in a record is one in the engine too."""
    if isinstance(value, dict):
        return all(_is_finite(v) for v in value.values())
    if isinstance(value, list):
        return all(_is_finite(v) for v in value)
    return not isinstance(value, float) or abs(value) <= _MAX_F32


def _links_everything(collection: Usd.CollectionAPI) -> bool:
    if not collection:
        return True
    include_root = collection.GetIncludeRootAttr().Get()
    expression = collection.GetMembershipExpressionAttr().Get()
    return (
        include_root is not False
        and not collection.GetExcludesRel().GetTargets()
        and (expression is None or expression.IsEmpty())
    )
