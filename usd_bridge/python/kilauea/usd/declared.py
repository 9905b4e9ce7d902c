"""Shaders of ours, read from a stage as they are declared where they are written."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from typing import Any

from pxr import UsdShade

from kilauea.errors import KilaueaError
from kilauea.render import native
from kilauea.usd.networks import Network, Value

PREFIX = "kilauea:"
"""Of the `info:id` of our own shaders."""

_FITTING = {
    "float": {"float", "double", "pxr_half::half", "int"},
    "int": {"int"},
    "float3": {"GfVec3f", "GfVec3d", "GfVec3h"},
    "color3f": {"GfVec3f", "GfVec3d", "GfVec3h"},
    "token": {"TfToken", "string"},
}
"""C++ types of the values that an input of a declared type takes."""


@cache
def declarations() -> dict[str, dict[str, Any]]:
    """Return what the engine's shaders declare, by `info:id`: name, inputs, their types."""
    return json.loads(native().shader_declarations())


def is_ours(shader_id: str) -> bool:
    """Whether a shader of ours has that `info:id`."""
    return shader_id.startswith(PREFIX) and shader_id in declarations()


def read(network: Network, shader: UsdShade.Shader, material: str) -> tuple[str, dict[str, Value]]:
    """Return the engine's name of a shader of ours and its authored inputs.

    Raises
    ------
    KilaueaError
        An input, or what is connected to it, has another type than is declared.
    """
    shader_id = str(shader.GetShaderId())
    declared = declarations()[shader_id]
    inputs: dict[str, Value] = {}
    for port in shader.GetInputs():
        name = str(port.GetBaseName())
        if name not in declared["inputs"]:
            network.remark(f"{shader_id} has no input {name}")
            continue
        kind, tokens = declared["inputs"][name]["type"], declared["inputs"][name]["tokens"]
        _check_type(network, port, kind, f"{material}: inputs:{name} of {shader_id}")
        value = token(network, port, tokens) if tokens else network.read(port)
        if value:
            inputs[name] = value
    return declared["shader"], inputs


def token(network: Network, port: UsdShade.Input, tokens: Sequence[str]) -> Value | None:
    """Return an input that takes one of some words as the index of its word."""
    word = network.text(port, "")
    if word in tokens:
        return network.constant((float(tokens.index(word)),))
    if word:
        network.remark(f"{port.GetBaseName()} {word} is unknown: {tokens[0]}")
    return None


def _check_type(network: Network, port: UsdShade.Input, kind: str, what: str) -> None:
    for found in (port.GetTypeName(), network.type_of(port)):
        if found and str(found.type.typeName) not in _FITTING[kind]:
            raise KilaueaError(f"{what} is a {found}; expected a {kind}")
