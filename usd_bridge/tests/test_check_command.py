"""`kilauea check` as scripts see it: exit codes, one-line errors, and what a report holds."""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import stat
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import OpenImageIO as oiio
import pytest

pytest.importorskip("kilauea._native")

from kilauea import cli
from kilauea.checking.report.pixels import DIVERGING, coloured, displayed, png
from kilauea.checking.stored import read_reference

ROOT = Path(__file__).parents[2]
COMMAND = Path(sys.executable).with_name("kilauea")
DISK = ROOT / "tests/scenes/focused_disk.usda"
BOX = ROOT / "tests/scenes/box_rect_light.usda"
REFERENCE = ROOT / "tests/references/focused_disk.exr"
QUICK = ["-p", "64", "-V", "1", "--threshold", "image=5%", "image-bias=20%", "tile-bias=off"]
FINDINGS = ["finite", "image", "tiles", "shift", "looks", "noise", "power"]


def check(*words: object, code: int, env: dict[str, str] | None = None):
    done = subprocess.run(
        [COMMAND, "check", *map(str, words)],
        capture_output=True,
        text=True,
        timeout=240,
        env={**os.environ, **(env or {})},
    )
    assert done.returncode == code, done.stdout + done.stderr
    return done


def error_line(capsys, *words: object, code: int) -> str:
    """Run the command in this process, to spare the start of another."""
    assert cli.main(["check", *map(str, words)]) == code
    (line,) = [ln for ln in capsys.readouterr().err.splitlines() if "warning" not in ln]
    assert line.startswith("kilauea: error: ")
    return line


@pytest.fixture(scope="module")
def report(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("check") / "report"
    check(DISK, "--against", REFERENCE, "--report", folder, *QUICK, code=0)
    return folder


def test_a_report_has_its_files(report: Path) -> None:
    names = ["check.json", "index.html", "junit.xml", "ours.exr", "reference.exr"]
    assert sorted(f.name for f in report.iterdir()) == names
    # Nothing is left of the name under which it was written.
    assert [f.name for f in report.parent.iterdir()] == ["report"]


def test_the_record_is_complete(report: Path) -> None:
    record = json.loads((report / "check.json").read_text())
    assert record["verdict"] == "pass"
    assert [f["name"] for f in record["findings"]] == FINDINGS
    assert record["rounds"] == [16, 64]
    assert record["reference"]["engine"].startswith("Cycles ")
    assert record["settings"]["resolution"] == [48, 48]
    assert record["thresholds"]["image"] == 0.05
    assert record["thresholds"]["tile_bias"] is None
    assert np.shape(record["tiles"]["difference"]) == (6, 6, 3)
    assert record["command"].startswith("kilauea check ")


def test_junit_has_a_case_for_each_finding(report: Path) -> None:
    suite = ElementTree.parse(report / "junit.xml").getroot()
    assert [case.get("name") for case in suite.iter("testcase")] == FINDINGS
    assert (suite.get("tests"), suite.get("failures")) == ("7", "0")


class Page(HTMLParser):
    """Collects what a page loads, and whether its elements are closed."""

    def __init__(self) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag, attrs) -> None:
        self.loaded += [v for k, v in attrs if k in ("src", "href", "data", "srcset") and v]
        if tag not in ("meta", "img", "input", "link", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag) -> None:
        assert self.open.pop() == tag


def test_the_page_needs_nothing_else(report: Path, tmp_path: Path) -> None:
    text = (report / "index.html").read_text()
    page = Page()
    page.feed(text)
    assert page.open == []
    assert "$" not in re.sub(r"<script>.*</script>", "", text, flags=re.DOTALL)
    assert not re.search(r"url\(|@import|https?://", text)
    assert len(page.loaded) == 4
    for idx, uri in enumerate(page.loaded):
        file = tmp_path / f"{idx}.png"
        file.write_bytes(base64.b64decode(uri.removeprefix("data:image/png;base64,")))
        image = oiio.ImageBuf(str(file))
        assert (image.spec().width, image.spec().height) == (48, 48)
    ours, reference = (oiio.ImageBuf(str(tmp_path / f"{i}.png")).get_pixels() for i in (1, 0))
    assert ours.mean() == pytest.approx(reference.mean(), rel=0.02)
    assert text.count("<title>tile column") == 36


