"""A few words for writing shader node trees as expressions."""

from __future__ import annotations

from typing import Any

import bpy

Scalar = float | bpy.types.NodeSocket
Triple = tuple[float, float, float] | list[float] | bpy.types.NodeSocket


class Graph:
    """A node tree under construction."""

    def __init__(self, tree: bpy.types.NodeTree, output: str) -> None:
        self.tree = tree
        tree.nodes.clear()
        self.output = self.node(output)

    @classmethod
    def of_material(cls, material: bpy.types.Material) -> Graph:
        """Start a surface shader."""
        return cls(material.node_tree, "ShaderNodeOutputMaterial")

    @classmethod
    def of_light(cls, light: bpy.types.Light) -> Graph:
        """Start the shader of a light."""
        light.use_nodes = True
        return cls(light.node_tree, "ShaderNodeOutputLight")

    @classmethod
    def of_world(cls, world: bpy.types.World) -> Graph:
        """Start the shader of the background."""
        return cls(world.node_tree, "ShaderNodeOutputWorld")

    def node(self, kind: str, **inputs: Any) -> bpy.types.Node:
        """Add a node; inputs are given by identifier, with underscores for spaces."""
        node = self.tree.nodes.new(kind)
        for name, value in inputs.items():
            self.put(node.inputs[name.replace("_", " ")], value)
        return node

    def put(self, socket: bpy.types.NodeSocket, value: Any) -> None:
        """Connect a socket, or give it a constant."""
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        elif socket.type == "RGBA":
            socket.default_value = (*value[:3], 1.0)
        else:
            socket.default_value = value

    def surface(self, shader: bpy.types.NodeSocket) -> None:
        """Use a shader as the result."""
        self.tree.links.new(shader, self.output.inputs["Surface"])

    def emit(self, colour: Triple | Scalar, strength: Scalar = 1.0) -> None:
        """Use an emission as the result."""
        emission = self.node("ShaderNodeEmission", Color=colour, Strength=strength)
        self.surface(emission.outputs[0])

    def math(self, operation: str, *operands: Scalar) -> bpy.types.NodeSocket:
        """Apply an operation of the Math node."""
        node = self.tree.nodes.new("ShaderNodeMath")
        node.operation = operation
        for socket, operand in zip(node.inputs, operands, strict=False):
            self.put(socket, operand)
        return node.outputs[0]

    def vector_math(self, operation: str, *operands: Triple | Scalar) -> bpy.types.NodeSocket:
        """Apply an operation of the Vector Math node; the second operand of SCALE is a number."""
        node = self.tree.nodes.new("ShaderNodeVectorMath")
        node.operation = operation
        for idx, operand in enumerate(operands):
            is_factor = operation == "SCALE" and idx == 1
            self.put(node.inputs["Scale" if is_factor else idx], operand)
        return node.outputs["Value" if operation in ("DOT_PRODUCT", "DISTANCE") else "Vector"]

    def combined(self, channels: list[Scalar]) -> bpy.types.NodeSocket:
        """Join three numbers."""
        node = self.node("ShaderNodeCombineXYZ")
        for socket, channel in zip(node.inputs, channels, strict=True):
            self.put(socket, channel)
        return node.outputs[0]

    def channel(self, triple: bpy.types.NodeSocket, idx: int) -> bpy.types.NodeSocket:
        """Take one channel of three."""
        return self.node("ShaderNodeSeparateXYZ", Vector=triple).outputs[idx]

    def mixed(
        self, weight: Scalar, zero: bpy.types.NodeSocket, one: bpy.types.NodeSocket
    ) -> bpy.types.NodeSocket:
        """Interpolate between two shaders."""
        node = self.tree.nodes.new("ShaderNodeMixShader")
        self.put(node.inputs[0], weight)
        self.put(node.inputs[1], zero)
        self.put(node.inputs[2], one)
        return node.outputs[0]

    def added(self, a: bpy.types.NodeSocket, b: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
        """Add two shaders."""
        node = self.tree.nodes.new("ShaderNodeAddShader")
        self.put(node.inputs[0], a)
        self.put(node.inputs[1], b)
        return node.outputs[0]
