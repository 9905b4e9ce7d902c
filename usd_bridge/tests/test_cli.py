from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path
from types import SimpleNamespace

import pytest
from kilauea import cli, render
from kilauea.clock import process_age

SCENE = 'def Sphere "S" {} def SphereLight "L" {} def Camera "C" {}'


class FakeJob:
    def __init__(self, engine):
        self.engine = engine

    def wait(self, _timeout):
        return True

    def finish(self, outputs):
        for name in outputs:
            Path(name).write_bytes(b"image")
        return json.dumps(self.engine.stats)


class FakeEngine:
    """Stands in for the native module and keeps what it was given."""

    class SceneError(Exception):
        pass

    class RenderError(Exception):
        pass

    def __init__(self):
        self.settings = []
        self.metadata = []
        self.options = {}
        self.frames = []
        self.stats = {
            "samples_per_pixel": 8,
            "times": {"render": 2.0},
            "rays": {"camera": 1_000_000, "shadow": 3_000_000},
            "warnings": [],
        }

    def build_scene(self, frame, options_json):
        self.frames.append(frame)
        self.options = json.loads(options_json)
        return SimpleNamespace(warnings=lambda: ["/S is odd"], render=self.render)

    def render(self, settings_json, metadata_json):
        self.settings.append(json.loads(settings_json))
        self.metadata.append(json.loads(metadata_json))
        return FakeJob(self)


@pytest.fixture
def engine(monkeypatch):
    fake = FakeEngine()
    monkeypatch.setattr(render, "native", lambda: fake)
    return fake


@pytest.fixture
def stage(write_stage):
    return str(write_stage(SCENE))


def test_flags_reach_the_engine(engine, stage, tmp_path, capsys):
    out, stats_file = tmp_path / "a.exr", tmp_path / "a.json"
    flags = ["-r", "40", "20", "-p", "9", "--max-depth", "3", "--seed", "5", "--filter", "box"]
    flags += ["-j", "2", "--aov", "depth", "albedo", "--complexity", "high", "-f", "12"]
    flags += ["--noise", "0.05"]
    flags += ["--timelimit", "1000", "--shading", "queued", "--shade-memory", "8"]
    age = process_age()
    assert cli.main(["render", stage, "-o", str(out), "--stats", str(stats_file), *flags]) == 0
    settings = engine.settings[0]
    assert settings["resolution"] == [40, 20]
    assert settings["samples_per_pixel"] == 9
    assert settings["noise"] == 0.05
    assert settings["max_depth"] == 3
    assert settings["seed"] == 5
    assert settings["filter"] == "box"
    assert settings["threads"] == 2
    assert settings["aovs"] == ["Z", "albedo"]
    assert settings["shading"] == "queued"
    assert settings["shade_memory_bytes"] == 8 << 20
    # A little is kept back for writing.
    assert 999 - process_age() < settings["time_limit_secs"] <= 1000 - age
    assert settings.keys() == render.DEFAULTS.keys()
    assert engine.options["max_subdivision_level"] == 2
    assert engine.options["resolution"] == [40, 20]
    assert engine.frames[0].time == 12
    assert engine.metadata[0]["camera"] == "/C"
    assert engine.metadata[0]["warnings"] == ["/S is odd"]
    stats = json.loads(stats_file.read_text())
    assert stats["times"].keys() == {"render", "load", "total"}
    assert stats["warnings"] == ["/S is odd"]
    assert stats["missing"] == []
    captured = capsys.readouterr()
    assert "2.00 Mrays/s" in captured.out
    assert str(out) in captured.out
    assert "kilauea: warning: /S is odd" in captured.err


def test_husk_and_usdrecord_spellings(engine, stage, tmp_path, capsys):
    out = tmp_path / "a.exr"
    husk = f"""--usd-input {stage} --res-scale 50 --purpose geometry,render --engine cpu
        --bucket-size 32 --fast-exit --vendor:thing 3 -V 1""".split()
    assert cli.main(["render", *husk, "-o", str(out), "-r", "100", "50"]) == 0
    assert engine.settings[0]["resolution"] == [50, 25]
    err = capsys.readouterr().err
    assert "--bucket-size" in err
    assert "--vendor:thing" in err
    usdrecord = ["--imageWidth", "200", "-cam", "/C", "--renderer", "Storm", "--disableGpu"]
    usdrecord += ["--frames", "1:2"]
    pattern = str(tmp_path / "b.####.exr")
    assert cli.main(["render", stage, pattern, *usdrecord]) == 0
    assert engine.settings[1]["resolution"] == [200, 146]
    assert sorted(p.name for p in tmp_path.glob("b.*")) == ["b.0001.exr", "b.0002.exr"]


