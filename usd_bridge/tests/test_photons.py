"""`kilauea inspect` and `kilauea bench photons`."""

from __future__ import annotations

import json
from pathlib import Path

import OpenImageIO as oiio
import pytest
from kilauea import cli

BOX = Path(__file__).parents[2] / "tests/scenes/box_rect_light.usda"


def inspect(capsys, *words: str | Path) -> dict:
    small = ["-r", "16", "16", "--emitted", "4000"]
    assert cli.main(["inspect", str(BOX), *small, *map(str, words)]) == 0
    return json.loads(capsys.readouterr().out)


def test_photons_are_shown_and_counted(tmp_path, capsys):
    exr, png, stats = tmp_path / "a.exr", tmp_path / "a.png", tmp_path / "a.json"
    report = inspect(capsys, "-o", exr, png, "--stats", stats)
    assert report == json.loads(stats.read_text())
    assert report["photons"]["emitted"] == 4000
    assert report["photons"]["stored"] > 4000
    assert report["rays"]["photon"] >= report["photons"]["stored"]
    assert report["memory"]["photons"] > 16 * report["photons"]["stored"]
    assert sum(report["benefit"]["shares"].values()) == pytest.approx(1.0)
    assert png.stat().st_size > 0
    image = oiio.ImageBuf(str(exr))
    names = image.spec().channelnames
    assert {"R", "irradiance.G", "caustic.B", "photons.count"} <= set(names)
    pixels = image.get_pixels()
    assert (pixels[..., names.index("irradiance.R")] > 0).mean() > 0.9


def test_threads_do_not_change_a_layer(tmp_path, capsys):
    names = [tmp_path / f"{threads}.exr" for threads in (1, 3)]
    for name, threads in zip(names, ("1", "3"), strict=True):
        inspect(capsys, "-o", name, "-j", threads)
    one, three = (oiio.ImageBuf(str(name)).get_pixels() for name in names)
    assert (one == three).all()


def test_what_cannot_be_written_is_refused(tmp_path, capsys):
    for words in (["-o", "a.tif"], ["-o", "a.exr", "--emitted", "0"]):
        assert cli.main(["inspect", str(BOX), *words]) == 2
    assert capsys.readouterr().err.count("kilauea: error:") == 2


def test_photons_are_measured(tmp_path):
    target = tmp_path / "rows.json"
    words = ["--emitted", "2000", "--rounds", "1", "-j", "1", "2", "--json", str(target)]
    assert cli.main(["bench", "photons", str(BOX), *words]) == 0
    rows = json.loads(target.read_text())["rows"]
    assert [row["threads"] for row in rows] == [1, 2]
    assert rows[0]["stored"] == rows[1]["stored"] > 0
    assert all(row["emitted_per_second"] > 0 and row["bytes_per_photon"] < 50 for row in rows)
