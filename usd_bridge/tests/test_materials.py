import json
import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import OpenImageIO as oiio
import pytest
from kilauea import payload
from kilauea.errors import KilaueaError
from kilauea.usd import declared, materials, textures
from pxr import Usd, UsdShade

ASSETS = Path(
    os.environ.get("KILAUEA_ASSETS", Path(__file__).parents[2].parent / "shared" / "assets")
)
FOLDERS = ("11_udim", "13_usdlux", "14_previewsurface", "15_materialx")


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv(textures.CACHE_VARIABLE, str(tmp_path / "cache"))


@pytest.fixture
def image(tmp_path):
    spec = oiio.ImageSpec(2, 2, 3, "uint8")
    spec.attribute("wrapmodes", "mirror,clamp")
    output = oiio.ImageOutput.create(str(tmp_path / "a.tif"))
    output.open(str(tmp_path / "a.tif"), spec)
    output.write_image(np.zeros((2, 2, 3), np.uint8))
    output.close()


def tables(frame, time=1.0):
    options = SimpleNamespace(time=Usd.TimeCode(time))
    images = textures.TextureTable(frame, options)
    return materials.MaterialTable(frame, options, images), images


class Translated:
    """A stage's /M as the engine gets it."""

    def __init__(self, tmp_path, body, time=1.0):
        # A name of its own: layers are kept by name. Prims end on a line of their own.
        file = tmp_path / f"{len(list(tmp_path.iterdir()))}.usda"
        file.write_text(f"#usda 1.0\n{body}".replace(" }", "\n}"))
        self.stage = Usd.Stage.Open(str(file))
        self.frame = payload.Frame(stage="s.usda", time=time)
        self.table, self.textures = tables(self.frame, time)
        self.index = self.table.index(UsdShade.Material.Get(self.stage, "/M"), False, False)
        self.record = self.frame.materials[self.index]
        self.textures.finish()
        check_record(self.record, self.frame)

    def __getitem__(self, name):
        port = self.record["inputs"][name]
        return self.record["nodes"][port["node"]], port["channel"]

    def constant(self, name):
        node, channel = self[name]
        assert node["type"] == "constant", node
        return node["value"][0] if channel == "r" else node["value"][:3]


def check_record(record, frame):
    """Check what `kilauea_scene` would refuse."""
    json.dumps(record, allow_nan=False)
    fields = {
        "constant": {"value"},
        "primvar": {"name", "fallback"},
        "transform2d": {"input", "scale", "rotation_degrees", "translation"},
        "uv_texture": {"texture", "st", "wrap_s", "wrap_t", "scale", "bias", "fallback"},
    }
    assert set(record) == {"path", "shader", "inputs", "nodes"}
    for port in record["inputs"].values():
        assert port["node"] < len(record["nodes"])
        assert port["channel"] in ("r", "g", "b", "a", "rgb")
    for i, node in enumerate(record["nodes"]):
        assert set(node) == fields[node["type"]] | {"type"}
        assert node.get("st", -1) < i
        assert node.get("input", -1) < i
        assert node.get("texture", -1) < len(frame.textures)
        for key, size in (("value", 4), ("fallback", 4), ("scale", None), ("bias", 4)):
            if key in node and size:
                assert len(node[key]) == size


def preview(inputs, rest=""):
    return f"""
def Material "M" {{
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {{
        uniform token info:id = "UsdPreviewSurface"
        {inputs}
        token outputs:surface
    }}
    {rest}
}}
"""


