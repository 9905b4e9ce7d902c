"""What the command does with input that is wrong: the exit code, one line, and no file."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("kilauea._native")

COMMAND = Path(sys.executable).with_name("kilauea")
SMALL = ["-r", "16", "12", "-p", "1", "-j", "1", "-V", "1"]
CAMERA = """def Camera "C" { double3 xformOp:translate = (0, 0, 5);
    uniform token[] xformOpOrder = ["xformOp:translate"] }"""
LIGHT = 'def DomeLight "L" { float inputs:intensity = 1 }'
SOUND = 'def Sphere "S" {}' + LIGHT + CAMERA


def mesh(name, points="(0, 0, 0), (1, 0, 0), (0, 1, 0)", counts="3", indices="0, 1, 2", more=""):
    return f"""def Mesh "{name}" {{ point3f[] points = [{points}]
        int[] faceVertexCounts = [{counts}]
        int[] faceVertexIndices = [{indices}]
        uniform token subdivisionScheme = "none"; {more} }}"""


def placed(name, operation, value):
    """Place a sphere by one transform."""
    return f"""def Xform "{name}" {{ double3 xformOp:{operation} = {value};
        uniform token[] xformOpOrder = ["xformOp:{operation}"]; def Sphere "S" {{}} }}"""


def ball(shader, inputs):
    """Bind a shader of our own to a sphere."""
    return f"""def Material "M" {{ token outputs:surface.connect = </M/S.outputs:surface>
        def Shader "S" {{ uniform token info:id = "kilauea:{shader}"; {inputs}
            token outputs:surface }} }}
        def Sphere "B" (prepend apiSchemas = ["MaterialBindingAPI"])
        {{ rel material:binding = </M> }}"""


@pytest.fixture
def run(tmp_path):
    """Run the command and check what must always hold."""

    def run(stage, *flags, out=None, code=0):
        out = tmp_path / "out" / "a.exr" if out is None else Path(out)
        (tmp_path / "out").mkdir(exist_ok=True)
        before = set(out.parent.iterdir()) if out.parent.is_dir() else set()
        done = subprocess.run(
            [COMMAND, "render", str(stage), "-o", str(out), *SMALL, *flags],
            capture_output=True,
            text=True,
            timeout=60,
        )
        lines = done.stderr.splitlines()
        errors = [line for line in lines if line.startswith("kilauea: error: ")]
        assert done.returncode == code, done.stderr
        assert "Traceback" not in done.stderr
        assert "panicked" not in done.stderr
        assert len(errors) == (0 if code == 0 else 1), done.stderr
        after = set(out.parent.iterdir()) if out.parent.is_dir() else set()
        assert after == before | ({out} if code == 0 else set())
        return errors[0] if errors else done.stderr

    return run


def test_no_such_file(run, tmp_path):
    assert "none.usda" in run(tmp_path / "none.usda", code=3)


def test_not_a_stage(run, tmp_path):
    for name, content in [
        ("text.usda", b"hello, world\n"),
        ("noise.usdc", bytes(range(256)) * 8),
        ("noise.usd", bytes(range(255, -1, -1)) * 8),
        ("empty.usda", b""),
        ("empty.usdc", b""),
        ("zip.usdz", b"PK\x03\x04 and nothing more"),
        ("picture.png", b"\x89PNG"),
    ]:
        file = tmp_path / name
        file.write_bytes(content)
        assert name in run(file, code=3)
    assert str(tmp_path) in run(tmp_path, code=3)


def test_truncated_crate(run, tmp_path):
    from pxr import Usd, UsdGeom

    whole = tmp_path / "whole.usdc"
    stage = Usd.Stage.CreateNew(str(whole))
    cube = UsdGeom.Mesh.Define(stage, "/Cube")
    cube.CreatePointsAttr([(float(i), 0.0, 1.0) for i in range(1000)])
    cube.CreateFaceVertexCountsAttr([3] * 333)
    cube.CreateFaceVertexIndicesAttr(list(range(999)))
    stage.Save()
    del stage, cube
    content = whole.read_bytes()
    run(whole)
    for length in (20, 88, len(content) // 2, len(content) - 1):
        cut = tmp_path / f"cut{length}.usdc"
        cut.write_bytes(content[:length])
        assert cut.name in run(cut, code=3)


def test_no_camera_is_framed(run, write_stage):
    text = run(write_stage('def Sphere "S" {}' + LIGHT))
    assert "camera" in text
    assert "fram" in text


def test_no_such_camera(run, write_stage):
    assert "/None" in run(write_stage(SOUND), "-c", "/None", code=2)
    assert "/S" in run(write_stage(SOUND), "-c", "/S", code=2)


TEXTURED = """def Material "MATERIAL" {
    token outputs:surface.connect = </MATERIAL/P.outputs:surface>;
    def Shader "P" {
        uniform token info:id = "SHADER";
        color3f inputs:diffuseColor.connect = </MATERIAL/T.outputs:rgb>;
        token outputs:surface }
    def Shader "T" {
        uniform token info:id = "UsdUVTexture";
        asset inputs:file = @FILE@;
        float3 outputs:rgb } }
