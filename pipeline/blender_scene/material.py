"""Surface shaders.

`Matte`, `Mirror`, `Glass` and the metals and glass of UsdPreviewSurface are the same model. Its
plastic becomes a Principled BSDF: the same microfacets and the same F0, but the Fresnel term of a
dielectric in place of Schlick's and another share of light for the diffuse base; they differ most
at grazing angles.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import bpy

from blender_scene.graph import Graph, Scalar, Triple
from blender_scene.pattern import Patterns

if TYPE_CHECKING:
    from exported import ExportedScene

PRESENCE = 1.0
"""The value of `opacityMode` that stands for `presence`; 0 stands for `transparent`."""
PURE_METAL = 0.999
"""Above this, `metallic` counts as 1."""
UNKNOWN_GREY = (0.5, 0.5, 0.5)


class Materials:
    """Blender materials by record and by what instancers give per instance."""

    def __init__(self, scene: ExportedScene, warnings: list[str]) -> None:
        self.scene = scene
        self.warnings = warnings
        self.built: dict[tuple[int, frozenset[str]], bpy.types.Material] = {}

    def primvar_fallbacks(self, idx: int) -> dict[str, list[float]]:
        """Return the value of each primvar that a material reads, for meshes without it."""
        nodes = self.scene.materials[idx]["nodes"]
        return {node["name"]: node["fallback"] for node in nodes if node["type"] == "primvar"}

    def get(self, idx: int, per_instance: frozenset[str]) -> bpy.types.Material:
        """Return the material; the named primvars are read from instances."""
        key = (idx, per_instance.intersection(self.primvar_fallbacks(idx)))
        if key not in self.built:
            self.built[key] = self.build(*key)
        return self.built[key]

    def build(self, idx: int, per_instance: frozenset[str]) -> bpy.types.Material:
        """Build the shader graph of a record."""
        record = self.scene.materials[idx]
        material = bpy.data.materials.new(record["path"] or f"material {idx}")
        material.use_nodes = True
        graph = Graph.of_material(material)
        patterns = Patterns(self.scene, graph, record, per_instance)
        if build := SURFACES.get(record["shader"]):
            shader = build(graph, patterns)
        else:
            self.warnings.append(f"{record['path']}: no shader {record['shader']} in Cycles; grey")
            shader = diffuse(graph, UNKNOWN_GREY)
        if patterns.is_authored("displacement"):
            self.warnings.append(f"{record['path']}: displacement is not rendered")
        if record["shader"] == "Glass" and patterns.number("transmissionDepth", 0.0) != 0.0:
            self.warnings.append(f"{record['path']}: the absorption of glass is not rendered")
        graph.surface(shader)
        material.cycles.emission_sampling = "FRONT_BACK"
        # Off, normal maps tilt the shading frame and nothing else, as in ours; but then what a
        # mirror would reflect from below the surface is black, which ours lifts above it.
        is_metal = record["shader"] == "Mirror" or patterns.number("metallic", 0.0) != 0.0
        material.cycles.use_bump_map_correction = is_metal
        return material


def diffuse(graph: Graph, colour: Triple) -> bpy.types.NodeSocket:
    """Lambert."""
    return graph.node("ShaderNodeBsdfDiffuse", Color=colour, Roughness=0.0).outputs[0]


def transparent(graph: Graph) -> bpy.types.NodeSocket:
    """Nothing there."""
    return graph.node("ShaderNodeBsdfTransparent", Color=(1.0, 1.0, 1.0)).outputs[0]


def matte(graph: Graph, patterns: Patterns) -> bpy.types.NodeSocket:
    """Lambert with an opacity."""
    lambert = diffuse(graph, patterns.triple("albedo", (0.18, 0.18, 0.18)))
    opacity = patterns.number("opacity", 1.0)
    return lambert if opacity == 1.0 else graph.mixed(opacity, transparent(graph), lambert)


def mirror(graph: Graph, patterns: Patterns) -> bpy.types.NodeSocket:
    """Reflect a tint at every angle."""
    tint = patterns.triple("tint", (1.0, 1.0, 1.0))
    return glossy(graph, tint, patterns.number("roughness", 0.0), None)


def glass(graph: Graph, patterns: Patterns) -> bpy.types.NodeSocket:
    """Build smooth glass that tints what it refracts; Blender's own tints the reflection too."""
    tint = patterns.triple("tint", (1.0, 1.0, 1.0))
    return boundary(graph, patterns.number("ior", 1.5), tint, 0.0)


