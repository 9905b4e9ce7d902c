"""`kilauea console`."""

from __future__ import annotations

import io
import json
import socket
import stat
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest
from kilauea import cli, render
from kilauea.console import Console
from kilauea.console_socket import serve
from kilauea.errors import KilaueaError

SCENE = """
def Sphere "S" { token subdivisionScheme = "none" }
def SphereLight "L" { float inputs:intensity = 2; asset inputs:file = @a.png@ }
def Camera "C" {}
def Camera "D" {}
"""


class Engine:
    """Stands in for the native module and keeps what it was asked to build and render."""

    SceneError = RenderError = type("Error", (Exception,), {})

    def __init__(self) -> None:
        self.frames = []
        self.settings = []

    def build_scene(self, frame, _options):
        self.frames.append(frame)
        return SimpleNamespace(warnings=list, render=self.render)

    def render(self, settings, _metadata):
        self.settings.append(json.loads(settings))
        return SimpleNamespace(
            wait=lambda _: True,
            finish=lambda outputs: [Path(o).write_bytes(b"image") for o in outputs] and "{}",
        )


@pytest.fixture
def engine(monkeypatch):
    fake = Engine()
    monkeypatch.setattr(render, "native", lambda: fake)
    return fake


@pytest.fixture
def stage(write_stage) -> Path:
    return write_stage(SCENE)


@pytest.fixture
def console(engine, stage) -> Console:
    made = Console()
    made.open(str(stage))
    return made


def test_what_has_not_changed_is_not_made_again(console, engine, tmp_path) -> None:
    out = tmp_path / "a.exr"
    assert console.run(f"render -o {out} -p 4")["exit_code"] == 0
    assert console.run(f"render -o {out} -p 8 --max-depth 3")["exit_code"] == 0
    assert [s["samples_per_pixel"] for s in engine.settings] == [4, 8]
    assert len(engine.frames) == 1
    console.run(f"render -o {out} -c /D")
    console.run(f"render -o {out} -c /D --complexity low")
    paths = [frame.camera["path"] for frame in engine.frames]
    assert paths == ["/C", "/D", "/D"]
    assert engine.frames[1] is engine.frames[2]
    assert out.read_bytes() == b"image"


def test_edits_are_rendered_and_change_no_file(console, engine, stage, tmp_path) -> None:
    before = stage.read_text()
    assert console.run("get /L.inputs:intensity") == {"/L.inputs:intensity": "2.0"}
    console.run(f"render -o {tmp_path}/a.exr")
    assert console.run("set /L.inputs:intensity 6") == {"/L.inputs:intensity": "6.0"}
    console.run(f"render -o {tmp_path}/a.exr")
    dim, bright = (frame.lights[0]["radiance"][0] for frame in engine.frames)
    assert bright == pytest.approx(3 * dim)
    assert stage.read_text() == before
    stage.write_text(before.replace("intensity = 2", "intensity = 3"))
    console.run("reload")
    assert console.run("get /L.inputs:intensity") == {"/L.inputs:intensity": "6.0"}


def test_values_are_written_as_in_usd(console) -> None:
    for name, text, value in [
        ("/S.subdivisionScheme", "loop", "loop"),
        ("/S.subdivisionScheme", "'\"bilinear\"'", "bilinear"),
        ("/L.inputs:file", "b.png", "@b.png@"),
        ("/L.inputs:color", "'(1, 0.5, 0)'", "(1, 0.5, 0)"),
    ]:
        assert console.run(f"set {name} {text}") == {name: value}


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("paint", "unknown command 'paint'"),
        ("render 'a", "No closing quotation"),
        ("render b.usda -o a.exr", "b.usda: the stage that is open is rendered"),
        ("render --mask /S -o a.exr", "--mask is an option of the console"),
        ("render -p 0 -o a.exr", "not positive"),
        ("render", "no output"),
        ("open", "it is: open STAGE"),
        ("open none.usda", "none.usda"),
        ("get /L", "is not PRIM.ATTRIBUTE"),
        ("get L.inputs:intensity", "is not PRIM.ATTRIBUTE"),
        ("get /L.inputs:colour", "no attribute /L.inputs:colour"),
        ("set /L.inputs:intensity", "it is: set PRIM.ATTRIBUTE VALUE"),
        ("set /L.inputs:intensity bright", "'bright' is not of type float"),
        ("set /L.inputs:intensity '1 } def \"x\" {'", "is not of type float"),
    ],
)
def test_an_error_ends_no_more_than_its_command(console, line, message) -> None:
    with pytest.raises(KilaueaError, match=message.replace("(", r"\(")):
        console.run(line)
    assert console.run("get /L.inputs:intensity") == {"/L.inputs:intensity": "2.0"}


def test_nothing_can_be_done_without_a_stage() -> None:
    with pytest.raises(KilaueaError, match="no stage is open"):
        Console().run("render -o a.exr")


def test_commands_come_from_standard_input(engine, stage, tmp_path, monkeypatch, capsys) -> None:
    lines = (
        f"# a look\n\nrender -o {tmp_path}/a.exr\npaint\nget /L.inputs:intensity\nquit\nget /S.x\n"
    )
    monkeypatch.setattr(sys, "stdin", io.StringIO(lines))
    assert cli.main(["console", str(stage)]) == 0
    out, err = capsys.readouterr()
    assert "exit_code: 0" in out
    assert "/L.inputs:intensity: 2.0" in out
    assert (
        err
        == "kilauea: error: unknown command 'paint'; there are "
        + ", ".join(Console().run("help"))
        + "\n"
    )


def connect(file: Path) -> socket.socket:
    connection = socket.socket(socket.AF_UNIX)
    try:
        connection.connect(str(file))
    except OSError:
        connection.close()
        raise
    return connection


def ask(connection: socket.socket, line: str) -> dict:
    connection.sendall(line.encode() + b"\n")
    return json.loads(connection.makefile().readline())


def test_a_socket_answers_in_json_until_told_to_quit(console, tmp_path) -> None:
    file = tmp_path / "socket"
    # A console that was killed leaves its socket.
    with socket.socket(socket.AF_UNIX) as left:
        left.bind(str(file))
    server = threading.Thread(target=serve, args=(file, console), daemon=True)
    server.start()
    while True:
        try:
            first = connect(file)
            break
        except OSError:
            assert server.is_alive()
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert ask(first, f"render -o {tmp_path}/a.exr")["ok"]
    assert ask(first, "open none.usda")["code"] == 3
    with pytest.raises(KilaueaError, match="a console listens"):
        serve(file, Console())
    first.close()
    # The next is served once the one before has gone.
    with connect(file) as second:
        assert ask(second, "get /L.inputs:intensity") == {"ok": True, "/L.inputs:intensity": "2.0"}
        assert ask(second, "quit") == {"ok": True}
    server.join(10)
    assert not file.exists()


def test_a_file_is_not_taken_for_a_socket(tmp_path) -> None:
    file = tmp_path / "notes"
    file.write_text("mine")
    with pytest.raises(KilaueaError, match="is no socket"):
        serve(file, Console())
    assert file.read_text() == "mine"
