"""Pattern networks: what feeds the inputs of a surface shader, as `kilauea_scene::Node` records."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pxr import Gf, Sdf, Usd, UsdShade

from kilauea.usd.textures import TextureTable

Numbers = tuple[float, ...]

_MAX_F32 = 3.4e38
_READER = "UsdPrimvarReader_"
_READER_WIDTHS = {
    "float": 1,
    "int": 1,
    "float2": 2,
    "float3": 3,
    "float4": 4,
    "normal": 3,
    "point": 3,
    "vector": 3,
}
_WRAPS = {
    "black": "black",
    "constant": "black",
    "clamp": "clamp",
    "repeat": "repeat",
    "periodic": "repeat",
    "mirror": "mirror",
}


@dataclass(frozen=True, slots=True)
class Value:
    """One output of a node."""

    node: int
    channel: str
    """r, g, b, a or rgb."""


Pattern = Callable[["Network", UsdShade.Shader, str], Value | None]
"""Turns an output of a shader prim into a value; None where it cannot."""


class Network:
    """The nodes of one material, each after those it reads, equal ones once."""

    def __init__(
        self,
        textures: TextureTable,
        time: Usd.TimeCode,
        remark: Callable[[str], None],
        patterns: Mapping[str, Pattern],
    ) -> None:
        self.textures = textures
        self.time = time
        self.remark = remark
        """Tells the user what is not rendered."""
        self._patterns = patterns
        self._nodes: list[dict[str, Any]] = []
        self._indices: dict[str, int] = {}
        self._values: dict[tuple[Sdf.Path, str], Value | None] = {}

    def records(self, inputs: Mapping[str, Value]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Return the `Input` records of a material and the nodes that they read."""
        used = {value.node for value in inputs.values()}
        for index in reversed(range(len(self._nodes))):
            if index in used:
                node = self._nodes[index]
                used.update(node[key] for key in ("input", "st") if key in node)
        renumbered = {old: new for new, old in enumerate(sorted(used))}
        nodes = []
        for old in renumbered:
            node = dict(self._nodes[old])
            node.update({key: renumbered[node[key]] for key in ("input", "st") if key in node})
            nodes.append(node)
        records = {
            name: {"node": renumbered[value.node], "channel": value.channel}
            for name, value in inputs.items()
        }
        return records, nodes

    def read(self, port: UsdShade.Input | None) -> Value | None:
        """Return what feeds an input; None where nothing does and its default holds."""
        attribute = self._producer(port)
        if attribute is None:
            return None
        if UsdShade.Output.IsOutput(attribute):
            shader = UsdShade.Shader(attribute.GetPrim())
            if shader:
                value = self._pattern(shader, UsdShade.Output(attribute).GetBaseName())
                return value or self._own(port)
        return self._constant_of(attribute)

    def type_of(self, port: UsdShade.Input | None) -> Sdf.ValueTypeName | None:
        """Return the type of what feeds an input; None where nothing does."""
        attribute = self._producer(port)
        return attribute.GetTypeName() if attribute is not None else None

    def numbers(self, port: UsdShade.Input | None, default: Numbers) -> Numbers:
        """Return the numbers of an input that takes no pattern, as many as `default` has."""
        attribute = self._producer(port)
        if attribute is None:
            return default
        if UsdShade.Output.IsOutput(attribute) and UsdShade.Shader(attribute.GetPrim()):
            value = self.read(port)
            numbers = self.constant_value(value) if value else None
            if numbers is None:
                self.remark(f"the pattern connected to {_name(port)} is not rendered")
        else:
            numbers = as_numbers(attribute.Get(self.time))
        numbers = tuple(numbers or ())
        return (*numbers, *default[len(numbers) :])[: len(default)]

    def text(self, port: UsdShade.Input | None, default: str) -> str:
        """Return the token or string of an input."""
        attribute = self._producer(port)
        value = attribute.Get(self.time) if attribute is not None else None
        return str(value) if isinstance(value, str) else default

    def constant(self, numbers: Sequence[float]) -> Value:
        """Return a constant of one to four numbers."""
        node = self._add({"type": "constant", "value": _padded(numbers)})
        return Value(node, "r" if len(numbers) == 1 else "rgb")

    def primvar(self, name: str, fallback: Sequence[float], width: int) -> Value:
        """Return a primvar of `width` numbers."""
        node = {
            "type": "primvar",
            "name": name.removeprefix("primvars:"),
            "fallback": _padded(fallback),
        }
        return Value(self._add(node), "r" if width == 1 else "rgb")

    def transform2d(
        self, value: Value, scale: Numbers, rotation_degrees: float, translation: Numbers
    ) -> Value:
        """Return texture coordinates scaled, then rotated, then translated."""
        if (scale, rotation_degrees, translation) == ((1.0, 1.0), 0.0, (0.0, 0.0)):
            return value
        node = {
            "type": "transform2d",
            "input": value.node,
            "scale": list(scale),
            "rotation_degrees": rotation_degrees,
            "translation": list(translation),
        }
        return Value(self._add(node), "rgb")

    def texture(
        self,
        file: UsdShade.Input | None,
        st: Value,
        wraps: tuple[str, str],
        color_space: str,
        fallback: Numbers = (0.0, 0.0, 0.0, 1.0),
        scale: Numbers = (1.0, 1.0, 1.0, 1.0),
        bias: Numbers = (0.0, 0.0, 0.0, 0.0),
    ) -> int:
        """Return the node of a texture lookup; its fallback where there is no image."""
        attribute = self._producer(file)
        index = None
        if attribute is not None:
            index = self.textures.index_of_attribute(attribute, color_space)
        if index is None:
            self.remark("a texture names no file")
        if index is None or self.textures.is_missing(index):
            # Storm applies scale and bias to the fallback too.
            finished = (f * s + b for f, s, b in zip(fallback, scale, bias, strict=True))
            return self.constant(tuple(finished)).node
        authored = self.textures.wraps(index)
        wrap_s, wrap_t = (self._wrap(w, a) for w, a in zip(wraps, authored, strict=True))
        return self._add(
            {
                "type": "uv_texture",
                "texture": index,
                "st": st.node,
                "wrap_s": wrap_s,
                "wrap_t": wrap_t,
                "scale": list(scale),
                "bias": list(bias),
                "fallback": list(fallback),
            }
        )

    def scaled(self, value: Value, factor: Numbers, offset: Numbers = (0.0,) * 4) -> Value:
        """Return `value * factor + offset`, where it is a constant or a texture."""
        if (factor, offset) == ((1.0,) * 4, (0.0,) * 4):
            return value
        node = dict(self._nodes[value.node])
        match node["type"]:
            case "constant":
                node["value"] = _affine(node["value"], factor, offset)
            case "uv_texture":
                node["scale"] = _affine(node["scale"], factor, (0.0,) * 4)
                node["bias"] = _affine(node["bias"], factor, offset)
            case _:
                self.remark("a factor on a primvar is not rendered")
                return value
        return Value(self._add(node), value.channel)

    def color_space_of(self, file: UsdShade.Input | None) -> str:
        """Return the colour space in an asset input's metadata; empty where there is none."""
        attribute = self._producer(file)
        return str(attribute.GetColorSpace()) if attribute is not None else ""

    def constant_value(self, value: Value) -> list[float] | None:
        """Return the four numbers of a constant."""
        node = self._nodes[value.node]
        return node["value"] if node["type"] == "constant" else None

    def _producer(self, port: UsdShade.Input | None) -> Usd.Attribute | None:
        """Follow an input through node graphs and interfaces to what gives its value."""
        if not port:
            return None
        attributes = port.GetValueProducingAttributes()
        if len(attributes) > 1:
            self.remark(f"only the first connection of {_name(port)} is rendered")
        return attributes[0] if attributes else None

    def _own(self, port: UsdShade.Input | None) -> Value | None:
        """Return the value authored on an input besides its connection."""
        return self._constant_of(port.GetAttr()) if port else None

    def _constant_of(self, attribute: Usd.Attribute) -> Value | None:
        numbers = as_numbers(attribute.Get(self.time))
        return None if numbers is None else self.constant(numbers)

    def _pattern(self, shader: UsdShade.Shader, output: str) -> Value | None:
        key = (shader.GetPath(), output)
        if key not in self._values:
            # Seen by a network that leads back here.
            self._values[key] = None
            self._values[key] = self._translate(shader, output)
        return self._values[key]

    def _translate(self, shader: UsdShade.Shader, output: str) -> Value | None:
        name = str(shader.GetShaderId() or "")
        pattern = self._patterns.get(name)
        if pattern is None:
            what = f"pattern shader {name}" if name else "a pattern shader without info:id"
            self.remark(f"{what} is not rendered")
            return None
        return pattern(self, shader, output)

    def _wrap(self, authored: str, metadata: str | None) -> str:
        if authored == "useMetadata":
            return metadata or "black"
        if authored not in _WRAPS:
            self.remark(f"wrap mode {authored} is unknown: black")
        return _WRAPS.get(authored, "black")

    def _add(self, node: dict[str, Any]) -> int:
        key = repr(node)
        if key not in self._indices:
            self._indices[key] = len(self._nodes)
            self._nodes.append(node)
        return self._indices[key]


