"""Pattern nodes of a material record as shader nodes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import bpy

from blender_scene.graph import Graph, Scalar, Triple
from blender_scene.image import load_image
from blender_scene.mesh import attribute_name

if TYPE_CHECKING:
    from exported import ExportedScene

EXTENSIONS = {"clamp": "EXTEND", "repeat": "REPEAT", "mirror": "MIRROR"}


@dataclass(frozen=True)
class Channels:
    """The four channels of a node: constants or sockets."""

    rgb: Triple
    alpha: Scalar


class Patterns:
    """Evaluates the nodes of one material inside its shader graph."""

    def __init__(
        self,
        scene: ExportedScene,
        graph: Graph,
        material: dict[str, Any],
        per_instance: frozenset[str],
    ) -> None:
        self.scene = scene
        self.graph = graph
        self.material = material
        self.per_instance = per_instance
        self.evaluated: dict[int, Channels] = {}

    def number(self, name: str, default: float) -> Scalar:
        """Return a scalar input: the first channel where it names three."""
        source = self.material["inputs"].get(name)
        if source is None:
            return default
        channels = self.node(source["node"])
        channel = source["channel"]
        if channel == "a":
            return channels.alpha
        return self.single(channels.rgb, {"rgb": 0, "r": 0, "g": 1, "b": 2}[channel])

    def triple(self, name: str, default: tuple[float, float, float]) -> Triple:
        """Return a colour or vector input: one channel is repeated."""
        source = self.material["inputs"].get(name)
        if source is None:
            return default
        if source["channel"] == "rgb":
            return self.node(source["node"]).rgb
        number = self.number(name, 0.0)
        if isinstance(number, bpy.types.NodeSocket):
            return self.graph.combined([number] * 3)
        return (number, number, number)

    def is_authored(self, name: str) -> bool:
        """Whether the record has that input."""
        return name in self.material["inputs"]

    def coordinates_name(self, name: str) -> str | None:
        """Return the attribute that holds the texture coordinates of an input."""
        nodes = self.material["nodes"]
        node = nodes[self.material["inputs"][name]["node"]]
        while node["type"] in ("uv_texture", "transform2d"):
            node = nodes[node["st" if node["type"] == "uv_texture" else "input"]]
        return attribute_name(node["name"]) if node["type"] == "primvar" else None

    def single(self, rgb: Triple, idx: int) -> Scalar:
        """Take one of three channels."""
        if isinstance(rgb, bpy.types.NodeSocket):
            return self.graph.channel(rgb, idx)
        return rgb[idx]

    def node(self, idx: int) -> Channels:
        """Return the channels of a node, built once."""
        if idx not in self.evaluated:
            record = self.material["nodes"][idx]
            self.evaluated[idx] = getattr(self, record["type"])(record)
        return self.evaluated[idx]

    def constant(self, record: dict[str, Any]) -> Channels:
        """Return a value."""
        *rgb, alpha = record["value"]
        return Channels(tuple(rgb), alpha)

    def primvar(self, record: dict[str, Any]) -> Channels:
        """Read an attribute of the mesh or of the instance."""
        node = self.graph.node("ShaderNodeAttribute")
        node.attribute_name = attribute_name(record["name"])
        is_per_instance = record["name"] in self.per_instance
        node.attribute_type = "INSTANCER" if is_per_instance else "GEOMETRY"
        return Channels(node.outputs["Vector"], node.outputs["Alpha"])

    def transform2d(self, record: dict[str, Any]) -> Channels:
        """Scale, rotate, then translate; the Mapping node has the same order for points."""
        before = self.node(record["input"])
        node = self.graph.node(
            "ShaderNodeMapping",
            Vector=before.rgb,
            Location=(*record["translation"], 0.0),
            Rotation=(0.0, 0.0, math.radians(record["rotation_degrees"])),
            Scale=(*record["scale"], 1.0),
        )
        return Channels(node.outputs[0], before.alpha)

    def uv_texture(self, record: dict[str, Any]) -> Channels:
        """Look an image up, then scale and bias it."""
        files = self.scene.textures[record["texture"]]["files"]
        if not files:
            *rgb, alpha = record["fallback"]
            found = Channels(tuple(rgb), alpha)
        elif files[0]["udim"]:
            found = self.udim_lookup(files, self.node(record["st"]).rgb)
        else:
            found = self.lookup(load_image(files[0]["tiles"]), record)
        return self.scaled(found, record["scale"], record["bias"])

    def lookup(self, image: bpy.types.Image, record: dict[str, Any]) -> Channels:
        """Sample an image as wrapped in both directions."""
        st = self.node(record["st"]).rgb
        if record["wrap_s"] == record["wrap_t"] and record["wrap_s"] in EXTENSIONS:
            return self.sampled(image, st, EXTENSIONS[record["wrap_s"]])
        # Cycles has one mode for both directions, and fades to black inside of the border; so each
        # direction is wrapped by hand.
        width, height = image.size
        s, in_s = self.wrapped(self.single(st, 0), record["wrap_s"], width)
        t, in_t = self.wrapped(self.single(st, 1), record["wrap_t"], height)
        texel = self.sampled(image, self.graph.combined([s, t, 0.0]), "REPEAT")
        return self.masked(texel, self.graph.math("MULTIPLY", in_s, in_t))

    def udim_lookup(self, files: list[dict[str, Any]], st: Triple) -> Channels:
        """Add the tiles up, each black outside of its own unit square."""
        graph = self.graph
        cell = graph.vector_math("FLOOR", st)
        total = Channels((0.0, 0.0, 0.0), 0.0)
        for file in files:
            corner = ((file["udim"] - 1001) % 10, (file["udim"] - 1001) // 10, 0)
            here = graph.vector_math("SUBTRACT", st, corner)
            away = graph.vector_math("DISTANCE", cell, corner)
            texel = self.sampled(load_image(file["tiles"]), here, "EXTEND")
            texel = self.masked(texel, graph.math("LESS_THAN", away, 0.5))
            total = Channels(
                graph.vector_math("ADD", total.rgb, texel.rgb),
                graph.math("ADD", total.alpha, texel.alpha),
            )
        return total

    def sampled(self, image: bpy.types.Image, st: Triple, extension: str) -> Channels:
        """Sample an image bilinearly."""
        node = self.graph.node("ShaderNodeTexImage", Vector=st)
        node.image = image
        node.extension = extension
        return Channels(node.outputs["Color"], node.outputs["Alpha"])

    def masked(self, texel: Channels, weight: Scalar) -> Channels:
        """Multiply all four channels."""
        rgb = self.graph.vector_math("SCALE", texel.rgb, weight)
        return Channels(rgb, self.graph.math("MULTIPLY", texel.alpha, weight))

    def wrapped(self, x: Scalar, wrap: str, n_texels: int) -> tuple[Scalar, Scalar]:
        """Map a coordinate into [0, 1]; the second result is 0 where the image is black."""
        math_node = self.graph.math
        if wrap == "repeat":
            return x, 1.0
        if wrap == "mirror":
            x = math_node("PINGPONG", x, 1.0)
        border = 0.5 / n_texels
        clamped = math_node("MINIMUM", math_node("MAXIMUM", x, border), 1.0 - border)
        if wrap in ("clamp", "mirror"):
            return clamped, 1.0
        from_centre = math_node("ABSOLUTE", math_node("SUBTRACT", x, 0.5))
        return clamped, math_node("SUBTRACT", 1.0, math_node("GREATER_THAN", from_centre, 0.5))

    def scaled(self, found: Channels, scale: list[float], bias: list[float]) -> Channels:
        """Return `scale * found + bias` per channel."""
        rgb, alpha = found.rgb, found.alpha
        if isinstance(rgb, bpy.types.NodeSocket):
            if scale[:3] != [1.0, 1.0, 1.0]:
                rgb = self.graph.vector_math("MULTIPLY", rgb, scale[:3])
            if bias[:3] != [0.0, 0.0, 0.0]:
                rgb = self.graph.vector_math("ADD", rgb, bias[:3])
        else:
            rgb = tuple(s * x + b for s, x, b in zip(scale, rgb, bias, strict=False))
        if not isinstance(alpha, bpy.types.NodeSocket):
            alpha = scale[3] * alpha + bias[3]
        elif (scale[3], bias[3]) != (1.0, 0.0):
            alpha = self.graph.math("MULTIPLY_ADD", alpha, scale[3], bias[3])
        return Channels(rgb, alpha)
