import os
import struct
import time
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import OpenImageIO as oiio
import pytest
from kilauea import payload
from kilauea.usd import textures, tile_files
from pxr import Sdf, Usd


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    monkeypatch.setenv(textures.CACHE_VARIABLE, str(folder))
    return folder


@pytest.fixture
def frame():
    return payload.Frame(stage="test.usda", time=1.0)


@pytest.fixture
def table(frame):
    return textures.TextureTable(frame, SimpleNamespace(time=Usd.TimeCode(1.0)))


def another_table():
    return textures.TextureTable(payload.Frame(stage="", time=1.0), SimpleNamespace(time=1.0))


def write_image(path, texels, dtype="uint8", **attributes):
    texels = np.asarray(texels)
    spec = oiio.ImageSpec(texels.shape[1], texels.shape[0], texels.shape[2], dtype)
    for name, value in attributes.items():
        spec.attribute(name.replace("__", ":"), value)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), oiio.geterror()
    assert output.write_image(np.ascontiguousarray(texels)), output.geterror()
    output.close()
    return str(path)


def read_tiles(path):
    """Read a tile file by its documentation: header fields and the levels, lowest row first."""
    data = Path(path).read_bytes()
    names = "magic version width height channels element transfer wrap_s wrap_t levels replaced"
    header = SimpleNamespace(
        **dict(zip(names.split(), struct.unpack_from("<8s10I", data), strict=True))
    )
    assert (header.magic, header.version) == (b"KLTILES\0", 1)
    dtype = np.dtype(["u1", "<f2", "<f4"][header.element])
    levels = []
    for i in range(header.levels):
        width, height, offset = struct.unpack_from("<2IQ", data, 48 + 16 * i)
        level = np.zeros((height, width, header.channels), dtype)
        for y in range(0, height, 64):
            for x in range(0, width, 64):
                tile = level[y : y + 64, x : x + 64]
                tile[...] = np.frombuffer(data, dtype, tile.size, offset).reshape(tile.shape)
                offset += tile.nbytes
        levels.append(level)
    assert offset == len(data)
    return header, levels


def prepared(table, index, udim=0):
    table.finish()
    frame = table._frame
    (file,) = [f for f in frame.textures[index]["files"] if f["udim"] == udim]
    return read_tiles(file["tiles"])


def test_every_texel_arrives_lowest_row_first(tmp_path, frame, table):
    texels = np.random.default_rng(1).integers(0, 256, (130, 201, 3), np.uint8)
    index = table.index(write_image(tmp_path / "a.png", texels), "a.png", "raw")
    header, levels = prepared(table, index)
    assert (header.width, header.height, header.channels, header.element) == (201, 130, 3, 0)
    assert np.array_equal(levels[0], texels[::-1])
    assert header.replaced == 0
    assert [level.shape[:2] for level in levels][-2:] == [(2, 3), (1, 1)]
    mean = texels.mean(axis=(0, 1))
    assert np.abs(levels[-1][0, 0] - mean).max() <= 1.0


@pytest.mark.parametrize(
    ("shape", "dtype", "color_space", "transfer"),
    [
        ((2, 2, 3), "uint8", "auto", 1),
        ((2, 2, 4), "uint8", "auto", 1),
        ((2, 2, 1), "uint8", "auto", 0),
        ((2, 2, 2), "uint8", "auto", 0),
        ((2, 2, 1), "uint8", "sRGB", 1),
        ((2, 2, 3), "uint8", "raw", 0),
        ((2, 2, 3), "uint16", "auto", 0),
    ],
)
def test_color_space_choice(tmp_path, frame, table, shape, dtype, color_space, transfer):
    texels = np.full(shape, 128, dtype)
    index = table.index(write_image(tmp_path / "a.png", texels, dtype), "a.png", color_space)
    header, levels = prepared(table, index)
    assert header.transfer == transfer
    assert levels[0].shape == shape


def test_srgb_mips_average_light(tmp_path, frame, table):
    texels = np.zeros((2, 2, 4), np.uint8)
    texels[:, 0] = 255
    index = table.index(write_image(tmp_path / "a.png", texels), "a.png", "auto")
    _, levels = prepared(table, index)
    # Half the light is code 188 in sRGB; alpha is linear.
    assert levels[1][0, 0].tolist() == [188, 188, 188, 128]