def test_a_difference_is_exit_code_1_and_a_former_report_is_replaced(
    report: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "report"
    shutil.copytree(report, folder)
    done = check(BOX, "--against", REFERENCE, "--report", folder, *QUICK, code=1)
    assert done.stdout.splitlines()[-1].split() == ["fail", str(BOX)]
    record = json.loads((folder / "check.json").read_text())
    assert record["verdict"] == "fail"
    suite = ElementTree.parse(folder / "junit.xml").getroot()
    failures = [
        case.get("name") for case in suite.iter("testcase") if case.find("failure") is not None
    ]
    assert "image" in failures
    assert suite.get("failures") == str(len(failures))


def test_doubt_is_exit_code_1_too() -> None:
    flags = ["-p", "64", "-V", "1", "--threshold", "image=5%", "image-bias=5.1%", "tile-bias=off"]
    done = check(DISK, "--against", REFERENCE, *flags, code=1)
    assert done.stdout.splitlines()[-1].startswith("inconclusive")


def no_image(folder: Path) -> Path:
    file = folder / "broken.exr"
    file.write_text("no image")
    return file


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        ([DISK, "--against", "missing.exr"], 2, "missing.exr does not exist"),
        ([DISK, "--against", no_image], 2, "broken.exr"),
        (
            [DISK, "--against", REFERENCE, "-r", "64", "48"],
            2,
            "resolution of 48x48, which is not 64x48",
        ),
        ([DISK, "--against", REFERENCE, "--max-depth", "3"], 2, "max depth 16, which is not 3"),
        (["missing.usda", "--against", REFERENCE], 3, "missing.usda"),
        ([DISK, "--against", REFERENCE, "--frames", "1:3"], 2, "one frame, not 3"),
        ([DISK, "--against", REFERENCE, "--batches", "2"], 2, "at least 4"),
        ([DISK, "--against", REFERENCE, "-p", "8"], 2, "do not suffice for 16 batches"),
        ([DISK, "--against", REFERENCE, "--threshold", "image=x"], 2, "image=x"),
        ([DISK, "--against", REFERENCE, "--report", "/none/report"], 2, "/none does not exist"),
        ([DISK, "--against", REFERENCE, "--report", ROOT], 2, "is no report: it is not replaced"),
        ([DISK, "--against", REFERENCE, "--write-reference", "a.exr"], 2, "--against cycles"),
        ([DISK, "--write-reference", "a.png"], 2, "written as .exr"),
        ([DISK, "--nonsense"], 2, "--nonsense"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_keeps_a_check_from_being_made(words, code, message, tmp_path, capsys) -> None:
    words = [word(tmp_path) if callable(word) else word for word in words]
    assert message in error_line(capsys, *words, code=code)


def test_without_cycles_nothing_is_rendered(tmp_path: Path, capsys, monkeypatch) -> None:
    monkeypatch.setenv("KILAUEA_REFERENCE_PYTHON", str(tmp_path / "none"))
    line = error_line(capsys, DISK, "--report", tmp_path / "report", code=2)
    assert "KILAUEA_REFERENCE_PYTHON" in line
    assert list(tmp_path.iterdir()) == []


STAND_IN = """#!{python}
import json, sys, numpy as np, OpenImageIO as oiio
words = sys.argv[1:]
folder, out = words[1:3]
flags = dict(zip(words[3::2], words[4::2]))
scene = json.load(open(folder + "/scene.json"))
width, height = scene["settings"]["resolution"]
for idx in range(int(flags["--batches"])):
    rng = np.random.default_rng(int(flags["--seed"]) + idx)
    image = oiio.ImageBuf(oiio.ImageSpec(width, height, 3, oiio.FLOAT))
    pixels = 1.0 + 0.01 * rng.standard_normal((height, width, 3))
    image.set_pixels(oiio.ROI.All, pixels.astype(np.float32))
    assert image.write(out.replace(".exr", f".{{idx}}.exr"))
stats = {{"engine": "Stand-in 1", "warnings": ["no such light"], "render_s": 1.5}}
json.dump(stats, open(flags["--stats"], "w"))
"""


def test_cycles_is_asked_for_batches_and_kept_as_a_reference(tmp_path: Path) -> None:
    """With a stand-in that renders grey, which no stage looks like."""
    python = tmp_path / "python"
    python.write_text(STAND_IN.format(python=sys.executable))
    python.chmod(python.stat().st_mode | stat.S_IXUSR)
    kept, record = tmp_path / "kept.exr", tmp_path / "check.json"
    flags = ["-r", "24", "16", "--batches", "8", "-p", "64", "-V", "1"]
    flags += ["--write-reference", kept, "--json", record]
    check(DISK, *flags, code=1, env={"KILAUEA_REFERENCE_PYTHON": str(python)})
    found = json.loads(record.read_text())["reference"]
    assert (found["engine"], found["warnings"]) == ("Stand-in 1", ["no such light"])
    assert (found["batches"], found["samples_per_pixel"]) == (8, 64)
    # Eight independent seeds.
    assert found["variance_of_a_pixel"] == pytest.approx(1e-4 / 8, rel=0.15)
    reference = read_reference(kept)
    assert reference.settings["resolution"] == [24, 16]
    assert reference.settings["filter"] == "box"
    assert reference.image.mean.mean() == pytest.approx(1.0, abs=0.01)


def test_png_is_read_as_it_was_written(tmp_path: Path) -> None:
    image = np.random.default_rng(1).integers(0, 256, (5, 7, 3), np.uint8)
    (tmp_path / "a.png").write_bytes(png(image))
    read = oiio.ImageBuf(str(tmp_path / "a.png")).get_pixels(oiio.UINT8)
    assert (read == image).all()


def test_colours_mean_what_the_page_says() -> None:
    darker, equal, brighter = coloured(np.array([-9.0, 0.0, 9.0]), DIVERGING, -6.0, 6.0)
    assert darker[2] > darker[0]
    assert np.ptp(equal) == 0
    assert brighter[0] > brighter[2]
    # IEC 61966-2-1: linear 0.2140 is 50 % of the code values.
    assert displayed(np.array([0.0, 0.107_02, 9.0]), 2.0).tolist() == [0, 127, 255]


def test_the_recipe_runs_every_stage_of_a_list(tmp_path: Path) -> None:
    """With a stand-in for the command that fails for one stage."""
    command = tmp_path / "bin/kilauea"
    command.parent.mkdir()
    command.write_text('#!/bin/sh\necho "$@" >> "$LOG"\ncase $2 in bad*) exit 1 ;; esac\n')
    command.chmod(0o755)
    stages = tmp_path / "stages.txt"
    stages.write_text("# comment\n\na/one.usda -c cam --threshold image=1%\nbad.usda\nlast.usd")
    log = tmp_path / "log"
    env = {**os.environ, "PATH": f"{command.parent}:{os.environ['PATH']}", "LOG": str(log)}
    script = ROOT / "pipeline/ci/check_stages.sh"

    def run(*words: object) -> int:
        return subprocess.run([script, *map(str, words)], env=env, check=False).returncode

    assert run(stages, tmp_path / "reports", "-j", "2") == 1
    assert log.read_text().splitlines() == [
        f"check a/one.usda --report {tmp_path}/reports/01-one -c cam --threshold image=1% -j 2",
        f"check bad.usda --report {tmp_path}/reports/02-bad -j 2",
        f"check last.usd --report {tmp_path}/reports/03-last -j 2",
    ]
    stages.write_text("# nothing\n")
    assert run(stages, tmp_path / "reports") == 2
    assert run(tmp_path / "none", tmp_path / "reports") == 2
