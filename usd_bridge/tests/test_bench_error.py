"""`kilauea bench error` with engines that are fakes: images of known noise, at known speeds."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from kilauea import cli
from kilauea.benchmarks import converged, engines, error, measurement
from kilauea.benchmarks.engines import Run
from kilauea.benchmarks.image_error import write_pixels
from kilauea.benchmarks.job import Job
from kilauea.benchmarks.pace import Pace, pilot
from kilauea.errors import KilaueaError

BOX = Path(__file__).resolve().parents[2] / "tests/scenes/box_rect_light.usda"
SIZE = 32
DEVIATION = {"path": 0.1, "cycles": 0.2, "mitsuba": 0.2, "luxcore": 0.1}
OFFSET = {"luxcore": 0.3}
PER_SAMPLE_S = 0.5


def fake_run(engine: str, image: Path, samples: int, seconds: float) -> Run:
    return Run(
        engine,
        version=f"{engine} 1.0",
        image=image,
        samples_per_pixel=samples,
        load_s=0.75,
        build_s=0.25,
        render_s=seconds,
        total_s=seconds + 1.0,
        cpu_s=2.0 * seconds + 1.0,
        peak_rss=1_000_000,
        n_rays=None,
        warnings=[],
    )


def fake_render(engine: str, job: Job, samples: int, seed: int) -> Run:
    if engine == "kilauea":
        raise KilaueaError("not built yet")
    generator = np.random.default_rng([seed, samples, *engine.encode()])
    deviation = DEVIATION[engine] / np.sqrt(samples)
    pixels = generator.normal(1.0 + OFFSET.get(engine, 0.0), deviation, (SIZE, SIZE, 3))
    image = job.folder / f"{engine}-{samples}-{seed}.exr"
    write_pixels(image, pixels)
    return fake_run(engine, image, samples, PER_SAMPLE_S * samples)


@pytest.fixture
def bench(monkeypatch, tmp_path) -> Callable[..., dict]:
    """Run the command and return what it wrote."""
    monkeypatch.setenv("KILAUEA_CACHE", str(tmp_path / "cache"))
    for module in (engines, error, measurement, converged.engines):
        if hasattr(module, "render"):
            monkeypatch.setattr(module, "render", fake_render)

    def run(*words: str) -> dict:
        target = tmp_path / "rows.json"
        command = ["bench", "error", str(BOX), "-r", str(SIZE), str(SIZE), "--json", str(target)]
        command += ["--reference-time", "200", "--reference-seeds", "4", *words]
        assert cli.main(command) == 0
        return json.loads(target.read_text())

    return run


def test_half_the_deviation_is_a_quarter_of_the_error(bench, tmp_path) -> None:
    words = ("--engines", "kilauea,path,cycles,mitsuba", "--times", "3,9", "--seeds", "3")
    report = bench(
        *words, "--pictures", str(tmp_path / "strips"), "--table", str(tmp_path / "t.md")
    )
    found = {line["engine"]: line for line in report["summary"]}
    assert found["path"]["ratio_render_s"] == pytest.approx(0.25, rel=0.1)
    assert found["path"]["ratio_seconds"] == pytest.approx(0.25, rel=0.1)
    assert found["path"]["variance"] == pytest.approx(0.01 / 16.0 / 1.01, rel=0.1)
    assert found["path"]["bias_squared"] == pytest.approx(0.0, abs=5e-5)
    assert found["cycles"]["slope"] == pytest.approx(-1.0, abs=0.1)
    (stage,) = report["stages"]
    assert stage["reference"]["by"] == ["cycles", "mitsuba"]
    assert stage["skipped"] == {"kilauea": "not built yet"}
    # A command of 3 s has 2 s for rendering, which are 4 samples; one of 9 s has 16.
    counts = [row["samples_per_pixel"] for row in report["rows"] if row["engine"] == "path"]
    assert counts == [4, 4, 4, 16, 16, 16]
    promised = "stage engine seconds seed relMSE MSE samples_per_pixel build_s render_s peak_rss"
    assert set(promised.split()) <= report["rows"][0].keys()
    assert (tmp_path / "strips/box_rect_light.jpg").stat().st_size > 0
    assert "| box_rect_light | path | 16 |" in (tmp_path / "t.md").read_text()


def test_a_biased_engine_is_found_out(bench) -> None:
    report = bench("--engines", "path,cycles,luxcore", "-p", "4,16", "--seeds", "2")
    found = {line["engine"]: line for line in report["summary"]}
    (stage,) = report["stages"]
    assert stage["reference"]["by"] == ["cycles", "path"]
    first = stage["reference"]["tests"][0]
    assert first["engines"] == ["cycles", "luxcore"]
    assert not first["agrees"]
    assert found["luxcore"]["bias_squared"] == pytest.approx(0.09 / 1.01, rel=0.02)
    assert found["cycles"]["bias_squared"] == pytest.approx(0.0, abs=5e-4)


def test_a_stage_is_named_by_the_camera_that_was_chosen(bench, capsys) -> None:
    words = ("--engines", "path,cycles", "-p", "2", "--seeds", "2")
    report = bench(*words, "--camera", "/World/Camera")
    assert {row["stage"] for row in report["rows"]} == {"box_rect_light-Camera"}
    assert cli.main(["bench", "error", str(BOX), *words, "-c", "Nowhere"]) == 1
    assert "Nowhere" in capsys.readouterr().err


def test_where_none_agree_each_is_measured_against_itself(bench) -> None:
    report = bench("--engines", "cycles,luxcore", "-p", "4", "--seeds", "2")
    assert {row["reference"] for row in report["rows"]} == {"own"}
    assert all(row["bias_squared"] is None for row in report["rows"])
    assert report["rows"][-1]["relMSE"] < 0.01


def test_converged_images_are_made_once(bench, capsys) -> None:
    words = ("--engines", "path,cycles", "-p", "2", "--seeds", "2")
    bench(*words)
    assert "to converge" in capsys.readouterr().err
    bench(*words)
    assert "to converge" not in capsys.readouterr().err
    bench(*words, "--max-depth", "3")
    assert "to converge" in capsys.readouterr().err


def test_stages_that_are_not_measured_are_kept(bench, tmp_path) -> None:
    words = ("--engines", "path,cycles", "-p", "2", "--seeds", "2")
    report = bench(*words)
    hall = report | {
        "rows": [row | {"stage": "hall"} for row in report["rows"]],
        "stages": [stage | {"stage": "hall"} for stage in report["stages"]],
    }
    (tmp_path / "rows.json").write_text(json.dumps(hall))
    report = bench(*words, "--keep")
    assert [stage["stage"] for stage in report["stages"]] == ["hall", "box_rect_light"]
    again = bench("--engines", "path", "-p", "4", "--seeds", "2", "--keep")
    assert [stage["stage"] for stage in again["stages"]] == ["hall", "box_rect_light"]
    engines = {(line["stage"], line["engine"]) for line in again["summary"]}
    assert engines == {("hall", "path"), ("hall", "cycles"), ("box_rect_light", "path")}
    assert {stage["machine"]["date"] for stage in again["stages"]} == {report["machine"]["date"]}
    assert bench(*words)["stages"][0]["stage"] == "box_rect_light"
    (tmp_path / "rows.json").write_text("[]")
    assert (
        cli.main(["bench", "error", str(BOX), "--json", str(tmp_path / "rows.json"), "--keep"]) == 1
    )


@pytest.mark.parametrize("words", [["--engines", "arnold"], ["--times", "0"], ["--times", "x"]])
def test_refuses_what_means_nothing(words: list[str]) -> None:
    assert cli.main(["bench", "error", str(BOX), *words]) == 2


def test_variance_needs_two_seeds() -> None:
    assert cli.main(["bench", "error", str(BOX), "--seeds", "1"]) == 2


@pytest.mark.parametrize(("clock", "seconds", "samples"), [("wall", 6.0, 10), ("cpu", 6.0, 5)])
def test_pace_counts_what_is_fixed(clock: str, seconds: float, samples: int) -> None:
    def run(count: int) -> Run:
        return fake_run("path", Path("x"), count, PER_SAMPLE_S * count)

    pace, last = pilot(run, clock)
    assert pace.samples_in(seconds) == samples
    assert pace.samples_in(0.5) == 0
    assert last.render_s >= 1.0
    assert pace == Pace(pytest.approx(1.0), pytest.approx(pace.per_sample_s))


def test_plots_have_a_chart_for_each_stage(tmp_path) -> None:
    pytest.importorskip("matplotlib")
    from kilauea.benchmarks import plot

    rows = [
        {
            "stage": stage,
            "engine": engine,
            "samples_asked": int(4 * seconds),
            "seconds": seconds,
            "relMSE": 1.0 / seconds,
            "relMSE_of_reference": 0.0,
        }
        for stage in ("one", "two")
        for engine in ("path", "cycles")
        for seconds in (1.0, 2.0)
    ]
    plot.write(rows, tmp_path / "plot")
    assert (tmp_path / "plot.png").read_bytes().startswith(b"\x89PNG")
    first = (tmp_path / "plot.svg").read_bytes()
    plot.write(rows, tmp_path / "plot")
    assert (tmp_path / "plot.svg").read_bytes() == first