def test_constants(tmp_path):
    m = Translated(
        tmp_path,
        preview("""
        color3f inputs:diffuseColor = (0.1, 0.2, 0.3)
        int inputs:useSpecularWorkflow = 1
        float inputs:roughness.timeSamples = {1: 0.25, 2: 0.75}
        token inputs:opacityMode = "presence"
        float inputs:opacityThreshold = 0.5
        normal3f inputs:normal = (0, 0, 1)
        float inputs:occlusion = 0.5
        """),
    )
    assert m.record["shader"] == "UsdPreviewSurface"
    assert m.record["path"] == "/M"
    assert m.constant("diffuseColor") == pytest.approx([0.1, 0.2, 0.3])
    assert m.constant("useSpecularWorkflow") == 1.0
    assert m.constant("roughness") == 0.25
    assert m.constant("opacityMode") == 1.0
    assert m.constant("opacityThreshold") == 0.5
    assert set(m.record["inputs"]) == {
        "diffuseColor",
        "useSpecularWorkflow",
        "roughness",
        "opacityMode",
        "opacityThreshold",
    }
    assert not m.frame.warnings
    assert not m.frame.missing
    assert m.table.primvars(m.index) == frozenset()


def test_displacement_is_reported(tmp_path):
    assert Translated(tmp_path, preview("float inputs:displacement = 0.1")).frame.warnings
    assert not Translated(tmp_path, preview("float inputs:displacement = 0")).frame.warnings


TEXTURED = """
    def Shader "T" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./a.tif@
        token inputs:wrapS = "repeat"
        float4 inputs:scale = (2, 2, 2, 1)
        float4 inputs:bias = (-1, -1, -1, 0)
        float2 inputs:st.connect = </M/X.outputs:result>
        float3 outputs:rgb
        float outputs:g
    }
    def Shader "X" {
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </M/R.outputs:result>
        float2 inputs:scale = (2, 3)
        float inputs:rotation = 90
        float2 inputs:translation = (0.5, 0)
        float2 outputs:result
    }
    def Shader "R" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname.connect = </M.inputs:uv>
        float2 inputs:fallback = (0.25, 0.75)
        float2 outputs:result
    }
    token inputs:uv = "map1"
"""


def test_texture_network(tmp_path, image):
    m = Translated(
        tmp_path,
        preview(
            """
            normal3f inputs:normal.connect = </M/T.outputs:rgb>
            float inputs:roughness.connect = </M/T.outputs:g>
            """,
            TEXTURED,
        ),
    )
    assert [node["type"] for node in m.record["nodes"]] == ["primvar", "transform2d", "uv_texture"]
    reader, transform, texture = m.record["nodes"]
    assert (reader["name"], reader["fallback"][:2]) == ("map1", [0.25, 0.75])
    assert (transform["input"], transform["scale"]) == (0, [2, 3])
    assert (transform["rotation_degrees"], transform["translation"]) == (90, [0.5, 0])
    assert (texture["st"], texture["texture"]) == (1, 0)
    assert (texture["scale"], texture["bias"]) == ([2, 2, 2, 1], [-1, -1, -1, 0])
    assert (texture["wrap_s"], texture["wrap_t"]) == ("repeat", "clamp")  # t by metadata
    assert m["normal"] == (texture, "rgb")
    assert m["roughness"] == (texture, "g")
    assert m.table.primvars(m.index) == {"map1"}
    assert len(m.frame.textures) == 1


def test_missing_texture_is_its_scaled_fallback(tmp_path):
    m = Translated(
        tmp_path,
        preview(
            "color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>",
            TEXTURED.replace("a.tif", "gone.tif").replace(
                "token inputs:wrapS", "float4 inputs:fallback = (1, 0.5, 0, 1)\ntoken inputs:wrapS"
            ),
        ),
    )
    assert m.constant("diffuseColor") == [1.0, 0.0, -1.0]
    assert len(m.record["nodes"]) == 1
    assert "gone.tif" in m.frame.missing[0]
    assert "/M/T" in m.frame.missing[0]
    assert m.table.primvars(m.index) == frozenset()


def test_texture_without_file(tmp_path):
    m = Translated(
        tmp_path,
        preview(
            "color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>",
            """def Shader "T" { uniform token info:id = "UsdUVTexture"
            float3 inputs:fallback = (0, 0, 1)
            float3 outputs:rgb }""",
        ),
    )
    assert m.constant("diffuseColor") == [0, 0, 1]
    assert not m.frame.missing
    assert any("no file" in w for w in m.frame.warnings)