def Sphere "OfMATERIAL" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </MATERIAL> }"""
MISSING = {
    "lost.png": TEXTURED.replace("MATERIAL", "A")
    .replace("SHADER", "UsdPreviewSurface")
    .replace("FILE", "lost.png"),
    "StudioSecret": TEXTURED.replace("MATERIAL", "B")
    .replace("SHADER", "StudioSecret")
    .replace("FILE", "other.png"),
    "reference.usda": 'def Xform "X" (references = @reference.usda@) {}',
    "payload.usda": 'def Xform "Y" (payload = @payload.usda@) {}',
}


def warned(text, *names):
    """Whether one warning has all of these words."""
    warnings = [line for line in text.splitlines() if line.startswith("kilauea: warning: ")]
    return any(all(name in line for name in names) for line in warnings)


def test_what_is_missing_is_named(run, write_stage):
    header = "subLayers = [@layer.usda@]"
    text = run(write_stage(SOUND + "".join(MISSING.values()), header=header))
    for name in [*MISSING, "layer.usda"]:
        assert warned(text, name), f"{name}: {text}"


@pytest.mark.parametrize("name", MISSING)
def test_what_is_missing_is_an_error_under_strict(run, write_stage, name):
    assert name in run(write_stage(SOUND + MISSING[name]), "--strict", code=4)


def test_input_of_another_type(run, write_stage):
    stage = write_stage(ball("Glass", 'string inputs:ior = "diamond"') + LIGHT + CAMERA)
    stderr = run(stage, code=1)
    assert "/M: inputs:ior of kilauea:Glass is a string; expected a float" in stderr


def test_constant_out_of_range(run, write_stage):
    stderr = run(write_stage(ball("Matte", "float inputs:opacity = 2") + LIGHT + CAMERA))
    assert "/M: inputs:opacity is [2.0], outside 0 to 1" in stderr


def test_binding_to_nothing(run, write_stage):
    body = """def Sphere "B" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        rel material:binding = </Gone> }"""
    assert warned(run(write_stage(SOUND + body)), "/Gone")


SHORT_NORMALS = 'normal3f[] normals = [(0, 0, 1)] ( interpolation = "vertex" )'
BAD = [
    (mesh("NotFinite", "(0, 0, 0), (nan, 0, 0), (0, 1, 0)"), "points"),
    (mesh("Infinite", "(0, 0, 0), (inf, 0, 0), (0, 1, 0)"), "points"),
    (mesh("Huge", "(0, 0, 0), (1e38, 0, 0), (0, 1, 0)"), "points"),
    (mesh("Outside", indices="0, 1, 3"), "faceVertexIndices"),
    (mesh("Negative", indices="0, 1, -1"), "faceVertexIndices"),
    (mesh("TooMany", counts="4"), "faceVertexCounts"),
    (mesh("BelowZero", counts="-3"), "faceVertexCounts"),
    (mesh("Lines", counts="2, 1"), "faceVertexCounts"),
    (mesh("Overflow", counts="2147483647, 2147483647"), "faceVertexCounts"),
    (mesh("Normals", more=SHORT_NORMALS), "normals"),
    (placed("Flat", "scale", "(1, 0, 1)"), "transform"),
    (placed("Nowhere", "translate", "(nan, 0, 1)"), "transform"),
    ('def Sphere "InsideOut" { double radius = -1 }', "dimensions"),
    ('def Sphere "NoSize" { double radius = nan }', "dimensions"),
    ('def SphereLight "Glare" { float inputs:intensity = nan }', "not finite"),
]


def test_what_makes_no_sense_is_left_out_and_named(run, write_stage):
    text = run(write_stage(SOUND + "".join(body for body, _ in BAD)))
    for body, attribute in BAD:
        path = "/" + body.split('"')[1]
        assert warned(text, path, attribute), f"{path} {attribute}: {text}"


def test_nothing_to_draw_is_no_error(run, write_stage):
    empty = (
        'def Mesh "Unauthored" {} def Scope "Nothing" {} def PointInstancer "None" {}'
        + mesh("Faceless", counts="", indices="", points="(0, 0, 0)")
        + mesh("Point", points="(0, 0, 0), (0, 0, 0), (0, 0, 0)")
    )
    run(write_stage(LIGHT + CAMERA + empty))
    run(write_stage(empty))
    run(write_stage(""))


def test_output_folder(run, write_stage, tmp_path):
    stage = write_stage(SOUND)
    assert "none" in run(stage, out=tmp_path / "none" / "a.exr", code=1)
    assert "stage.usda" in run(stage, out=stage / "a.exr", code=1)
    (tmp_path / "b.exr").mkdir()
    assert "b.exr" in run(stage, out=tmp_path / "b.exr", code=1)
    assert "none" in run(stage, "--stats", str(tmp_path / "none" / "a.json"), code=1)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_output_folder_without_permission(run, write_stage, tmp_path):
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o555)
    assert "locked" in run(write_stage(SOUND), out=folder / "a.exr", code=1)


@pytest.fixture
def mounted(tmp_path):
    """Mount a file system of 64 KiB; skip where that is not allowed."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount, umount = shutil.which("mount"), shutil.which("umount")
    if os.geteuid() != 0 or not mount or not umount:
        pytest.skip("only root may mount a file system")
    options = ["-t", "tmpfs", "-o", "size=64k", "none", str(folder)]
    if subprocess.run([mount, *options], capture_output=True).returncode != 0:
        pytest.skip("mounting is not allowed here")
    yield folder
    subprocess.run([umount, str(folder)], check=True)