def test_sixteen_bit_srgb_becomes_linear(tmp_path, frame, table):
    texels = np.full((2, 2, 3), 32768, np.uint16)
    index = table.index(write_image(tmp_path / "a.png", texels, "uint16"), "a.png", "sRGB")
    header, levels = prepared(table, index)
    assert (header.element, header.transfer) == (1, 0)
    assert levels[0] == pytest.approx(0.21404, rel=1e-3)


@pytest.mark.parametrize(("largest", "element"), [(60000.0, 1), (1e6, 2)])
def test_high_dynamic_range(tmp_path, frame, table, largest, element):
    texels = np.full((3, 3, 3), 0.5, np.float32)
    texels[0, 0] = largest
    texels[2, 2] = np.nan
    index = table.index(write_image(tmp_path / "a.exr", texels, "float"), "a.exr")
    header, levels = prepared(table, index)
    assert (header.element, header.replaced) == (element, 3)
    assert levels[0][2, 0, 0] == pytest.approx(largest, rel=1e-3)
    assert levels[0][0, 2, 0] == 0.0
    assert levels[0][1, 1, 0] == 0.5
    assert levels[1][0, 0, 0] == pytest.approx((largest + 3.5) / 9, rel=1e-3)


def test_alpha_is_not_multiplied_in(tmp_path, frame, table):
    texels = np.full((2, 2, 4), (200, 100, 50, 10), np.uint8)
    source = write_image(tmp_path / "a.png", texels, oiio__UnassociatedAlpha=1)
    _, levels = prepared(table, table.index(source, "a.png"))
    assert levels[0][0, 0].tolist() == [200, 100, 50, 10]


def test_data_window_is_put_into_the_display_window(tmp_path, frame, table):
    path = tmp_path / "a.exr"
    spec = oiio.ImageSpec(2, 1, 3, "half")
    spec.x, spec.y = 1, 2
    spec.full_x, spec.full_y, spec.full_width, spec.full_height = 0, 0, 4, 4
    output = oiio.ImageOutput.create(str(path))
    output.open(str(path), spec)
    output.write_image(np.ones((1, 2, 3), np.float16))
    output.close()
    _, levels = prepared(table, table.index(str(path), "a.exr"))
    expected = np.zeros((4, 4))
    expected[1, 1:3] = 1  # third row from the top
    assert np.array_equal(levels[0][:, :, 0], expected)


def test_wrap_metadata(tmp_path, table):
    texels = np.zeros((2, 2, 3), np.uint8)
    plain = table.index(write_image(tmp_path / "a.tif", texels), "a.tif")
    tiled = write_image(tmp_path / "b.tif", texels, wrapmodes="periodic,clamp")
    assert table.wraps(plain) == (None, None)
    assert table.wraps(table.index(tiled, "b.tif")) == ("repeat", "clamp")


def test_images_are_prepared_once(tmp_path, frame, table, cache, monkeypatch):
    path = tmp_path / "a.png"
    write_image(path, np.zeros((2, 2, 3), np.uint8))
    assert table.index(str(path), "a.png") == table.index(str(path), "a.png") == 0
    assert table.index(str(path), "a.png", "raw") == 1
    table.finish()
    assert len(list(cache.iterdir())) == 2

    with monkeypatch.context() as forbid:
        forbid.setattr(tile_files, "write", None)
        again = another_table()
        again.index(str(path), "a.png")
        again.finish()
    assert again._frame.textures == frame.textures[:1]

    write_image(path, np.full((2, 2, 3), 9, np.uint8))
    os.utime(path, ns=(1, 1))
    changed = another_table()
    changed.index(str(path), "a.png")
    assert prepared(changed, 0)[1][0].max() == 9


def test_a_damaged_cache_entry_is_written_again(tmp_path, frame, table):
    path = write_image(tmp_path / "a.png", np.full((2, 2, 3), 7, np.uint8))
    table.index(path, "a.png")
    table.finish()
    Path(frame.textures[0]["files"][0]["tiles"]).write_bytes(b"junk")
    again = another_table()
    again.index(path, "a.png")
    assert prepared(again, 0)[1][0].max() == 7


