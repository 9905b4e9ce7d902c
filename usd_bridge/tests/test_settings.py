from __future__ import annotations

import pytest
from kilauea.errors import UsageError
from kilauea.usd.settings import data_window
from kilauea.usd.stage import FlattenOptions, SourceStage

RENDER = """
def RenderSettings "S" {
    uniform int2 resolution = (300, 200)
    uniform float pixelAspectRatio = 2
    uniform token[] includedPurposes = ["default", "proxy"]
    uniform bool disableMotionBlur = 1
    int kilauea:samplesPerPixel = 9
    rel products = [</S/P>, </S/Q>]
    def RenderProduct "P" {
        uniform int2 resolution = (30, 20)
        token productName = "picture.$F4.exr"
        rel orderedVars = [</S/Color>, </S/Depth>, </S/Deep>]
    }
    def RenderProduct "Q" { token productName = "other.exr" }
    def RenderVar "Color" { uniform string sourceName = "Ci" }
    def RenderVar "Depth" {
        uniform string sourceName = "unheard_of"
        custom string driver:parameters:aov:name = "depth"
    }
    def RenderVar "Deep" { uniform string sourceName = "vexing" }
}
def Sphere "Proxy" { uniform token purpose = "proxy" }
def Sphere "Render" { uniform token purpose = "render" }
"""


def test_product_overrides_what_it_authors(flatten):
    frame = flatten(RENDER, header='renderSettingsPrimPath = "/S"')
    assert frame.settings["resolution"] == [30, 20]
    assert frame.settings["pixel_aspect_ratio"] == 2
    assert frame.settings["samples_per_pixel"] == 9
    assert frame.settings["aovs"] == ["beauty", "Z"]
    assert [s.path for s in frame.implicits] == ["/Proxy"]
    assert any("vexing" in w for w in frame.warnings)
    assert any("/S/Q" in w for w in frame.warnings)


def test_settings_have_to_be_chosen(flatten):
    frame = flatten(RENDER)
    assert frame.settings == {"resolution": [640, 360], "pixel_aspect_ratio": 1}
    assert flatten(RENDER, settings="/S").settings["resolution"] == [30, 20]
    with pytest.raises(UsageError, match="/Proxy"):
        flatten(RENDER, settings="/Proxy")


def test_command_line_stands_over_the_stage(flatten):
    frame = flatten(
        RENDER,
        settings="/S",
        resolution=(80, 40),
        resolution_scale=0.5,
        pixel_aspect_ratio=1.5,
        purposes=frozenset({"render"}),
    )
    assert frame.settings["resolution"] == [40, 20]
    assert frame.settings["pixel_aspect_ratio"] == 1.5
    assert [s.path for s in frame.implicits] == ["/Render"]


def test_image_width_keeps_the_aperture(flatten):
    camera = 'def Camera "C" { float horizontalAperture = 20; float verticalAperture = 10 }'
    assert flatten(camera, image_width=100).settings["resolution"] == [100, 50]


def test_product_name(write_stage):
    stage = SourceStage(str(write_stage(RENDER)))
    assert stage.product_name(FlattenOptions(settings="/S")) == "picture.$F4.exr"
    assert stage.product_name(FlattenOptions()) == ""


@pytest.mark.parametrize("resolution", [(640, 360), (7, 5), (1, 1), (1921, 1079)])
def test_data_window_holds_exactly_the_pixels_whose_centre_is_inside(resolution):
    width, height = resolution
    for ndc in ((0, 0, 1, 1), (0.25, 0.1, 0.75, 0.9), (-0.1, -0.2, 1.1, 1.3), (0.5, 0.5, 0.5, 1)):
        window = data_window(ndc, resolution)
        columns = [i for i in range(-width, 2 * width) if ndc[0] <= (i + 0.5) / width < ndc[2]]
        rows = [
            height - 1 - i
            for i in range(-height, 2 * height)
            if ndc[1] <= (i + 0.5) / height < ndc[3]
        ]
        assert list(range(window["min"][0], window["max"][0])) == columns
        assert list(range(window["min"][1], window["max"][1])) == sorted(rows)


def test_crop_reaches_the_record(flatten):
    frame = flatten(
        'def RenderSettings "S" { uniform int2 resolution = (100, 100)\n'
        "uniform float4 dataWindowNDC = (0, 0, 0.5, 0.25) }",
        settings="/S",
    )
    # The lower left of the image is at the bottom of rows that count down.
    assert frame.settings["data_window"] == {"min": [0, 75], "max": [50, 100]}