def fill(folder):
    with (folder / "filler").open("wb", buffering=0) as file, contextlib.suppress(OSError):
        while True:
            file.write(b"x" * 1024)


def test_read_only_disk(run, write_stage, mounted):
    remount = ["mount", "-o", "remount,ro", str(mounted)]
    if subprocess.run(remount, capture_output=True).returncode != 0:
        pytest.skip("remounting is not allowed here")
    assert "a.exr" in run(write_stage(SOUND), out=mounted / "a.exr", code=1)


def test_full_disk(run, write_stage, mounted):
    stage = write_stage(SOUND)
    for name in ("a.exr", "a.png"):
        fill(mounted)
        assert name in run(stage, "-r", "200", "200", out=mounted / name, code=1)


def test_full_disk_for_statistics(write_stage, tmp_path, mounted):
    fill(mounted)
    argv = [COMMAND, "render", str(write_stage(SOUND)), "-o", str(tmp_path / "a.exr"), *SMALL]
    done = subprocess.run(
        [*argv, "--stats", str(mounted / "a.json")], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 1
    (error,) = done.stderr.splitlines()
    assert error.startswith("kilauea: error: cannot write")
    assert "a.json" in error
    assert [p.name for p in mounted.iterdir()] == ["filler"]


def test_an_older_picture_survives_a_full_disk(run, write_stage, mounted):
    out = mounted / "a.exr"
    out.write_bytes(b"older")
    fill(mounted)
    run(write_stage(SOUND), "-r", "200", "200", out=out, code=1)
    assert out.read_bytes() == b"older"


def test_interrupt(write_stage, tmp_path):
    out = tmp_path / "out" / "a.exr"
    out.parent.mkdir()
    argv = [COMMAND, "render", str(write_stage(SOUND)), "-o", str(out), "-p", "65536"]
    process = subprocess.Popen(
        [*argv, "-r", "1920", "1080", "-V", "2a"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    # Rendering is under way once progress is told.
    for line in process.stdout:
        if "ALF_PROGRESS" in line:
            break
    process.send_signal(signal.SIGINT)
    # The samples would take hours.
    _, err = process.communicate(timeout=120)
    assert process.returncode == 130
    assert "Traceback" not in err
    assert not list(out.parent.iterdir())


def test_usage(run, write_stage):
    stage = write_stage(SOUND)
    for flags in (
        ["-p", "0"],
        ["-p", "many"],
        ["-r", "0", "10"],
        ["-r", "-5", "10"],
        ["-r", "100000", "10"],
        ["--max-depth", "-1"],
        ["--frames", "1:"],
        ["--aov", "smell"],
        ["--filter", "cheese"],
    ):
        run(stage, *flags, code=2)