def as_numbers(value: Any) -> Numbers | None:
    """Return a value as one to four numbers; None where it is of another kind or not finite."""
    if isinstance(value, bool | int | float):
        return _finite((float(value),))
    if isinstance(value, str) or not hasattr(value, "__len__"):
        return None
    if not 1 <= len(value) <= 4 or isinstance(value, Gf.Matrix2d | Gf.Matrix3d | Gf.Matrix4d):
        return None
    return _finite(float(v) for v in value)


def _finite(numbers: Iterable[float]) -> Numbers | None:
    numbers = tuple(numbers)
    return numbers if all(abs(n) <= _MAX_F32 for n in numbers) else None


def _uv_texture(network: Network, shader: UsdShade.Shader, output: str) -> Value | None:
    is_materialx = str(shader.GetShaderId()).startswith("ND_")
    wrap = "periodic" if is_materialx else "useMetadata"
    st = network.read(shader.GetInput("st"))
    if st is None:
        st = network.primvar("st", (0.0, 0.0), 2) if is_materialx else None
    if st is None:
        st = network.constant((0.0, 0.0))
    node = network.texture(
        shader.GetInput("file"),
        st,
        (
            network.text(shader.GetInput("wrapS"), wrap),
            network.text(shader.GetInput("wrapT"), wrap),
        ),
        network.text(shader.GetInput("sourceColorSpace"), "auto"),
        network.numbers(shader.GetInput("fallback"), (0.0, 0.0, 0.0, 1.0)),
        network.numbers(shader.GetInput("scale"), (1.0, 1.0, 1.0, 1.0)),
        network.numbers(shader.GetInput("bias"), (0.0, 0.0, 0.0, 0.0)),
    )
    return Value(node, output if output in ("r", "g", "b", "a") else "rgb")


