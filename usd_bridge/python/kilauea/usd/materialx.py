"""MaterialX nodes in USD: those that UsdPreviewSurface can stand in for.

The nodes of MaterialX's own UsdPreviewSurface library mean the same as USD's. Standard Surface and
OpenPBR are approximated by the part that UsdPreviewSurface has as well.
"""

from __future__ import annotations

from dataclasses import dataclass

from pxr import UsdShade

from kilauea.usd import networks
from kilauea.usd.networks import Network, Numbers, Pattern, Value

_ONES = (1.0, 1.0, 1.0, 1.0)
_TYPES = ("float", "color3", "color4", "vector2", "vector3", "vector4")
_CHANNELS = {"x": "r", "y": "g", "z": "b", "w": "a"}


@dataclass(frozen=True, slots=True)
class _Model:
    """Names and defaults of the inputs that are rendered."""

    base: str
    base_color: str
    metallic: str
    roughness: str
    default_roughness: float
    ior: str
    coat: str
    coat_roughness: str
    default_coat_roughness: float
    emission: str
    emission_color: str
    transmission: str
    opacity: str
    normal: str


_STANDARD_SURFACE = _Model(
    base="base",
    base_color="base_color",
    metallic="metalness",
    roughness="specular_roughness",
    default_roughness=0.2,
    ior="specular_IOR",
    coat="coat",
    coat_roughness="coat_roughness",
    default_coat_roughness=0.1,
    emission="emission",
    emission_color="emission_color",
    transmission="transmission",
    opacity="opacity",
    normal="normal",
)
_OPEN_PBR = _Model(
    base="base_weight",
    base_color="base_color",
    metallic="base_metalness",
    roughness="specular_roughness",
    default_roughness=0.3,
    ior="specular_ior",
    coat="coat_weight",
    coat_roughness="coat_roughness",
    default_coat_roughness=0.0,
    emission="emission_luminance",
    emission_color="emission_color",
    transmission="transmission_weight",
    opacity="geometry_opacity",
    normal="geometry_normal",
)


def standard_surface(network: Network, shader: UsdShade.Shader) -> dict[str, Value]:
    """Return the UsdPreviewSurface inputs nearest to a Standard Surface."""
    return _approximate(network, shader, _STANDARD_SURFACE)


def open_pbr(network: Network, shader: UsdShade.Shader) -> dict[str, Value]:
    """Return the UsdPreviewSurface inputs nearest to an OpenPBR surface."""
    return _approximate(network, shader, _OPEN_PBR)


def _approximate(network: Network, shader: UsdShade.Shader, model: _Model) -> dict[str, Value]:
    def value(name: str, *default: float) -> Value:
        return network.read(shader.GetInput(name)) or network.constant(default)

    def number(name: str, default: float) -> float:
        return network.numbers(shader.GetInput(name), (default,))[0]

    def weighted(color: Value, weight: float) -> Value:
        return network.scaled(color, (weight, weight, weight, 1.0))

    network.remark(f"{shader.GetShaderId()} is approximated by UsdPreviewSurface")
    inputs = {
        "diffuseColor": weighted(value(model.base_color, 0.8, 0.8, 0.8), number(model.base, 1.0)),
        "metallic": value(model.metallic, 0.0),
        "roughness": value(model.roughness, model.default_roughness),
        "ior": value(model.ior, 1.5),
        "clearcoat": value(model.coat, 0.0),
        "clearcoatRoughness": value(model.coat_roughness, model.default_coat_roughness),
    }
    emission = number(model.emission, 0.0)
    if emission > 0.0:
        inputs["emissiveColor"] = weighted(value(model.emission_color, 1.0, 1.0, 1.0), emission)
    inputs.update(_opacity(network, shader, model, number(model.transmission, 0.0)))
    normal = network.read(shader.GetInput(model.normal))
    if normal:
        inputs["normal"] = normal
    return inputs


def _opacity(
    network: Network, shader: UsdShade.Shader, model: _Model, transmission: float
) -> dict[str, Value]:
    """Transmission becomes transparency; without it, opacity is presence."""
    opacity = network.read(shader.GetInput(model.opacity))
    if transmission > 0.0:
        if opacity:
            network.remark(f"{model.opacity} besides transmission is not rendered")
        return {"opacity": network.constant((1.0 - transmission,))}
    if not opacity:
        return {}
    channel = "r" if opacity.channel == "rgb" else opacity.channel
    return {"opacity": Value(opacity.node, channel), "opacityMode": network.constant((1.0,))}


def _type_of(shader: UsdShade.Shader) -> str:
    return str(shader.GetShaderId()).rsplit("_", 1)[-1]


def _channel(kind: str) -> str:
    return "r" if kind in ("float", "integer") else "rgb"


def _st(network: Network, port: UsdShade.Input | None) -> Value:
    return network.read(port) or network.primvar("st", (0.0, 0.0), 2)


