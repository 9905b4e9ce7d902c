"""The command from a stage to files."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("kilauea._native")
oiio = pytest.importorskip("OpenImageIO")

COMMAND = Path(sys.executable).with_name("kilauea")
BOX = Path(__file__).parents[2] / "tests/scenes/cornell_box/cornell-box.usda"
BALLS = Path(__file__).parents[2] / "tests/scenes/shader_balls.usda"
STATS = {
    "": "samples_per_pixel times rays photons memory needs skipped workers network warnings",
    "times": "load build photon gather render write total",
    "rays": "camera shadow indirect photon",
    "photons": "emitted stored",
    "memory": "peak_rss scene accel photons shades_in_flight_peak",
    "network": "bytes_sent bytes_received messages stale_messages",
}


LIGHT_LAYERS = ["emission"] + [
    f"{order}_{lobe}" for order in ("direct", "indirect") for lobe in ("diffuse", "specular")
]


def kilauea(*argv, code=0):
    done = subprocess.run([COMMAND, *map(str, argv)], capture_output=True, text=True, timeout=120)
    assert done.returncode == code, done.stderr
    return done


def render_box(out, *flags, samples=4):
    return kilauea("render", BOX, "-o", out, "-r", 64, 64, "-p", samples, *flags)


def channels(file):
    """All channels of an image by name."""
    image = oiio.ImageBuf(str(file))
    assert not image.has_error, image.geterror()
    pixels = image.get_pixels(oiio.FLOAT)
    return {name: pixels[..., i] for i, name in enumerate(image.spec().channelnames)}


@pytest.fixture(scope="module")
def box(tmp_path_factory):
    """Render the box once, with statistics."""
    folder = tmp_path_factory.mktemp("box")
    render_box(folder / "box.exr", "--stats", folder / "box.json")
    return folder / "box.exr"


def test_shaders_of_our_own(tmp_path):
    """Each ball of the stage scatters as much as its shader is told to."""
    kilauea("render", BALLS, "-o", tmp_path / "a.exr", "-r", 96, 48, "-p", 4, "--strict")
    layers = channels(tmp_path / "a.exr")
    row = 22
    matte, mirror, brushed, glass = (
        np.array([layers[f"albedo.{c}"][row, column] for c in "RGB"]) for column in (15, 37, 59, 81)
    )
    np.testing.assert_allclose(matte, [0.7, 0.25, 0.1], atol=1e-3)
    np.testing.assert_allclose(mirror, [0.9, 0.9, 0.9], atol=1e-3)
    np.testing.assert_allclose(brushed, [0.95, 0.7, 0.3], atol=0.03)
    # Near the middle of the ball about a twenty-fifth is reflected, which is white.
    np.testing.assert_allclose(glass, np.array([0.75, 0.95, 0.8]) * 0.96 + 0.04, atol=0.01)


def test_layers(box):
    pixels = channels(box)
    rgb = [f"{layer}.{c}" for layer in LIGHT_LAYERS for c in "RGB"]
    others = ["Z", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "primId", "instanceId"]
    expected = {"R", "G", "B", "A", *rgb, *others, "sample_count", "variance"}
    expected |= {"albedo.R", "albedo.G", "albedo.B"}
    assert set(pixels) == expected
    assert all(plane.shape == (64, 64) for plane in pixels.values())
    assert (pixels["sample_count"] == 4).all()
    assert (pixels["A"] <= 1).all()
    assert pixels["R"].mean() > 0.05
    hit = pixels["A"] == 1
    assert hit.mean() > 0.5
    length = np.sqrt(sum(pixels[f"N.{axis}"] ** 2 for axis in "XYZ"))
    assert length[hit].max() < 1.0 + 1e-3
    assert length[hit].min() > 0.1
    assert (pixels["primId"][hit] >= 0).all()
    assert (pixels["instanceId"] == -1).all()
    for c in "RGB":
        assert (pixels[f"albedo.{c}"][hit] <= 1.0).all()
        total = sum(pixels[f"{layer}.{c}"].astype(float) for layer in LIGHT_LAYERS)
        np.testing.assert_allclose(total, pixels[c], rtol=2e-3, atol=2e-3)


def test_header(box):
    spec = oiio.ImageBuf(str(box)).spec()
    assert (spec.width, spec.height, spec.x, spec.y) == (64, 64, 0, 0)
    assert (spec.full_width, spec.full_height, spec.full_x, spec.full_y) == (64, 64, 0, 0)
    attributes = {a.name: a.value for a in spec.extra_attribs}
    assert attributes["software"].startswith("Kilauea ")
    matrix = np.array(attributes["worldToCamera"]).reshape(4, 4)
    assert np.isfinite(matrix).all()
    # Points seen, taken to the camera, lie in front of it at the depth that Z tells.
    pixels = channels(box)
    p = np.stack([pixels[f"P.{axis}"] for axis in "XYZ"] + [np.ones((64, 64))], axis=-1)
    hit = pixels["A"] == 1
    in_camera = (p @ matrix)[hit]
    np.testing.assert_allclose(np.abs(in_camera[:, 2]), pixels["Z"][hit], rtol=1e-4)
    stats = json.loads(attributes["kilauea/stats"])
    assert stats["samples_per_pixel"] == 4
    assert attributes["kilauea/stage"] == str(BOX)


def test_statistics(box):
    stats = json.loads(box.with_suffix(".json").read_text())
    for group, names in STATS.items():
        found = stats[group] if group else stats
        missing = set(names.split()) - set(found)
        assert not missing, f"{group}: {missing}"
    assert stats["samples_per_pixel"] == 4
    assert stats["rays"]["camera"] == 4 * 64 * 64
    assert stats["rays"]["shadow"] > 0
    assert stats["memory"]["peak_rss"] > 1 << 20
    times = stats["times"]
    parts = sum(times[name] for name in ("load", "build", "photon", "gather", "render", "write"))
    assert 0 < parts <= times["total"] * 1.01
    assert all(math.isfinite(t) and t >= 0 for t in times.values())


def test_same_command_same_pixels(box, tmp_path):
    first = channels(box)
    for name, flags in [("again", []), ("one", ["-j", 1]), ("two", ["-j", 2])]:
        out = tmp_path / f"{name}.exr"
        render_box(out, *flags)
        other = channels(out)
        assert other.keys() == first.keys()
        for channel, plane in first.items():
            np.testing.assert_array_equal(plane, other[channel], err_msg=f"{name} {channel}")
    render_box(tmp_path / "seed.exr", "--seed", 7)
    assert (channels(tmp_path / "seed.exr")["G"] != first["G"]).mean() > 0.5


def test_compare(box, tmp_path):
    same = json.loads(kilauea("compare", box, box).stdout)
    assert same == {
        "relMSE": 0,
        "trimmed_relMSE": 0,
        "MSE": 0,
        "mean_FLIP": 0,
        "mean_ratio": [1, 1, 1],
        "nan": 0,
        "inf": 0,
    }
    better = tmp_path / "better.exr"
    render_box(better, "--seed", 1, samples=64)
    other = json.loads(kilauea("compare", box, better).stdout)
    assert 0 < other["relMSE"] < 10
    assert 0 < other["mean_FLIP"] < 1
    assert all(abs(r - 1) < 0.1 for r in other["mean_ratio"])
    assert "none.exr" in kilauea("compare", box, tmp_path / "none.exr", code=1).stderr
    broken = tmp_path / "broken.exr"
    broken.write_bytes(box.read_bytes()[:1000])
    done = kilauea("compare", box, broken, code=1)
    assert done.stderr.startswith("kilauea: error: ")
    assert len(done.stderr.splitlines()) == 1


def test_frames(write_stage, tmp_path):
    stage = write_stage(
        """def Sphere "S" { double3 xformOp:translate.timeSamples = { 1: (-2, 0, 0), 3: (2, 0, 0) };
        uniform token[] xformOpOrder = ["xformOp:translate"] }
        def DomeLight "L" {}
        def Camera "C" { double3 xformOp:translate = (0, 0, 20);
        uniform token[] xformOpOrder = ["xformOp:translate"] }"""
    )
    small = ["-r", 16, 8, "-p", 1]
    kilauea("render", stage, "-o", tmp_path / "a.####.exr", "--frames", "1:3", *small)
    names = [f"a.000{i}.exr" for i in (1, 2, 3)]
    assert sorted(p.name for p in tmp_path.glob("a.*")) == names
    columns = [channels(tmp_path / name)["A"].sum(axis=0) for name in names]
    centers = [np.average(np.arange(16), weights=c) for c in columns]
    assert centers[0] < centers[1] < centers[2]

    done = kilauea("render", stage, "-o", tmp_path / "b.exr", "--frames", "1:3", *small, code=2)
    assert "more than once" in done.stderr
    assert not (tmp_path / "b.exr").exists()
    kilauea("render", stage, "-o", tmp_path / "b.exr", "--frames", "2", *small)
    kilauea("render", stage, "-o", tmp_path / "b.exr", "--frames", "3", *small)
    np.testing.assert_array_equal(
        channels(tmp_path / "b.exr")["A"], channels(tmp_path / names[2])["A"]
    )


def test_time_limit_holds(tmp_path):
    argv = [COMMAND, "render", BOX, "-o", tmp_path / "a.exr", "-r", "256", "256", "-p", "65536",
            "--stats", tmp_path / "a.json", "--timelimit"]  # fmt: skip
    # Until a pass fits, however slow the machine is.
    for limit in (4, 16, 64):
        done = subprocess.run([*argv, str(limit)], capture_output=True, text=True, timeout=300)
        if done.returncode != 5:
            break
    assert done.returncode == 0, done.stderr
    stats = json.loads((tmp_path / "a.json").read_text())
    # Two seconds more where the machine has nothing else to do; all samples would take hours.
    assert stats["times"]["total"] < limit + 60
    assert 1 <= stats["samples_per_pixel"] < 65536
    assert channels(tmp_path / "a.exr")["R"].mean() > 0.05


def test_formats_and_layers(tmp_path):
    outputs = f"{tmp_path}/a.exr,{tmp_path}/a.png"
    render_box(outputs, "--aov", "depth", "albedo")
    assert set(channels(tmp_path / "a.exr")) == {
        "R", "G", "B", "A", "Z", "albedo.R", "albedo.G", "albedo.B",
    }  # fmt: skip
    png = channels(tmp_path / "a.png")
    assert {"R", "G", "B"} <= set(png)
    assert 0.05 < png["R"].mean() < 0.95
    assert not list(tmp_path.glob("*.partial*"))
