"""`kilauea inspect` of what paths are told."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from kilauea import cli
from kilauea.inspect import LEARNT
from kilauea.render import RenderOptions, render_frame
from kilauea.usd.options import FlattenOptions
from kilauea.usd.stage import flatten

SCENES = Path(__file__).parents[2] / "tests/scenes"
BOX = SCENES / "box_rect_light.usda"
BALLS = SCENES / "shader_balls.usda"
"""Under a lamp and a sky."""
SIZE = ["-r", "16", "16"]


def inspect(capsys, stage: Path, *words: str | Path, code: int = 0) -> tuple[dict, str]:
    assert cli.main(["inspect", str(stage), *SIZE, *map(str, words)]) == code
    captured = capsys.readouterr()
    return json.loads(captured.out), captured.err


def layers(exr: Path) -> dict:
    image = oiio.ImageBuf(str(exr))
    pixels = image.get_pixels()
    names = image.spec().channelnames
    return {name: pixels[..., idx] for idx, name in enumerate(names)}


def test_what_a_pilot_tells_is_shown(tmp_path, capsys):
    exr, png, stats = tmp_path / "a.exr", tmp_path / "a.png", tmp_path / "a.json"
    words = ["--pilot", "--always", "-o", exr, png, "--stats", stats]
    report, _ = inspect(capsys, BALLS, *words)
    assert report == json.loads(stats.read_text())
    assert report["skipped"] == []
    assert png.stat().st_size > 0
    found = layers(exr)
    for layer, n_cells in (("lights.cell", "light_cells"), ("guide.cell", "cells")):
        assert found[layer].max() == report["gather"][n_cells] - 1
    is_seen = found["lights.top"] >= 0
    assert set(report["lights"]) <= {"/World/Light", "/World/Sky"}
    assert sum(report["lights"].values()) == is_seen.sum() > 100
    # Of two lights, the likeliest is chosen half of the time or more.
    assert (found["lights.probability"][is_seen] >= 0.5).all()
    assert (found["lights.number"][is_seen] == 1).all()
    assert (found["guide.peak"][is_seen] >= 1).all()
    length = sum(found[f"guide.{axis}"] ** 2 for axis in "XYZ") ** 0.5
    assert (length[is_seen] > 0.01).all()
    assert (length < 1).all()


def test_with_one_light_there_are_no_lights_to_choose(tmp_path, capsys):
    exr = tmp_path / "a.exr"
    report, _ = inspect(capsys, BOX, "--pilot", "--always", "-o", exr)
    assert report["skipped"] == ["lights: paths have none to choose from"]
    assert "guide.cell" in layers(exr)
    assert not any(name.startswith("lights.") for name in layers(exr))
    inspect(
        capsys, BOX, "--pilot", "--always", "--show", "lights", "-o", tmp_path / "b.exr", code=1
    )
    assert not (tmp_path / "b.exr").exists()


def test_the_picture_is_of_what_is_asked_for(tmp_path, capsys):
    found = {}
    for name, threads in (("lights", "1"), ("directions", "3")):
        exr = tmp_path / f"{name}.exr"
        words = ["--pilot", "--always", "--show", name, "-j", threads, "-o", exr]
        inspect(capsys, BALLS, *words)
        found[name] = layers(exr)
    lights, directions = found["lights"], found["directions"]
    is_seen = directions["guide.cell"] >= 0
    for axis, channel in zip("XYZ", "RGB", strict=True):
        shown = np.where(is_seen, 0.5 + 0.5 * directions[f"guide.{axis}"], 0)
        assert directions[channel] == pytest.approx(shown, abs=1e-6)
        assert (lights[channel] != directions[channel]).any()
    # All else is the same, whatever the picture is of and whoever made it.
    for name in set(lights) - set("RGB"):
        assert (lights[name] == directions[name]).all(), name


def test_saved_estimates_show_what_their_pilot_would(tmp_path, capsys):
    kept, saved, anew = (tmp_path / name for name in ("balls.estimates", "a.exr", "b.exr"))
    settings = {"resolution": [16, 16], "general": LEARNT}
    options = RenderOptions([], settings, save_estimates=str(kept), verbosity=0)
    render_frame(flatten(str(BALLS), FlattenOptions(resolution=(16, 16))), options)
    capsys.readouterr()
    inspect(capsys, BALLS, "--estimates", kept, "-o", saved)
    inspect(capsys, BALLS, "--pilot", "--always", "-o", anew)
    for name, layer in layers(anew).items():
        assert (layers(saved)[name] == layer).all(), name


def test_saved_estimates_that_tell_nothing_say_why(tmp_path, capsys):
    kept, exr = tmp_path / "box.estimates", tmp_path / "a.exr"
    words = ["-o", str(tmp_path / "b.exr"), *SIZE, "-p", "256", "--integrator", "kilauea"]
    assert cli.main(["render", str(BOX), *words, "--save-estimates", str(kept)]) == 0
    capsys.readouterr()
    # There is one light, and directions pay in no stage that we know.
    report, errors = inspect(capsys, BOX, "--estimates", kept, "-o", exr, code=1)
    assert report["gather"]["paths"] > 0
    assert [reason.partition(":")[0] for reason in report["skipped"]] == ["lights", "directions"]
    assert all(reason in errors for reason in report["skipped"])
    assert not exr.exists()
    other = ["inspect", str(BOX), "-r", "16", "8", "--estimates", str(kept), "-o", str(exr)]
    assert cli.main(other) == 1
    assert "another camera" in capsys.readouterr().err


def test_a_frame_without_a_pilot_says_so(tmp_path, capsys):
    words = ["--pilot", "-p", "4", "-o", tmp_path / "a.png"]
    report, _ = inspect(capsys, BOX, *words, code=1)
    assert all("no pilot" in reason for reason in report["skipped"])


@pytest.mark.parametrize(
    "words",
    [
        ["--pilot", "--estimates", "a"],
        ["--always"],
        ["--estimates", "a", "-p", "4"],
        ["--pilot", "-p", "0"],
        ["--show", "lights"],
    ],
    ids=" ".join,
)
def test_what_does_not_go_together_is_refused(words, capsys):
    assert cli.main(["inspect", str(BOX), "-o", "a.exr", *words]) == 2
    assert "kilauea: error:" in capsys.readouterr().err
