import json
import math
import os
from pathlib import Path
from types import SimpleNamespace

import pytest
from kilauea import payload
from kilauea.usd import lights, textures
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

ASSETS = Path(
    os.environ.get("KILAUEA_ASSETS", Path(__file__).parents[2].parent / "shared" / "assets")
)


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv(textures.CACHE_VARIABLE, str(tmp_path / "cache"))


@pytest.fixture
def stage():
    return Usd.Stage.CreateInMemory()


def light_table(frame, time=1.0):
    options = SimpleNamespace(time=Usd.TimeCode(time))
    return lights.LightTable(frame, options, textures.TextureTable(frame, options))


def translate(prim, matrix=None, time=1.0):
    frame = payload.Frame(stage="", time=time)
    table = light_table(frame, time)
    table.add(prim, matrix or Gf.Matrix4d(1))
    assert not frame.lights
    table.finish()
    for record in frame.lights:
        check_record(record)
    return frame


def only(frame):
    (record,) = frame.lights
    return record


def check_record(record):
    json.dumps(record, allow_nan=False)
    assert set(record) == {
        "path",
        "shape",
        "world_from_light",
        "radiance",
        "texture",
        "diffuse",
        "specular",
        "shaping",
        "visible_to_camera",
    }
    fields = {
        "rect": {"width", "height"},
        "disk": {"radius"},
        "sphere": {"radius"},
        "cylinder": {"radius", "length"},
        "distant": {"angle_degrees"},
        "dome": set(),
    }
    assert set(record["shape"]) == fields[record["shape"]["type"]] | {"type"}
    assert len(record["world_from_light"]) == 16
    assert len(record["radiance"]) == 3


def scaled(x, y, z):
    return Gf.Matrix4d().SetScale(Gf.Vec3d(x, y, z)) * Gf.Matrix4d().SetTranslate((5, 6, 7))


@pytest.mark.parametrize(
    ("schema", "shape"),
    [
        (UsdLux.RectLight, {"type": "rect", "width": 1, "height": 1}),
        (UsdLux.DiskLight, {"type": "disk", "radius": 0.5}),
        (UsdLux.SphereLight, {"type": "sphere", "radius": 0.5}),
        (UsdLux.CylinderLight, {"type": "cylinder", "radius": 0.5, "length": 1}),
        (UsdLux.DistantLight, {"type": "distant", "angle_degrees": pytest.approx(0.53)}),
        (UsdLux.DomeLight, {"type": "dome"}),
        (UsdLux.DomeLight_1, {"type": "dome"}),
    ],
)
def test_defaults(stage, schema, shape):
    frame = translate(schema.Define(stage, "/light").GetPrim())
    record = only(frame)
    assert record["shape"] == shape
    assert record["path"] == "/light"
    intensity = 50000.0 if schema is UsdLux.DistantLight else 1.0
    assert record["radiance"] == [intensity] * 3
    assert (record["diffuse"], record["specular"]) == (1.0, 1.0)
    assert (record["texture"], record["shaping"]) == (None, None)
    assert record["visible_to_camera"]
    assert not frame.warnings
    assert not frame.missing


def test_emission(stage):
    light = UsdLux.SphereLight.Define(stage, "/light")
    light.CreateColorAttr((1, 0.5, 0.25))
    light.CreateIntensityAttr().Set(2.0, 1.0)
    light.CreateIntensityAttr().Set(20.0, 2.0)
    light.CreateExposureAttr(3.0)
    light.CreateDiffuseAttr(0.5)
    light.CreateSpecularAttr(0.25)
    record = only(translate(light.GetPrim()))
    assert record["radiance"] == [16, 8, 4]
    assert (record["diffuse"], record["specular"]) == (0.5, 0.25)
    assert only(translate(light.GetPrim(), time=2.0))["radiance"] == [160, 80, 40]

    light.CreateEnableColorTemperatureAttr(True)
    light.CreateColorTemperatureAttr(3000)
    warm = only(translate(light.GetPrim()))["radiance"]
    assert warm == pytest.approx([16 * 1.77103, 8 * 0.844294, 4 * 0.272032], rel=1e-4)
    light.CreateColorTemperatureAttr(1000)
    assert min(only(translate(light.GetPrim()))["radiance"]) >= 0.0


def test_black_and_infinite_lights_are_left_out(stage):
    light = UsdLux.SphereLight.Define(stage, "/light")
    light.CreateIntensityAttr(0)
    frame = translate(light.GetPrim())
    assert (frame.lights, frame.warnings) == ([], [])
    light.CreateIntensityAttr(1)
    light.CreateExposureAttr(float("inf"))
    frame = translate(light.GetPrim())
    assert not frame.lights
    assert frame.warnings
    light.CreateExposureAttr(5000)
    assert not translate(light.GetPrim()).lights
    light.CreateExposureAttr(0)
    light.CreateRadiusAttr(float("nan"))
    assert not translate(light.GetPrim()).lights