def test_environment_gives_defaults(engine, stage, tmp_path, monkeypatch):
    monkeypatch.setenv("KILAUEA_MAX_DEPTH", "7")
    monkeypatch.setenv("KILAUEA_RES", "8 4")
    monkeypatch.setenv("KILAUEA_PIXEL_SAMPLES", "3")
    monkeypatch.setenv("KILAUEA_DISABLE_SCENE_LIGHTS", "1")
    assert cli.main(["render", stage, "-o", str(tmp_path / "a.exr"), "-p", "5"]) == 0
    assert engine.settings[0]["max_depth"] == 7
    assert engine.settings[0]["resolution"] == [8, 4]
    assert engine.settings[0]["samples_per_pixel"] == 5
    assert [x["path"] for x in engine.frames[0].lights] == ["<default light>"]
    monkeypatch.setenv("KILAUEA_MAX_DEPTH", "deep")
    assert cli.main(["render", stage, "-o", str(tmp_path / "a.exr")]) == 2


def test_product_name_is_the_default_output(engine, write_stage, tmp_path):
    file = write_stage(
        SCENE
        + f"""def RenderSettings "R" {{ rel products = </R/P>
            def RenderProduct "P" {{ token productName = "{tmp_path}/shot.$F4.png" }} }}""",
        header='renderSettingsPrimPath = "/R"; startTimeCode = 5; endTimeCode = 9',
    )
    assert cli.main(["render", str(file), "-n", "2", "-i", "2"]) == 0
    assert sorted(p.name for p in tmp_path.glob("*.png")) == ["shot.0005.png", "shot.0007.png"]


@pytest.mark.parametrize(
    ("argv", "code", "message"),
    [
        (["render"], 2, "no stage"),
        (["render", "STAGE"], 2, "no output"),
        (["render", "STAGE", "-o", "DIR/a.tif"], 2, "a.tif"),
        (["render", "STAGE", "-o", "DIR/a.exr", "-n", "2"], 2, "more than once"),
        (["render", "STAGE", "-o", "DIR/a.exr", "-c", "/None"], 2, "/None"),
        (["render", "STAGE", "-o", "DIR/a.exr", "-p", "0"], 2, "not positive"),
        (["render", "STAGE", "-o", "DIR/a.exr", "--noise", "0"], 2, "relative error"),
        (["render", "STAGE", "-o", "DIR/a.exr", "--aov", "smell"], 2, "smell"),
        (
            ["render", "STAGE", "-o", "DIR/a.exr", "--cluster", "auto", "--workers", "2"],
            2,
            "not both",
        ),
        (["render", "STAGE", "-o", "DIR/a.exr", "--workers", "0"], 2, "not positive"),
        (["render", "STAGE", "-o", "DIR/a.exr", "--resume"], 2, "--workers"),
        (["render", "STAGE", "-o", "DIR/a.exr", "--set-size", "2"], 2, "--workers"),
        (["render", "STAGE", "-o", "DIR/a.exr", "--worker-memory", "4Q"], 2, "4G"),
        (
            ["render", "STAGE", "-o", "DIR/a.exr", "--workers", "2", "--broadcast", "full"],
            2,
            "--set-size",
        ),
        (["render", "STAGE", "-o", "DIR/none/a.exr"], 1, "does not exist"),
        (["render", "DIR/none.usda", "-o", "DIR/a.exr"], 3, "none.usda"),
        (["render", "DIR/broken.usda", "-o", "DIR/a.exr"], 3, "broken.usda:2"),
        (["render", "DIR/missing.usda", "-o", "DIR/a.exr", "--strict"], 4, "gone.usda"),
        (["render", "DIR/hair.usda", "-o", "DIR/a.exr", "--strict"], 4, "BasisCurves"),
        (["worker", "--threads", "2"], 2, "--threads"),
        (["nonsense"], 2, "nonsense"),
        ([], 2, "COMMAND"),
    ],
)
def test_exit_codes(engine, write_stage, tmp_path, capsys, argv, code, message):
    write_stage('def Xform "X" (references = @gone.usda@) {}', name="missing.usda")
    write_stage(SCENE + ' def BasisCurves "H" {}', name="hair.usda")
    (tmp_path / "broken.usda").write_text("#usda 1.0\nnonsense")
    names = {"STAGE": str(write_stage(SCENE)), "DIR": str(tmp_path)}
    words = []
    for word in argv:
        for name, value in names.items():
            word = word.replace(name, value)
        words.append(word)
    assert cli.main(words) == code
    errors = [x for x in capsys.readouterr().err.splitlines() if "error" in x]
    assert len(errors) == 1
    assert errors[0].startswith("kilauea: error: ")
    assert message in errors[0]
    assert not list(tmp_path.glob("*.exr"))
    assert not engine.settings


