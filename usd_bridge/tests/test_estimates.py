"""What a pilot told, kept for the same frame again."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("kilauea._native")
oiio = pytest.importorskip("OpenImageIO")

COMMAND = Path(sys.executable).with_name("kilauea")
BOX = Path(__file__).parents[2] / "tests/scenes/cornell_box/cornell-box.usda"
SAMPLES = 16
"""As many as make a frame of 64 x 64 pixels long enough for a pilot."""


def render(out, *flags, code=0, samples=SAMPLES):
    argv = [COMMAND, "render", BOX, "-o", out, "-r", 64, 64, "-p", samples]
    argv += ["--integrator", "kilauea", *flags, "--stats", out.with_suffix(".json")]
    done = subprocess.run([*map(str, argv)], capture_output=True, text=True, timeout=120)
    assert done.returncode == code, done.stderr
    return done.stderr


def beauty(file):
    return oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)


def n_camera_rays(out):
    return json.loads(out.with_suffix(".json").read_text())["rays"]["camera"]


def test_the_same_frame_again_has_no_pilot(tmp_path):
    first, again, kept = tmp_path / "a.exr", tmp_path / "b.exr", tmp_path / "box.estimates"
    render(first, "--save-estimates", kept)
    render(again, "--estimates", kept, "-j", 2, "--aov", "N")
    n_samples = 64 * 64 * SAMPLES
    assert n_camera_rays(first) > n_samples
    assert n_camera_rays(again) == n_samples
    np.testing.assert_array_equal(beauty(first)[..., :4], beauty(again)[..., :4])


def test_estimates_of_another_frame_are_refused(tmp_path):
    kept = tmp_path / "box.estimates"
    render(tmp_path / "a.exr", "--save-estimates", kept)
    errors = render(tmp_path / "b.exr", "--estimates", kept, samples=SAMPLES + 1, code=1)
    assert "another set of settings" in errors
    kept.write_bytes(kept.read_bytes()[:-1])
    assert "not all" in render(tmp_path / "b.exr", "--estimates", kept, code=1)
    missing = tmp_path / "none.estimates"
    assert str(missing) in render(tmp_path / "b.exr", "--estimates", missing, code=1)


@pytest.mark.parametrize(
    "flags",
    [["--workers", "2"], ["--frames", "1:2"], ["--integrator", "path"]],
    ids=["workers", "frames", "path"],
)
def test_estimates_are_of_one_frame_that_learns(tmp_path, flags):
    out = tmp_path / "a.$F4.exr"
    errors = render(out, "--save-estimates", tmp_path / "box.estimates", *flags, code=2)
    assert "--save-estimates" in errors
    assert not (tmp_path / "box.estimates").exists()