def test_interfaces_and_node_graphs(tmp_path):
    m = Translated(
        tmp_path,
        preview(
            """
            color3f inputs:diffuseColor.connect = </M/G.outputs:color>
            float inputs:metallic.connect = </M/G.outputs:shine>
            float inputs:roughness.connect = </M.inputs:rough>
            """,
            """
            float inputs:rough = 0.3
            string inputs:name = "tint"
            def NodeGraph "G" {
                float inputs:shine.connect = </M.inputs:rough>
                float outputs:shine.connect = </M/G.inputs:shine>
                color3f outputs:color.connect = </M/G/R.outputs:result>
                string inputs:name.connect = </M.inputs:name>
                def Shader "R" {
                    uniform token info:id = "UsdPrimvarReader_float3"
                    string inputs:varname.connect = </M/G.inputs:name>
                    float3 outputs:result
                }
            }
            """,
        ),
    )
    assert m["diffuseColor"] == (
        {"type": "primvar", "name": "tint", "fallback": [0.0, 0.0, 0.0, 1.0]},
        "rgb",
    )
    assert m.constant("metallic") == pytest.approx(0.3)
    assert m.constant("roughness") == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("kind", "channel"),
    [
        ("float", "r"),
        ("int", "r"),
        ("float2", "rgb"),
        ("float4", "rgb"),
        ("point", "rgb"),
        ("string", None),
        ("matrix", None),
    ],
)
def test_primvar_readers(tmp_path, kind, channel):
    m = Translated(
        tmp_path,
        preview(
            """float inputs:roughness = 0.125
            float inputs:roughness.connect = </M/R.outputs:result>""",
            f"""def Shader "R" {{
                uniform token info:id = "UsdPrimvarReader_{kind}"
                token inputs:varname = "rough"
                float outputs:result
            }}""",
        ),
    )
    if channel:
        assert m["roughness"][0]["name"] == "rough"
        assert m["roughness"][1] == channel
    else:
        assert m.constant("roughness") == 0.125
        assert kind in m.frame.warnings[0]


def test_a_network_that_feeds_itself_ends(tmp_path):
    m = Translated(
        tmp_path,
        preview(
            "color3f inputs:diffuseColor.connect = </M/X.outputs:result>",
            """def Shader "X" { uniform token info:id = "UsdTransform2d"
            float2 inputs:in.connect = </M/X.outputs:result>
            float2 inputs:scale = (2, 2)
            float2 outputs:result }""",
        ),
    )
    assert m["diffuseColor"][0]["type"] == "transform2d"


@pytest.mark.parametrize(
    "surface",
    [
        "",
        "token outputs:surface.connect = </M/S.outputs:surface>",
        "token outputs:ri:surface.connect = </M/S.outputs:surface>",
    ],
)
def test_unsupported_surfaces_are_grey_and_missing(tmp_path, surface):
    m = Translated(
        tmp_path,
        f"""def Material "M" {{ {surface}
        def Shader "S" {{ uniform token info:id = "PxrSurface"
        token outputs:surface }} }}""",
    )
    assert m.record == {"path": "/M", "shader": "UsdPreviewSurface", "inputs": {}, "nodes": []}
    assert m.frame.missing[0].startswith("/M: no surface shader")


MATERIALX = """
def Material "M" {{
    token outputs:mtlx:surface.connect = </M/S.outputs:out>
    def Shader "S" {{
        uniform token info:id = "{0}"
        {1}
        token outputs:out
    }}
    def Shader "I" {{
        uniform token info:id = "ND_image_color3"
        asset inputs:file = @./a.tif@
        string inputs:uaddressmode = "clamp"
        color3f outputs:out
    }}
    def Shader "N" {{
        uniform token info:id = "ND_normalmap"
        vector3f inputs:in.connect = </M/I.outputs:out>
        vector3f outputs:out
    }}
}}
""".replace("vector3f", "float3")