def test_missing_is_a_warning_without_strict(engine, write_stage, tmp_path, capsys):
    file = write_stage(SCENE + 'def Xform "X" (references = @gone.usda@) {}')
    assert cli.main(["render", str(file), "-o", str(tmp_path / "a.exr")]) == 0
    assert "kilauea: warning: missing: " in capsys.readouterr().err
    assert any("gone.usda" in w for w in engine.metadata[0]["warnings"])


def test_time_limit_before_one_pass(engine, stage, tmp_path):
    engine.stats["full_passes"] = 0
    out = tmp_path / "a.exr"
    assert cli.main(["render", stage, "-o", str(out), "--timelimit", "0.001"]) == 5
    assert engine.settings[0]["time_limit_secs"] > 0
    assert out.exists()


def test_time_for_writing_is_kept_back(engine, stage, tmp_path):
    limits = []
    for width in ("100", "4000"):
        argv = ["render", stage, "-o", str(tmp_path / "a.exr"), "-r", width, "1000"]
        assert cli.main([*argv, "--timelimit", "1000"]) == 0
        limits.append(engine.settings[-1]["time_limit_secs"])
    assert limits[0] - limits[1] > 3.9e6 * render._WRITE_SECS_PER_PIXEL * 0.99


def test_engine_errors_are_one_line(engine, stage, tmp_path, capsys, monkeypatch):
    def refuse(*_):
        raise engine.SceneError("/S: points has 3 values,\n expected 4")

    monkeypatch.setattr(engine, "build_scene", refuse)
    assert cli.main(["render", stage, "-o", str(tmp_path / "a.exr")]) == 1
    last = capsys.readouterr().err.splitlines()[-1]
    assert last == "kilauea: error: /S: points has 3 values, expected 4"


def test_many_warnings_are_cut(engine, write_stage, tmp_path, capsys):
    gone = "".join(f'def Xform "X{i}" (references = @gone{i}.usda@) {{}}' for i in range(30))
    file = write_stage(SCENE + gone)
    assert cli.main(["render", str(file), "-o", str(tmp_path / "a.exr")]) == 0
    lines = [x for x in capsys.readouterr().err.splitlines() if "missing" in x or "more" in x]
    assert len(lines) == 21
    assert lines[-1] == "kilauea: warning: and 10 more"


def test_make_output_path(engine, stage, tmp_path):
    out = tmp_path / "new" / "folder" / "a.exr"
    assert cli.main(["render", stage, "-o", str(out), "--make-output-path"]) == 0
    assert out.exists()


def test_translate_is_json(write_stage, capsys):
    points = ", ".join(f"({i}, 0, 0)" for i in range(20))
    file = write_stage(
        f"""def Mesh "M" {{ point3f[] points = [{points}]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2] }}"""
    )
    assert cli.main(["translate", str(file), "--dump"]) == 0
    (mesh,) = json.loads(capsys.readouterr().out)["meshes"]
    assert mesh["points"]["shape"] == [20, 3]
    assert (mesh["points"]["min"], mesh["points"]["max"]) == (0, 19)
    assert mesh["face_vertex_indices"] == [0, 1, 2]


@pytest.mark.parametrize("phase", ["build", "render"])
def test_interrupt_leaves_no_file(stage, tmp_path, phase):
    program = textwrap.dedent(
        """
        import sys, time, types
        phase, stage, out = sys.argv[1:]

        class Job:
            def wait(self, timeout):
                print("waiting", flush=True)
                time.sleep(timeout)
                return False
            def progress(self):
                return 0.5, 3.0
            def cancel(self):
                pass

        def build_scene(frame, options):
            if phase == "build":
                print("building", flush=True)
                time.sleep(3600)
            return types.SimpleNamespace(warnings=list, render=lambda s, m: Job())

        class Error(Exception):
            pass

        sys.modules["kilauea._native"] = types.SimpleNamespace(
            build_scene=build_scene, SceneError=Error, RenderError=Error)
        from kilauea.cli import main
        sys.exit(main(["render", stage, "-o", out]))
        """
    )
    out = tmp_path / "a.exr"
    package = Path(cli.__file__).parents[1]
    process = subprocess.Popen(
        [sys.executable, "-c", program, phase, stage, str(out)],
        env={**os.environ, "PYTHONPATH": str(package)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    process.stdout.readline()
    process.send_signal(signal.SIGINT)
    # Who does not stop at once goes on for an hour.
    _, err = process.communicate(timeout=120)
    assert process.returncode == 130
    assert "Traceback" not in err
    assert list(tmp_path.glob("*.exr*")) == []