def _transform2d(network: Network, shader: UsdShade.Shader, output: str) -> Value | None:
    value = network.read(shader.GetInput("in")) or network.constant((0.0, 0.0))
    (rotation_degrees,) = network.numbers(shader.GetInput("rotation"), (0.0,))
    scale = network.numbers(shader.GetInput("scale"), (1.0, 1.0))
    translation = network.numbers(shader.GetInput("translation"), (0.0, 0.0))
    return network.transform2d(value, scale, rotation_degrees, translation)


def _primvar_reader(network: Network, shader: UsdShade.Shader, output: str) -> Value | None:
    name = str(shader.GetShaderId()).removeprefix("ND_")
    kind = name.removeprefix(_READER)
    width = _READER_WIDTHS.get(kind)
    if width is None:
        network.remark(f"{name} is not rendered")
        return None
    fallback = network.numbers(shader.GetInput("fallback"), (0.0,) * width)
    varname = network.text(shader.GetInput("varname"), "")
    if not varname:
        network.remark(f"{name} names no primvar")
        return network.constant(fallback)
    return network.primvar(varname, fallback, width)


PATTERNS: dict[str, Pattern] = {
    "UsdUVTexture": _uv_texture,
    "UsdTransform2d": _transform2d,
    **{f"{_READER}{kind}": _primvar_reader for kind in (*_READER_WIDTHS, "string", "matrix")},
}
"""Of the UsdPreviewSurface specification, by shader id."""


def _name(port: UsdShade.Input | None) -> str:
    return str(port.GetFullName()) if port else ""


def _padded(numbers: Sequence[float]) -> list[float]:
    return [float(n) for n in (*numbers, *(0.0, 0.0, 0.0, 1.0)[len(numbers) :])][:4]


def _affine(values: Sequence[float], factor: Numbers, offset: Numbers) -> list[float]:
    return [v * f + o for v, f, o in zip(values, factor, offset, strict=True)]