def test_standard_surface(tmp_path, image):
    body = MATERIALX.format(
        "ND_standard_surface_surfaceshader",
        """
        float inputs:base = 0.5
        color3f inputs:base_color.connect = </M/I.outputs:out>
        float3 inputs:normal.connect = </M/N.outputs:out>
        float inputs:metalness = 0.75
        float inputs:specular_IOR = 1.25
        float inputs:emission = 2
        color3f inputs:emission_color = (1, 0.5, 0)
        float inputs:transmission = 0.75
        """,
    )
    m = Translated(tmp_path, body)
    color, channel = m["diffuseColor"]
    assert (color["scale"], channel) == ([0.5, 0.5, 0.5, 1], "rgb")
    assert (color["wrap_s"], color["wrap_t"]) == ("clamp", "repeat")
    normal, _ = m["normal"]
    assert (normal["scale"], normal["bias"]) == ([2, 2, 2, 1], [-1, -1, -1, 0])
    assert m.record["nodes"][color["st"]]["name"] == "st"
    assert m.constant("metallic") == 0.75
    assert m.constant("roughness") == pytest.approx(0.2)
    assert m.constant("ior") == 1.25
    assert m.constant("emissiveColor") == [2, 1, 0]
    assert m.constant("opacity") == 0.25
    assert m.frame.warnings == [
        "/M: ND_standard_surface_surfaceshader is approximated by UsdPreviewSurface"
    ]


def test_open_pbr_and_materialx_preview_surface(tmp_path):
    m = Translated(
        tmp_path,
        MATERIALX.format(
            "ND_open_pbr_surface_surfaceshader",
            "float inputs:base_metalness = 1\nfloat inputs:geometry_opacity = 0.5",
        ),
    )
    assert m.constant("metallic") == 1
    assert m.constant("roughness") == pytest.approx(0.3)
    assert (m.constant("opacity"), m.constant("opacityMode")) == (0.5, 1)
    m = Translated(
        tmp_path,
        MATERIALX.format("ND_UsdPreviewSurface_surfaceshader", "float inputs:metallic = 1"),
    )
    assert m.constant("metallic") == 1
    assert not m.frame.warnings


def test_the_universal_preview_surface_wins(tmp_path):
    body = preview(
        "float inputs:metallic = 0.5",
        """token outputs:mtlx:surface.connect = </M/X.outputs:out>
        def Shader "X" { uniform token info:id = "ND_standard_surface_surfaceshader"
        token outputs:out }""",
    )
    m = Translated(tmp_path, body)
    assert m.constant("metallic") == 0.5
    assert not m.frame.warnings


def test_unbound_surfaces(tmp_path):
    frame = payload.Frame(stage="", time=0.0)
    table, _ = tables(frame)
    with_color = table.index(None, True, False)
    assert table.index(None, True, False) == with_color
    plain = table.index(None, False, False)
    assert table.primvars(with_color) == {"displayColor"}
    assert table.primvars(table.index(None, True, True)) == {"displayColor", "displayOpacity"}
    assert table.primvars(plain) == frozenset()
    record = frame.materials[plain]
    check_record(record, frame)
    assert record["shader"] == "Matte"
    albedo = record["nodes"][record["inputs"]["albedo"]["node"]]
    assert albedo == {"type": "constant", "value": [0.5, 0.5, 0.5, 1.0]}
    assert len(frame.materials) == 3


def test_shared_remarks_take_one_line(tmp_path):
    body = preview("float inputs:displacement = 1")
    for name in "NOP":
        body += (
            preview("float inputs:displacement = 1")
            .replace('"M"', f'"{name}"')
            .replace("/M/", f"/{name}/")
        )
    m = Translated(tmp_path, body)
    for name in "NOP":
        m.table.index(UsdShade.Material.Get(m.stage, f"/{name}"), False, False)
    assert m.frame.warnings == ["/M: displacement is not rendered (and 3 more)"]


def stages():
    found = [
        str(path.relative_to(ASSETS))
        for folder in FOLDERS
        for path in sorted((ASSETS / folder).rglob("*.usd*"))
    ]
    reason = f"no asset stages in {ASSETS}"
    return found or [pytest.param("", marks=pytest.mark.skip(reason=reason))]


