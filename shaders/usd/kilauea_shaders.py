"""Puts Kilauea's shaders into USD's shader registry, for hosts that offer or check shaders.

USD has no way to find `shaderDefs.usda` files of others by data alone, so this is a Python plugin:
a host imports it, or loads it by name from the folders in `PXR_PLUGINPATH_NAME`.
"""

from __future__ import annotations

from pathlib import Path

from pxr import Sdr, Tf, Usd, UsdShade, UsdUtils

DEFINITIONS = Path(__file__).with_name("shaderDefs.usda")


def register(file: Path = DEFINITIONS) -> list[str]:
    """Add the shaders that a file defines to the registry; returns their identifiers."""
    stage = Usd.Stage.Open(str(file))
    registry = Sdr.Registry()
    identifiers = []
    for prim in stage.GetPseudoRoot().GetChildren():
        identifier = UsdShade.Shader(prim).GetIdAttr().Get()
        result = Sdr.NodeDiscoveryResult(
            identifier,
            Sdr.Version().GetAsDefault(),
            identifier,
            "surface",
            "usda",
            "kilauea",
            str(file),
            str(file),
            subIdentifier=prim.GetName(),
        )
        registry.AddDiscoveryResult(result)
        identifiers.append(identifier)
    parse(registry, identifiers)
    return identifiers


def parse(registry: Sdr.Registry, identifiers: list[str]) -> None:
    """Parse the definitions without USD's remark that a colon is in no prim's name.

    Its parser looks for a prim called like the identifier before it takes the sub-identifier.
    """
    collected = UsdUtils.CoalescingDiagnosticDelegate()
    for identifier in identifiers:
        registry.GetShaderNodeByIdentifier(identifier)
    diagnostics = collected.TakeUncoalescedDiagnostics()
    del collected
    for diagnostic in diagnostics:
        if "Invalid prim name" not in diagnostic.commentary:
            Tf.Warn(diagnostic.commentary)


register()
