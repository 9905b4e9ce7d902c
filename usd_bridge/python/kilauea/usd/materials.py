"""Materials: UsdPreviewSurface, what comes near it and shaders of ours, as engine records."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pxr import Usd, UsdShade

from kilauea import payload
from kilauea.usd import declared, materialx, networks
from kilauea.usd.networks import Network, Value
from kilauea.usd.remarks import Remarks
from kilauea.usd.textures import TextureTable

UNBOUND_GREY = 0.5
"""Of surfaces without material and displayColor."""

_PATTERNS = {**networks.PATTERNS, **materialx.PATTERNS}
_PREVIEW_INPUTS = (
    "diffuseColor",
    "emissiveColor",
    "useSpecularWorkflow",
    "specularColor",
    "metallic",
    "roughness",
    "clearcoat",
    "clearcoatRoughness",
    "opacity",
    "opacityThreshold",
    "ior",
    "normal",
)


class MaterialTable:
    """The frame's materials, each once."""

    def __init__(self, frame: payload.Frame, options: Any, textures: TextureTable) -> None:
        self._frame = frame
        self._time = Usd.TimeCode(options.time)
        self._textures = textures
        self._remarks = Remarks(frame.warnings)
        self._indices: dict[Any, int] = {}
        self._primvars: list[frozenset[str]] = []

    def index(
        self,
        material: UsdShade.Material | None,
        has_display_color: bool,
        has_display_opacity: bool,
    ) -> int:
        """Return the index of a material in `Frame.materials`.

        Without material it is a matte surface of the display colour and opacity, as far as the
        prim has them.
        """
        if material:
            prim = material.GetPrim()
            shared = prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim
            key = shared.GetPath()
        else:
            key = (has_display_color, has_display_opacity)
        if key not in self._indices:
            self._indices[key] = len(self._frame.materials)
            if material:
                self._add_bound(material)
            else:
                self._add_unbound(has_display_color, has_display_opacity)
        return self._indices[key]

    def primvars(self, index: int) -> frozenset[str]:
        """Return the names of the primvars that a material reads."""
        return self._primvars[index]

    def _add_bound(self, material: UsdShade.Material) -> None:
        path = str(material.GetPath())
        network = self._network(path)
        shader = self._surface_shader(material)
        name = "UsdPreviewSurface"
        inputs: dict[str, Value] = {}
        if shader:
            shader_id = str(shader.GetShaderId())
            if declared.is_ours(shader_id):
                name, inputs = declared.read(network, shader, path)
            else:
                inputs = _SURFACES[shader_id](network, shader)
        self._append(path, name, network, inputs)

    def _add_unbound(self, has_display_color: bool, has_display_opacity: bool) -> None:
        network = self._network("")
        grey = (UNBOUND_GREY,) * 3
        inputs = {
            "albedo": network.primvar("displayColor", grey, 3)
            if has_display_color
            else network.constant(grey),
            "opacity": network.primvar("displayOpacity", (1.0,), 1)
            if has_display_opacity
            else network.constant((1.0,)),
        }
        self._append("", "Matte", network, inputs)

    def _network(self, path: str) -> Network:
        def remark(text: str) -> None:
            self._remarks.add(path, text)

        return Network(self._textures, self._time, remark, _PATTERNS)

    def _append(self, path: str, shader: str, network: Network, inputs: dict[str, Value]) -> None:
        records, nodes = network.records(inputs)
        self._frame.materials.append(
            {"path": path, "shader": shader, "inputs": records, "nodes": nodes}
        )
        self._primvars.append(
            frozenset(node["name"] for node in nodes if node["type"] == "primvar")
        )

    def _surface_shader(self, material: UsdShade.Material) -> UsdShade.Shader | None:
        """Return the surface shader that can be rendered, the universal one first."""
        path = str(material.GetPath())
        found: dict[str, None] = {}
        for context in ("", "mtlx"):
            shader = material.ComputeSurfaceSource(context)[0]
            name = str(shader.GetShaderId() or "without info:id") if shader else ""
            if name in _SURFACES or declared.is_ours(name):
                return shader
            if name:
                found[name] = None
        others = [
            str(output.GetBaseName())
            for output in material.GetSurfaceOutputs()
            if output.HasConnectedSource() and not found
        ]
        if material.ComputeVolumeSource()[0]:
            self._remarks.add(path, "volume shaders are not rendered")
        what = ", ".join((*found, *others)) or "none at all"
        self._frame.missing.append(
            f"{path}: no surface shader that can be rendered ({what}): rendered as grey"
        )
        return None


def _preview_surface(network: Network, shader: UsdShade.Shader) -> dict[str, Value]:
    inputs: dict[str, Value] = {}
    for name in _PREVIEW_INPUTS:
        value = network.read(shader.GetInput(name))
        if value:
            inputs[name] = value
    if "normal" in inputs and network.constant_value(inputs["normal"]) == [0.0, 0.0, 1.0, 1.0]:
        del inputs["normal"]
    if port := shader.GetInput("opacityMode"):
        modes = declared.declarations()["UsdPreviewSurface"]["inputs"]["opacityMode"]["tokens"]
        mode = declared.token(network, port, modes)
        if mode:
            inputs["opacityMode"] = mode
    displacement = network.read(shader.GetInput("displacement"))
    if displacement and (network.constant_value(displacement) or [1.0])[0] != 0.0:
        network.remark("displacement is not rendered")
    return inputs


_Surface = Callable[[Network, UsdShade.Shader], dict[str, Value]]
_SURFACES: dict[str, _Surface] = {
    "UsdPreviewSurface": _preview_surface,
    "ND_UsdPreviewSurface_surfaceshader": _preview_surface,
    "ND_standard_surface_surfaceshader": materialx.standard_surface,
    "ND_open_pbr_surface_surfaceshader": materialx.open_pbr,
}
"""What gives the inputs of UsdPreviewSurface, by shader id."""
