"""Surfaces that LuxCore models as we do.

`Matte`, smooth `Mirror` and `Glass`, and what comes to the same of UsdPreviewSurface.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from constant_inputs import constant, emission
from unsupported import UnsupportedError

if TYPE_CHECKING:
    from exported import ExportedScene

WHITE = (1.0, 1.0, 1.0)


class Materials:
    """Names materials and collects their properties."""

    def __init__(self, scene: ExportedScene) -> None:
        self.scene = scene
        self.properties: dict[str, Any] = {}
        self._names: dict[tuple[int, tuple[float, ...]], str] = {}

    def name_of(self, chunk: dict[str, Any]) -> str:
        """Return the material of a chunk, which may have its colour from a primvar."""
        idx = chunk["material"]
        record = self.scene.materials[idx]
        colour = self.colour(record, chunk)
        if (idx, colour) not in self._names:
            name = f"material{len(self._names)}"
            self._names[idx, colour] = name
            surface = surface_properties(record, colour)
            self.properties |= {f"scene.materials.{name}.{k}": v for k, v in surface.items()}
        return self._names[idx, colour]

    def shines(self, chunk: dict[str, Any]) -> bool:
        """Whether a chunk sends out light."""
        return emission(self.scene.materials[chunk["material"]]) is not None

    def colour(self, record: dict[str, Any], chunk: dict[str, Any]) -> tuple[float, ...]:
        """Return the one colour that a surface has, constant or a primvar that is."""
        name = "albedo" if record["shader"] == "Matte" else "tint"
        default = (0.18, 0.18, 0.18) if record["shader"] == "Matte" else WHITE
        source = record["inputs"].get(name)
        node = None if source is None else record["nodes"][source["node"]]
        if node is None or node["type"] != "primvar" or source["channel"] != "rgb":
            return constant(record, name, default)
        for attribute in chunk["attributes"]:
            if attribute["name"] == node["name"]:
                if attribute["interpolation"] != "constant":
                    raise UnsupportedError(f"{record['path']}: a primvar that varies")
                return tuple(self.scene.values(attribute)[0].tolist())
        return tuple(node["fallback"][:3])


def surface_properties(record: dict[str, Any], colour: tuple[float, ...]) -> dict[str, Any]:
    """Return the properties of a material record in one colour."""
    if record["shader"] == "UsdPreviewSurface":
        return preview_surface(record)
    if constant(record, "opacity", 1.0) != 1.0:
        raise UnsupportedError(f"{record['path']}: opacity")
    if record["shader"] == "Matte":
        return {"type": "matte", "kd": list(colour)}
    if record["shader"] == "Mirror" and constant(record, "roughness", 0.0) == 0.0:
        return {"type": "mirror", "kr": list(colour)}
    if record["shader"] == "Glass":
        return glass(record, colour)
    raise UnsupportedError(f"{record['path']}: the shader {record['shader']}")


def glass(record: dict[str, Any], tint: tuple[float, ...]) -> dict[str, Any]:
    """Return smooth glass that tints what it refracts."""
    return {
        "type": "glass",
        "kr": list(WHITE),
        "kt": list(tint),
        "interiorior": constant(record, "ior", 1.5),
        "exteriorior": 1.0,
    }


def preview_surface(record: dict[str, Any]) -> dict[str, Any]:
    """Return a surface that has no interface, or is clear glass, and what it sends out.

    Without reflectance at normal incidence the interface still reflects at grazing angles. That is
    left out, as it is for Cycles: at most a hundredth of the light of a rough floor.
    """
    path = record["path"]
    for name in ("clearcoat", "opacityThreshold"):
        if constant(record, name, 0.0) != 0.0:
            raise UnsupportedError(f"{path}: {name}")
    for name in ("normal", "displacement"):
        if name in record["inputs"]:
            raise UnsupportedError(f"{path}: {name}")
    opacity = constant(record, "opacity", 1.0)
    takes_specular = constant(record, "useSpecularWorkflow", 0.0) != 0.0
    is_metal = not takes_specular and constant(record, "metallic", 0.0) != 0.0
    is_smooth = constant(record, "roughness", 0.5) == 0.0
    is_clear = opacity == 0.0 and constant(record, "opacityMode", 0.0) == 0.0
    if is_clear and is_smooth and not is_metal and emission(record) is None:
        return glass(record, WHITE)
    reflects = not takes_specular or any(constant(record, "specularColor", (0.0, 0.0, 0.0)))
    if opacity == 1.0 and not reflects:
        colour = constant(record, "diffuseColor", (0.18, 0.18, 0.18))
        return {"type": "matte", "kd": list(colour), **shine(record)}
    raise UnsupportedError(f"{path}: an interface or part of one")


def shine(record: dict[str, Any]) -> dict[str, Any]:
    """Return the radiance that a surface sends out on the side that it faces, if any."""
    radiance = emission(record)
    if radiance is None:
        return {}
    return {"emission": list(radiance), "emission.gain.normalizebycolor": False}