def _image(network: Network, shader: UsdShade.Shader, output: str) -> Value | None:
    kind = _type_of(shader)
    st = _st(network, shader.GetInput("texcoord"))
    if "tiledimage" in str(shader.GetShaderId()):
        scale = network.numbers(shader.GetInput("uvtiling"), (1.0, 1.0))
        u, v = network.numbers(shader.GetInput("uvoffset"), (0.0, 0.0))
        st = network.transform2d(st, scale, 0.0, (-u, -v))
    file = shader.GetInput("file")
    authored = network.color_space_of(file)
    if authored:
        color_space = "sRGB" if "srgb" in authored.lower() else "raw"
    else:
        color_space = "auto" if kind.startswith("color") else "raw"
    default = network.numbers(shader.GetInput("default"), (0.0, 0.0, 0.0, 1.0))
    wraps = [network.text(shader.GetInput(f"{axis}addressmode"), "periodic") for axis in "uv"]
    node = network.texture(file, st, (wraps[0], wraps[1]), color_space, default)
    return Value(node, _channel(kind))


def _normal_map(network: Network, shader: UsdShade.Shader, output: str) -> Value | None:
    value = network.read(shader.GetInput("in"))
    if value is None:
        return None
    (strength,) = network.numbers(shader.GetInput("scale"), (1.0,))
    factor = (2.0 * strength, 2.0 * strength, 2.0, 1.0)
    return network.scaled(value, factor, (-strength, -strength, -1.0, 0.0))


def _texcoord(network: Network, shader: UsdShade.Shader, output: str) -> Value | None:
    (index,) = network.numbers(shader.GetInput("index"), (0.0,))
    return network.primvar(f"st{int(index)}" if index else "st", (0.0, 0.0), 2)


def _geomprop(network: Network, shader: UsdShade.Shader, output: str) -> Value | None:
    name = network.text(shader.GetInput("geomprop"), "st")
    width = {"float": 1, "integer": 1, "vector2": 2}.get(_type_of(shader), 3)
    default = network.numbers(shader.GetInput("default"), (0.0,) * width)
    # MaterialX documents call the first texture coordinates UV0, USD calls them st.
    return network.primvar("st" if name == "UV0" else name, default, width)


def _constant(network: Network, shader: UsdShade.Shader, output: str) -> Value | None:
    return network.read(shader.GetInput("value"))


def _pass_through(network: Network, shader: UsdShade.Shader, output: str) -> Value | None:
    value = network.read(shader.GetInput("in"))
    if value and value.channel == "rgb" and str(shader.GetShaderId()).endswith("_float"):
        return Value(value.node, "r")
    return value


def _multiply(network: Network, shader: UsdShade.Shader, output: str) -> Value | None:
    a = network.read(shader.GetInput("in1"))
    b = network.read(shader.GetInput("in2"))
    if a is None or b is None:
        return a or b
    for value, other in ((a, b), (b, a)):
        factor = network.constant_value(value)
        if factor is not None:
            return network.scaled(other, _factor(factor, value.channel))
    network.remark("a product of two patterns is not rendered: the first alone is")
    return a


def _factor(numbers: list[float], channel: str) -> Numbers:
    if channel == "rgb":
        return tuple(numbers)
    return (numbers["rgba".index(channel)],) * 3 + (1.0,)


def _extract(network: Network, shader: UsdShade.Shader, output: str) -> Value | None:
    value = network.read(shader.GetInput("in"))
    (index,) = network.numbers(shader.GetInput("index"), (0.0,))
    return value and Value(value.node, "rgba"[min(max(int(index), 0), 3)])


def _separate(network: Network, shader: UsdShade.Shader, output: str) -> Value | None:
    value = network.read(shader.GetInput("in"))
    channel = output.removeprefix("out")
    return value and Value(value.node, _CHANNELS.get(channel, channel) or "r")


def _for_types(name: str, pattern: Pattern) -> dict[str, Pattern]:
    return {f"ND_{name}_{kind}": pattern for kind in (*_TYPES, "integer")}


PATTERNS: dict[str, Pattern] = {
    **{
        f"ND_{name}{version}": pattern
        for name, pattern in networks.PATTERNS.items()
        for version in ("", "_22", "_23")
    },
    **_for_types("image", _image),
    **_for_types("tiledimage", _image),
    **_for_types("constant", _constant),
    **_for_types("dot", _pass_through),
    **_for_types("geompropvalue", _geomprop),
    **_for_types("multiply", _multiply),
    **{f"ND_multiply_{kind}FA": _multiply for kind in _TYPES[1:]},
    **{f"ND_convert_{a}_{b}": _pass_through for a in _TYPES for b in _TYPES},
    **{f"ND_extract_{kind}": _extract for kind in _TYPES[1:]},
    **{f"ND_separate{kind[-1]}_{kind}": _separate for kind in _TYPES[1:]},
    "ND_normalmap": _normal_map,
    "ND_normalmap_float": _normal_map,
    "ND_texcoord_vector2": _texcoord,
}
"""By shader id."""