@pytest.mark.parametrize(
    ("schema", "sizes", "scale", "area"),
    [
        (UsdLux.RectLight, {"width": 2, "height": 3}, (1, 1, 1), 6),
        (UsdLux.RectLight, {"width": 2, "height": 3}, (2, 5, 7), 60),
        (UsdLux.RectLight, {"width": 2, "height": 3}, (-2, 5, 7), 60),
        (UsdLux.DiskLight, {"radius": 2}, (1, 1, 1), 4 * math.pi),
        (UsdLux.DiskLight, {"radius": 2}, (3, 0.5, 9), 6 * math.pi),
        (UsdLux.SphereLight, {"radius": 2}, (1, 1, 1), 16 * math.pi),
        (UsdLux.SphereLight, {"radius": 2}, (3, 3, 3), 144 * math.pi),
        # Oblate spheroid of axes 2, 2, 1: exactly 34.687; Thomsen is within 1.4 %.
        (UsdLux.SphereLight, {"radius": 1}, (2, 2, 1), pytest.approx(34.687, rel=0.014)),
        (UsdLux.CylinderLight, {"radius": 2, "length": 3}, (1, 1, 1), 12 * math.pi),
        (UsdLux.CylinderLight, {"radius": 2, "length": 3}, (5, 1, 1), 60 * math.pi),
        # Ellipse of axes 2 and 1: circumference 9.688448.
        (UsdLux.CylinderLight, {"radius": 1, "length": 3}, (1, 2, 1), 3 * 9.688448),
    ],
)
def test_normalize_divides_by_world_area(stage, schema, sizes, scale, area):
    light = schema.Define(stage, "/light")
    light.CreateNormalizeAttr(True)
    light.CreateIntensityAttr(10)
    for name, value in sizes.items():
        light.GetPrim().GetAttribute(f"inputs:{name}").Set(value)
    record = only(translate(light.GetPrim(), scaled(*scale)))
    found = 10 / record["radiance"][0]
    assert found == (area if not isinstance(area, float | int) else pytest.approx(area, rel=1e-5))
    light.CreateNormalizeAttr(False)
    assert only(translate(light.GetPrim(), scaled(*scale)))["radiance"] == [10] * 3


@pytest.mark.parametrize(
    ("angle", "factor"),
    [
        (0, 1.0),
        (60, math.pi / 4),
        (180, math.pi),
        (270, math.pi * 1.5),
        (360, 2 * math.pi),
        (400, 2 * math.pi),
    ],
)
def test_normalized_distant_lights_are_in_lux(stage, angle, factor):
    light = UsdLux.DistantLight.Define(stage, "/light")
    light.CreateIntensityAttr(3)
    light.CreateAngleAttr(angle)
    light.CreateNormalizeAttr(True)
    record = only(translate(light.GetPrim()))
    assert record["radiance"][0] == pytest.approx(3 / factor)
    assert record["shape"]["angle_degrees"] == angle


def test_domes_ignore_normalize(stage):
    light = UsdLux.DomeLight.Define(stage, "/light")
    light.CreateNormalizeAttr(True)
    assert only(translate(light.GetPrim(), scaled(3, 3, 3)))["radiance"] == [1] * 3


def test_radius_zero_keeps_its_power(stage):
    light = UsdLux.SphereLight.Define(stage, "/light")
    light.CreateRadiusAttr(0)
    light.CreateNormalizeAttr(True)
    record = only(translate(light.GetPrim(), scaled(2, 2, 2)))
    radius = 2 * record["shape"]["radius"]
    assert radius > 0
    assert record["radiance"][0] * 4 * math.pi * radius**2 == pytest.approx(1.0)


def test_flat_lights_are_reported(stage):
    light = UsdLux.RectLight.Define(stage, "/light")
    light.CreateWidthAttr(0)
    light.CreateNormalizeAttr(True)
    frame = translate(light.GetPrim())
    assert not frame.lights
    assert "no area" in frame.warnings[0]


def test_transform_is_column_vectors(stage):
    light = UsdLux.RectLight.Define(stage, "/light").GetPrim()
    matrix = Gf.Matrix4d().SetTranslate((5, 6, 7))
    assert only(translate(light, matrix))["world_from_light"][12:15] == [5, 6, 7]


def transform(record, direction):
    """Apply the record's matrix, columns one after the other."""
    m = record["world_from_light"]
    return [
        pytest.approx(sum(m[4 * k + i] * direction[k] for k in range(3)), abs=1e-9)
        for i in range(3)
    ]


@pytest.mark.parametrize(
    ("up_axis", "pole_axis", "pole", "centre"),
    [
        ("Y", "scene", (0, 1, 0), (0, 0, 1)),
        ("Z", "scene", (0, 0, 1), (0, -1, 0)),
        ("Y", "Z", (0, 0, 1), (0, -1, 0)),
        ("Z", "Y", (0, 1, 0), (0, 0, 1)),
    ],
)
def test_pole_axis(stage, up_axis, pole_axis, pole, centre):
    UsdGeom.SetStageUpAxis(stage, up_axis)
    light = UsdLux.DomeLight_1.Define(stage, "/light")
    light.CreatePoleAxisAttr(pole_axis)
    record = only(translate(light.GetPrim()))
    assert transform(record, (0, 1, 0)) == list(pole)
    assert transform(record, (0, 0, 1)) == list(centre)
    plain = UsdLux.DomeLight.Define(stage, "/plain")
    assert transform(only(translate(plain.GetPrim())), (0, 1, 0)) == [0, 1, 0]


