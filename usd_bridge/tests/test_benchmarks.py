from __future__ import annotations

import json
import stat

import pytest
from kilauea import environments
from kilauea.benchmarks import error, report, samples
from kilauea.benchmarks.engines import Job, Run
from kilauea.errors import KilaueaError


def error_row(engine: str, samples_per_pixel: int, render_s: float, mse: float) -> dict:
    return {
        "stage": "box.usda",
        "engine": engine,
        "samples_per_pixel": samples_per_pixel,
        "render_s": render_s,
        "MSE": mse,
        "relMSE": 2.0 * mse,
    }


def test_slope_and_efficiency_of_a_power_law() -> None:
    rows = [error_row("path", n, 0.5 * n, 3.0 / n) for n in (1, 4, 16)]
    rows += [error_row("cycles", n, 0.25 * n, 8.0 / n**2) for n in (1, 4, 16)]
    path, cycles = error.fits("box.usda", rows)
    assert path["slope"] == pytest.approx(-1.0)
    assert path["efficiency"] == pytest.approx(1.0 / 1.5)
    assert path["relMSE_times_s"] == pytest.approx(3.0)
    assert cycles["slope"] == pytest.approx(-2.0)


def test_a_single_point_has_no_slope() -> None:
    assert error.fits("box.usda", [error_row("path", 1, 1.0, 1.0)])[0]["slope"] is None


def test_rates_are_medians_over_rounds(tmp_path) -> None:
    job = Job("box.usda", tmp_path, {"resolution": [100, 50], "max_depth": 3})
    runs = [Run("path", tmp_path, 4, 0.1, seconds, seconds, 7) for seconds in (1.0, 2.0, 20.0)]
    row = samples.row(job, "path", runs)
    assert row["Msamples_per_s"] == pytest.approx(0.01)
    assert (row["slowest"], row["fastest"]) == pytest.approx((0.001, 0.02))


def test_json_names_the_machine(tmp_path) -> None:
    target = tmp_path / "rows.json"
    report.write_json(str(target), [{"a": 1}], skipped=["b"])
    written = json.loads(target.read_text())
    assert written["rows"] == [{"a": 1}]
    assert written["skipped"] == ["b"]
    assert written["machine"]["cores"] >= 1


def test_an_interpreter_by_name_is_taken_as_it_is(tmp_path, monkeypatch) -> None:
    python = tmp_path / "python"
    monkeypatch.setenv("KILAUEA_REFERENCE_PYTHON", str(python))
    with pytest.raises(KilaueaError, match="does not exist"):
        environments.CYCLES.python()
    python.touch()
    assert environments.CYCLES.python() == python


def test_an_environment_is_made_once(tmp_path, monkeypatch) -> None:
    """With a stand-in for Python that makes what venv and pip would."""
    monkeypatch.setenv("KILAUEA_CACHE", str(tmp_path / "cache"))
    base = tmp_path / "python"
    base.write_text(
        '#!/bin/sh\nset -e\necho "$@" >> "$0.log"\n'
        '[ "$2" = venv ] && mkdir -p "$3/bin" && cp "$0" "$3/bin/python"\n'
        '[ "$2" = pip ] && d="$(dirname "$0")/../lib/python3/site-packages/thing-1.0.dist-info" &&'
        ' mkdir -p "$d" && touch "$d/RECORD"\nexit 0\n'
    )
    base.chmod(base.stat().st_mode | stat.S_IXUSR)
    made = environments.Environment("env", "thing", "1.0", None, "KILAUEA_NO_SUCH_VARIABLE")
    monkeypatch.setattr(environments.sys, "executable", str(base))
    python = made.python()
    assert python == tmp_path / "cache/env/bin/python"
    assert (tmp_path / "python.log").read_text().count("venv") == 1
    assert made.python() == python
    assert (tmp_path / "python.log").read_text().count("venv") == 1


def test_a_failed_command_says_its_last_line(capfd) -> None:
    with pytest.raises(KilaueaError, match="cannot do it: because"):
        environments.checked(["sh", "-c", "echo because; exit 3"], "do it")


def test_a_missing_pipeline_is_said(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("KILAUEA_PIPELINE", str(tmp_path))
    with pytest.raises(KilaueaError, match="KILAUEA_PIPELINE"):
        environments.pipeline_script("cycles_render.py")
