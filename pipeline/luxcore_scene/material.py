"""Surfaces that LuxCore models as we do: `Matte`, smooth `Mirror` and `Glass`."""

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
    if constant(record, "opacity", 1.0) != 1.0:
        raise UnsupportedError(f"{record['path']}: opacity")
    if emission(record) is not None:
        raise UnsupportedError(f"{record['path']}: surfaces that shine")
    if record["shader"] == "Matte":
        return {"type": "matte", "kd": list(colour)}
    if record["shader"] == "Mirror" and constant(record, "roughness", 0.0) == 0.0:
        return {"type": "mirror", "kr": list(colour)}
    if record["shader"] == "Glass":
        return {
            "type": "glass",
            "kr": list(WHITE),
            "kt": list(colour),
            "interiorior": constant(record, "ior", 1.5),
            "exteriorior": 1.0,
        }
    raise UnsupportedError(f"{record['path']}: the shader {record['shader']}")