def test_shaping_only_where_applied(stage):
    light = UsdLux.SphereLight.Define(stage, "/light").GetPrim()
    light.CreateAttribute("inputs:shaping:cone:angle", Sdf.ValueTypeNames.Float).Set(30.0)
    assert only(translate(light))["shaping"] is None
    shaping = UsdLux.ShapingAPI.Apply(light)
    shaping.CreateShapingConeSoftnessAttr(0.5)
    shaping.CreateShapingFocusAttr(4)
    shaping.CreateShapingFocusTintAttr((0.25, 0, 0))
    assert only(translate(light))["shaping"] == {
        "cone_angle_degrees": 30,
        "cone_softness": 0.5,
        "focus": 4,
        "focus_tint": [0.25, 0, 0],
    }
    light.GetAttribute("inputs:shaping:cone:angle").Set(180.0)
    light.GetAttribute("inputs:shaping:focus").Set(0.0)
    assert only(translate(light))["shaping"] is None


def test_what_is_not_rendered_is_said(stage):
    light = UsdLux.SphereLight.Define(stage, "/light")
    prim = light.GetPrim()
    UsdLux.ShapingAPI.Apply(prim).CreateShapingIesFileAttr("a.ies")
    UsdLux.ShadowAPI.Apply(prim).CreateShadowEnableAttr(False)
    UsdLux.LightAPI(prim).GetLightLinkCollectionAPI().CreateExcludesRel().SetTargets(["/a"])
    UsdLux.LightAPI(prim).GetShadowLinkCollectionAPI().CreateIncludeRootAttr(False)
    UsdLux.LightAPI(prim).CreateFiltersRel().SetTargets(["/filter"])
    light.CreateTreatAsPointAttr(True)
    frame = translate(prim)
    assert len(frame.lights) == 1
    warnings = "\n".join(frame.warnings)
    for part in ("IES", "shadow:enable", "light linking", "shadow linking", "filters", "treatAs"):
        assert part in warnings
    assert len(frame.warnings) == 6


def test_trivial_links_and_shadows_are_fine(stage):
    prim = UsdLux.SphereLight.Define(stage, "/light").GetPrim()
    UsdLux.ShadowAPI.Apply(prim).CreateShadowEnableAttr(True)
    UsdLux.LightAPI(prim).GetLightLinkCollectionAPI().CreateIncludesRel().SetTargets(["/a"])
    assert not translate(prim).warnings


@pytest.mark.parametrize("kind", ["PortalLight", "GeometryLight", "PluginLight", "Mesh"])
def test_other_lights_are_reported(stage, kind):
    prim = stage.DefinePrim("/light", kind)
    if kind == "Mesh":
        UsdLux.MeshLightAPI.Apply(prim)
    frame = translate(prim)
    assert not frame.lights
    assert kind in frame.warnings[0]


def test_missing_texture(stage):
    light = UsdLux.DomeLight.Define(stage, "/light")
    light.CreateTextureFileAttr("gone.exr")
    light.CreateTextureFormatAttr("angular")
    frame = translate(light.GetPrim())
    assert only(frame)["texture"] is None
    assert "gone.exr" in frame.missing[0]
    assert "angular" in frame.warnings[0]


def test_old_attribute_names(stage):
    prim = UsdLux.RectLight.Define(stage, "/light").GetPrim()
    prim.CreateAttribute("intensity", Sdf.ValueTypeNames.Float).Set(7.0)
    frame = translate(prim)
    assert only(frame)["radiance"] == [7] * 3
    assert frame.warnings


def test_copies_share_a_warning_line(stage):
    prim = UsdLux.PortalLight.Define(stage, "/light").GetPrim()
    frame = payload.Frame(stage="", time=1.0)
    table = light_table(frame)
    for _ in range(3):
        table.add(prim, Gf.Matrix4d(1))
    assert frame.warnings == ["/light: PortalLight lights are not rendered"]


def stages():
    found = [
        str(path.relative_to(ASSETS))
        for folder in ("11_udim", "13_usdlux", "14_previewsurface")
        for path in sorted((ASSETS / folder).rglob("*.usd*"))
    ]
    reason = f"no asset stages in {ASSETS}"
    return found or [pytest.param("", marks=pytest.mark.skip(reason=reason))]


@pytest.mark.parametrize("name", stages())
def test_lights_of_asset_stages(name):
    stage = Usd.Stage.Open(str(ASSETS / name))
    frame = payload.Frame(stage=name, time=1.0)
    table = light_table(frame)
    n_lights = 0
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if prim.HasAPI(UsdLux.LightAPI):
            table.add(prim, UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(1.0))
            n_lights += 1
    table.finish()
    for record in frame.lights:
        check_record(record)
    assert len(frame.lights) == n_lights
    assert not frame.missing
