"""Names of image layers, as users of other renderers write them."""

from __future__ import annotations

_ALIASES = {
    "beauty": ("C", "Ci", "Cf", "color", "rgba", "rgb", "combined", "C.*", "LPE:C.*"),
    "Z": ("depth", "Pz", "cameraDepth", "linearDepth"),
    "N": ("normal", "Nn", "hitN"),
    "P": ("position", "hitP", "worldPosition"),
    "albedo": ("diffuse_albedo", "Denoising Albedo"),
    "direct_diffuse": ("directdiffuse", "diffuse_direct", "DiffDir", "C<RD>L", "LPE:C<RD>L"),
    "indirect_diffuse": (
        *("indirectdiffuse", "diffuse_indirect", "DiffInd", "C<RD>.+L", "LPE:C<RD>.+L"),
    ),
    "direct_specular": (
        *("directspecular", "specular_direct", "directglossyreflection", "GlossDir"),
        *("C<RG>L", "LPE:C<RG>L"),
    ),
    "indirect_specular": (
        *("indirectspecular", "specular_indirect", "indirectglossyreflection", "GlossInd"),
        *("C<RG>.+L", "LPE:C<RG>.+L"),
    ),
    "emission": ("emit", "directemission", "CO", "C[LO]"),
    "sample_count": ("samplecount", "samples", "Debug Sample Count"),
    "variance": ("variance.Y",),
    "primId": ("id", "prim_id"),
    "instanceId": ("instance_id", "instance"),
}

_BY_NAME = {
    spelling.casefold(): name for name, aliases in _ALIASES.items() for spelling in (name, *aliases)
}


def canonical(name: str) -> str | None:
    """Return the engine's name of a layer; None where there is no such layer."""
    return _BY_NAME.get(name.casefold())


def known() -> list[str]:
    """Return the engine's names of all layers."""
    return list(_ALIASES)