def test_missing_and_unreadable_images(tmp_path, frame, table):
    missing = table.index("", "gone.png", prim_path="/mat/tex")
    junk = tmp_path / "junk.png"
    junk.write_bytes(b"not an image")
    unreadable = table.index(str(junk), "junk.png")
    truncated = tmp_path / "cut.exr"
    write_image(truncated, np.random.default_rng(1).random((64, 64, 3)).astype("f4"), "float")
    truncated.write_bytes(truncated.read_bytes()[:2000])
    cut = table.index(str(truncated), "cut.exr")
    assert table.is_missing(missing)
    assert table.is_missing(unreadable)
    table.finish()
    for index in (missing, unreadable, cut):
        assert table.is_missing(index)
    assert len(frame.missing) == 3
    assert "/mat/tex" in frame.missing[0]
    assert "gone.png" in frame.missing[0]
    assert len(frame.warnings) == 2
    assert "junk.png" in frame.warnings[0]


def test_udim(tmp_path, frame, table):
    for udim in (1001, 1012, 1100, 1101):
        write_image(tmp_path / f"t_{udim}.png", np.full((2, 2, 3), udim % 256, np.uint8))
    stage = Usd.Stage.CreateNew(str(tmp_path / "s.usda"))
    file = stage.DefinePrim("/tex").CreateAttribute("file", Sdf.ValueTypeNames.Asset)
    file.Set(Sdf.AssetPath("./t_<UDIM>.png"))
    index = table.index_of_attribute(file)
    assert [f["udim"] for f in frame.textures[index]["files"]] == [1001, 1012, 1100]
    assert prepared(table, index, 1012)[1][0].max() == 1012 % 256
    file.Set(Sdf.AssetPath("./u_<UDIM>.png"))
    assert table.is_missing(table.index_of_attribute(file))
    file.Set(Sdf.AssetPath(""))
    assert table.index_of_attribute(file) is None


@pytest.mark.parametrize("name", ["tex/a.png", "tex/a_<UDIM>.png"])
def test_images_in_packages(tmp_path, frame, table, name):
    folder = tmp_path / "loose"
    (folder / "tex").mkdir(parents=True)
    write_image(folder / name.replace("<UDIM>", "1001"), np.full((2, 2, 3), 77, np.uint8))
    stage = Usd.Stage.CreateNew(str(folder / "s.usda"))
    prim = stage.DefinePrim("/tex")
    prim.CreateAttribute("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(name))
    stage.Save()
    package = tmp_path / "s.usdz"
    writer = Sdf.ZipFileWriter.CreateNew(str(package))
    for file in ("s.usda", name.replace("<UDIM>", "1001")):
        writer.AddFile(str(folder / file), file)
    writer.Save()
    assert zipfile.is_zipfile(package)
    packed = Usd.Stage.Open(str(package))
    index = table.index_of_attribute(packed.GetPrimAtPath("/tex").GetAttribute("file"))
    assert not frame.missing
    assert prepared(table, index, 1001 if "UDIM" in name else 0)[1][0].max() == 77


def test_time_samples(tmp_path, frame, table):
    write_image(tmp_path / "one.png", np.zeros((2, 2, 3), np.uint8))
    stage = Usd.Stage.CreateNew(str(tmp_path / "s.usda"))
    file = stage.DefinePrim("/tex").CreateAttribute("file", Sdf.ValueTypeNames.Asset)
    file.Set(Sdf.AssetPath("./one.png"), 1.0)
    file.Set(Sdf.AssetPath("./two.png"), 2.0)
    table.index_of_attribute(file)
    assert frame.textures[0]["path"] == "./one.png"
    assert not frame.missing


def test_preparing_is_fast(tmp_path, table):
    texels = np.random.default_rng(1).integers(0, 256, (2048, 2048, 3), np.uint8)
    path = write_image(tmp_path / "a.tif", texels)
    start = time.process_time()
    table.index(path, "a.tif")
    table.finish()
    assert time.process_time() - start < 2.0


GOLDEN = Path(__file__).parents[2] / "crates/kilauea-texture/tests/data/grid.tiles"


def test_the_engine_is_tested_with_what_is_written(tmp_path, frame, table):
    y, x = np.mgrid[0:2, 0:70]
    texels = np.stack([x, 100 * y, np.full_like(x, 200), x + y], axis=2).astype(np.uint8)
    path = write_image(tmp_path / "grid.png", texels, oiio__UnassociatedAlpha=1)
    table.index(path, "grid.png")
    table.finish()
    written = Path(frame.textures[0]["files"][0]["tiles"]).read_bytes()
    assert written == GOLDEN.read_bytes()