def with_emission(
    graph: Graph, patterns: Patterns, shader: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    """Add `emissiveColor`."""
    if not patterns.is_authored("emissiveColor"):
        return shader
    colour = patterns.triple("emissiveColor", (0.0, 0.0, 0.0))
    if colour == (0.0, 0.0, 0.0):
        return shader
    emission = graph.node("ShaderNodeEmission", Color=colour, Strength=1.0).outputs[0]
    return graph.added(shader, emission)


def preview_surface(graph: Graph, patterns: Patterns) -> bpy.types.NodeSocket:
    """Build UsdPreviewSurface with the opacity mode and threshold of its specification."""
    opacity = patterns.number("opacity", 1.0)
    threshold = patterns.number("opacityThreshold", 0.0)
    if threshold != 0.0:
        kept = graph.math("SUBTRACT", 1.0, graph.math("LESS_THAN", opacity, threshold))
        return graph.mixed(kept, transparent(graph), opaque(graph, patterns))
    if opacity == 1.0:
        return opaque(graph, patterns)
    if patterns.number("opacityMode", 0.0) == PRESENCE:
        return graph.mixed(opacity, transparent(graph), opaque(graph, patterns))
    glass = with_emission(graph, patterns, dielectric(graph, patterns))
    return glass if opacity == 0.0 else graph.mixed(opacity, glass, opaque(graph, patterns))


def opaque(graph: Graph, patterns: Patterns) -> bpy.types.NodeSocket:
    """Build everything but the opacity."""
    normal = shading_normal(graph, patterns)
    metallic = patterns.number("metallic", 0.0)
    if patterns.number("useSpecularWorkflow", 0.0) != 0.0:
        metallic = 0.0
    if metallic == 0.0:
        shader = plastic(graph, patterns, normal)
    elif metallic == 1.0:
        shader = coated_metal(graph, patterns, normal)
    else:
        shader = part_metal(graph, patterns, normal, metallic)
        if isinstance(metallic, bpy.types.NodeSocket):
            is_pure = graph.math("GREATER_THAN", metallic, PURE_METAL)
            shader = graph.mixed(is_pure, shader, coated_metal(graph, patterns, normal))
    return with_emission(graph, patterns, shader)


def plastic(
    graph: Graph, patterns: Patterns, normal: bpy.types.NodeSocket | None
) -> bpy.types.NodeSocket:
    """Build the dielectric: a diffuse base under a specular interface."""
    colour = patterns.triple("diffuseColor", (0.18, 0.18, 0.18))
    interface = {"IOR": patterns.number("ior", 1.5)}
    if patterns.number("useSpecularWorkflow", 0.0) != 0.0:
        interface = specular_workflow(graph, patterns.triple("specularColor", (0.0, 0.0, 0.0)))
    return principled(graph, patterns, normal, colour, interface)


def part_metal(
    graph: Graph, patterns: Patterns, normal: bpy.types.NodeSocket | None, metallic: Scalar
) -> bpy.types.NodeSocket:
    """Build what is neither metal nor dielectric.

    Its F0 is the specification's, which is not the mean of the two: the colour and the share of
    light are interpolated each, then multiplied.
    """
    colour = patterns.triple("diffuseColor", (0.18, 0.18, 0.18))
    f0 = dielectric_f0(graph, patterns.number("ior", 1.5))
    share = graph.math("MULTIPLY_ADD", metallic, graph.math("SUBTRACT", 1.0, f0), f0)
    less = graph.vector_math("SUBTRACT", colour, (1.0, 1.0, 1.0))
    tint = graph.vector_math("ADD", graph.vector_math("SCALE", less, metallic), (1.0, 1.0, 1.0))
    interface = specular_workflow(graph, graph.vector_math("SCALE", tint, share))
    base = graph.vector_math("SCALE", colour, graph.math("SUBTRACT", 1.0, metallic))
    return principled(graph, patterns, normal, base, interface)


def principled(
    graph: Graph,
    patterns: Patterns,
    normal: bpy.types.NodeSocket | None,
    base: Triple,
    interface: dict[str, Any],
) -> bpy.types.NodeSocket:
    """Build a diffuse base under a specular interface under a coat."""
    inputs: dict[str, Any] = {
        "Base_Color": base,
        "Roughness": patterns.number("roughness", 0.5),
        "Coat_Weight": patterns.number("clearcoat", 0.0),
        "Coat_Roughness": patterns.number("clearcoatRoughness", 0.01),
        "Coat_IOR": patterns.number("ior", 1.5),
    } | interface
    if normal is not None:
        inputs |= {"Normal": normal, "Coat_Normal": normal}
    node = graph.node("ShaderNodeBsdfPrincipled", **inputs)
    node.distribution = "MULTI_GGX"
    return node.outputs[0]


def coated_metal(
    graph: Graph, patterns: Patterns, normal: bpy.types.NodeSocket | None
) -> bpy.types.NodeSocket:
    """Build the metal, whose reflectance is the same at every angle, and the coat on it."""
    colour = patterns.triple("diffuseColor", (0.18, 0.18, 0.18))
    metal = glossy(graph, colour, patterns.number("roughness", 0.5), normal)
    coat = patterns.number("clearcoat", 0.0)
    if coat == 0.0:
        return metal
    fresnel = graph.node("ShaderNodeFresnel", IOR=patterns.number("ior", 1.5))
    if normal is not None:
        graph.put(fresnel.inputs["Normal"], normal)
    roughness = patterns.number("clearcoatRoughness", 0.01)
    film = glossy(graph, (1.0, 1.0, 1.0), roughness, normal)
    return graph.mixed(graph.math("MULTIPLY", coat, fresnel.outputs[0]), metal, film)


def glossy(
    graph: Graph, colour: Triple, roughness: Scalar, normal: bpy.types.NodeSocket | None
) -> bpy.types.NodeSocket:
    """Reflect with GGX, the energy of further bounces between facets returned."""
    node = graph.node("ShaderNodeBsdfGlossy", Color=colour, Roughness=roughness)
    node.distribution = "MULTI_GGX"
    if normal is not None:
        graph.put(node.inputs["Normal"], normal)
    return node.outputs[0]


def dielectric_f0(graph: Graph, ior: Scalar) -> Scalar:
    """Return the reflectance of a smooth boundary at normal incidence."""
    root = graph.math("DIVIDE", graph.math("SUBTRACT", 1.0, ior), graph.math("ADD", 1.0, ior))
    return graph.math("MULTIPLY", root, root)


def specular_workflow(graph: Graph, specular: Triple) -> dict[str, Any]:
    """Return the index whose F0 is the brightest channel, and the tint that gives the others."""
    if isinstance(specular, bpy.types.NodeSocket):
        red, green, blue = (graph.channel(specular, idx) for idx in range(3))
        peak = graph.math("MAXIMUM", red, graph.math("MAXIMUM", green, blue))
        # F0 = 1 would be an infinite index.
        root = graph.math("SQRT", graph.math("MINIMUM", peak, 0.98))
        one_over = graph.math("DIVIDE", 1.0, graph.math("MAXIMUM", peak, 1e-6))
        tint: Triple = graph.vector_math("SCALE", specular, one_over)
        over = graph.math("ADD", 1.0, root)
        return {
            "IOR": graph.math("DIVIDE", over, graph.math("SUBTRACT", 1.0, root)),
            "Specular_Tint": tint,
        }
    peak = max(specular)
    root = min(peak, 0.98) ** 0.5
    tint = tuple(channel / peak for channel in specular) if peak > 0.0 else (1.0, 1.0, 1.0)
    return {"IOR": (1.0 + root) / (1.0 - root), "Specular_Tint": tint}


def dielectric(graph: Graph, patterns: Patterns) -> bpy.types.NodeSocket:
    """Glass whose transmission is always sharp; roughness blurs the reflection alone."""
    ior = patterns.number("ior", 1.5)
    roughness: Scalar = patterns.number("roughness", 0.5)
    if roughness == 0.0:
        node = graph.node("ShaderNodeBsdfGlass", Color=(1.0, 1.0, 1.0), Roughness=0.0, IOR=ior)
        node.distribution = "GGX"
        return node.outputs[0]
    return boundary(graph, ior, (1.0, 1.0, 1.0), roughness)


def boundary(graph: Graph, ior: Scalar, tint: Triple, roughness: Scalar) -> bpy.types.NodeSocket:
    """Refract sharply and tinted, reflect with roughness and white, shared by Fresnel."""
    through = graph.node("ShaderNodeBsdfRefraction", Color=tint, Roughness=0.0, IOR=ior)
    through.distribution = "GGX"
    reflected = glossy(graph, (1.0, 1.0, 1.0), roughness, None)
    fresnel = graph.node("ShaderNodeFresnel", IOR=ior).outputs[0]
    return graph.mixed(fresnel, through.outputs[0], reflected)


def shading_normal(graph: Graph, patterns: Patterns) -> bpy.types.NodeSocket | None:
    """Return the normal that a tangent-space `normal` input gives, or None without one."""
    if not patterns.is_authored("normal"):
        return None
    tangent = patterns.triple("normal", (0.0, 0.0, 1.0))
    if not isinstance(tangent, bpy.types.NodeSocket):
        return None
    # The Normal Map node expects it packed into [0, 1].
    packed = graph.vector_math("MULTIPLY_ADD", tangent, (0.5, 0.5, 0.5), (0.5, 0.5, 0.5))
    node = graph.node("ShaderNodeNormalMap", Color=packed)
    node.space = "TANGENT"
    node.uv_map = patterns.coordinates_name("normal") or ""
    return node.outputs[0]


SURFACES: dict[str, Callable[[Graph, Patterns], bpy.types.NodeSocket]] = {
    "Glass": glass,
    "Matte": matte,
    "Mirror": mirror,
    "UsdPreviewSurface": preview_surface,
}
"""What builds the shader graph of a record, by the record's shader."""
