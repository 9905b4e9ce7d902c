"""Diffuse surfaces, smooth mirrors, glass and emission.

UsdPreviewSurface with constant inputs becomes `principled`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from constant_inputs import constant, emission
from unsupported import UnsupportedError

if TYPE_CHECKING:
    from exported import ExportedScene

PRINCIPLED = {
    "roughness": ("roughness", 0.5),
    "metallic": ("metallic", 0.0),
    "eta": ("ior", 1.5),
    "clearcoat": ("clearcoat", 0.0),
}
"""Input and default of UsdPreviewSurface for each parameter."""
WHITE = (1.0, 1.0, 1.0)
UNSUPPORTED = ("normal", "displacement", "opacityThreshold", "useSpecularWorkflow")


class Materials:
    """Reads the material records of a scene."""

    def __init__(self, scene: ExportedScene) -> None:
        self.records = scene.materials

    def any_emits(self) -> bool:
        """Whether any material shines."""
        return any(self.emission(idx) is not None for idx in range(len(self.records)))

    def emission(self, idx: int) -> dict[str, Any] | None:
        """Return the radiance of a material, None where it has none."""
        value = emission(self.records[idx])
        return None if value is None else {"type": "rgb", "value": value}

    def bsdf(self, idx: int, attributes: dict[str, str]) -> dict[str, Any]:
        """Return the surface of a material on a mesh.

        `attributes` names the mesh attribute of each primvar that the mesh has.
        """
        record = self.records[idx]
        if constant(record, "opacity", 1.0) != 1.0:
            raise UnsupportedError(f"{record['path']}: opacity")
        if record["shader"] == "Matte":
            colour = colour_of(record, "albedo", attributes)
            return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": colour}}
        if record["shader"] == "Mirror" and constant(record, "roughness", 0.0) == 0.0:
            tint = colour_of(record, "tint", attributes, WHITE)
            mirror = {"type": "conductor", "material": "none", "specular_reflectance": tint}
            return {"type": "twosided", "bsdf": mirror}
        if record["shader"] == "Glass":
            if constant(record, "transmissionDepth", 0.0) != 0.0:
                raise UnsupportedError(f"{record['path']}: the absorption of glass")
            return {
                "type": "dielectric",
                "int_ior": constant(record, "ior", 1.5),
                "ext_ior": 1.0,
                "specular_transmittance": colour_of(record, "tint", attributes, WHITE),
            }
        if record["shader"] != "UsdPreviewSurface":
            raise UnsupportedError(f"{record['path']}: the shader {record['shader']}")
        for name in UNSUPPORTED:
            if name in record["inputs"] and constant(record, name, 0.0) not in (0.0, (0, 0, 1)):
                raise UnsupportedError(f"{record['path']}: the input {name}")
        parameters: dict[str, Any] = {
            plugin: constant(record, name, default)
            for plugin, (name, default) in PRINCIPLED.items()
        }
        parameters["base_color"] = colour_of(record, "diffuseColor", attributes)
        return {"type": "twosided", "bsdf": {"type": "principled", **parameters}}


def colour_of(
    record: dict[str, Any],
    name: str,
    attributes: dict[str, str],
    default: tuple[float, float, float] = (0.18, 0.18, 0.18),
) -> dict[str, Any]:
    """Return the colour of a surface: constant or a primvar."""
    source = record["inputs"].get(name)
    node = None if source is None else record["nodes"][source["node"]]
    if node is not None and node["type"] == "primvar" and source["channel"] == "rgb":
        if node["name"] in attributes:
            return {"type": "mesh_attribute", "name": attributes[node["name"]]}
        return {"type": "rgb", "value": node["fallback"][:3]}
    return {"type": "rgb", "value": constant(record, name, default)}