@pytest.mark.parametrize("name", stages())
def test_materials_of_asset_stages(name):
    stage = Usd.Stage.Open(str(ASSETS / name))
    frame = payload.Frame(stage=name, time=1.0)
    table, images = tables(frame)
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if prim.IsA(UsdShade.Material):
            index = table.index(UsdShade.Material(prim), False, False)
            check_record(frame.materials[index], frame)
    images.finish()


def own(shader, inputs, rest=""):
    return preview(inputs, rest).replace('"UsdPreviewSurface"', f'"kilauea:{shader}"')


def test_shaders_of_ours_are_read_as_they_are_declared(tmp_path):
    m = Translated(tmp_path, own("Glass", "color3f inputs:tint = (1, 0.5, 0)"))
    assert m.record["shader"] == "Glass"
    assert m.constant("tint") == [1.0, 0.5, 0.0]
    assert set(m.record["inputs"]) == {"tint"}
    m = Translated(tmp_path, own("Glass", "int inputs:priority = 3"))
    assert m.constant("priority") == 3
    m = Translated(tmp_path, own("Mirror", "double inputs:roughness = 0.25"))
    assert (m.record["shader"], m.constant("roughness")) == ("Mirror", 0.25)
    assert not m.frame.warnings
    assert not m.frame.missing


READER = """
    def Shader "P" {{
        uniform token info:id = "UsdPrimvarReader_{0}"
        string inputs:varname = "tone"
        {0} outputs:result
    }}
"""


def test_shaders_of_ours_take_patterns(tmp_path):
    tint = "color3f inputs:tint.connect = </M/P.outputs:result>"
    m = Translated(tmp_path, own("Mirror", tint, READER.format("float3")))
    node, channel = m["tint"]
    assert (node["type"], node["name"], channel) == ("primvar", "tone", "rgb")
    assert m.table.primvars(m.index) == {"tone"}


def test_shaders_of_ours_take_words(tmp_path, monkeypatch):
    side = {"type": "token", "tokens": ["front", "back"]}
    velvet = {"kilauea:Velvet": {"shader": "Velvet", "inputs": {"side": side}}}
    monkeypatch.setattr(declared, "declarations", lambda: velvet)
    m = Translated(tmp_path, own("Velvet", "token inputs:side = 'back'"))
    assert (m.record["shader"], m.constant("side")) == ("Velvet", 1.0)
    m = Translated(tmp_path, own("Velvet", "token inputs:side = 'edge'"))
    assert not m.record["inputs"]
    assert m.frame.warnings == ["/M: side edge is unknown: front"]


@pytest.mark.parametrize(
    ("shader", "inputs", "found", "expected"),
    [
        ("Matte", "float inputs:albedo = 0.5", "float", "color3f"),
        ("Matte", "string inputs:opacity = 'half'", "string", "float"),
        ("Glass", "color3f inputs:ior = (1, 1, 1)", "color3f", "float"),
        ("Glass", "float inputs:priority = 1", "float", "int"),
        ("Matte", "color3f inputs:albedo.connect = </M/P.outputs:result>", "float", "color3f"),
    ],
)
def test_inputs_of_another_type_are_errors(tmp_path, shader, inputs, found, expected):
    name = inputs.split("inputs:")[1].split(" ")[0].split(".")[0]
    message = f"/M: inputs:{name} of kilauea:{shader} is a {found}; expected a {expected}"
    with pytest.raises(KilaueaError, match=f"^{message}$"):
        Translated(tmp_path, own(shader, inputs, READER.format("float")))


def test_inputs_that_are_not_declared_are_reported(tmp_path):
    m = Translated(tmp_path, own("Matte", "float inputs:sheen = 1"))
    assert m.frame.warnings == ["/M: kilauea:Matte has no input sheen"]


def test_unknown_shaders_of_ours_are_missing(tmp_path):
    m = Translated(tmp_path, own("Velvet", ""))
    assert m.record["shader"] == "UsdPreviewSurface"
    assert "kilauea:Velvet" in m.frame.missing[0]
