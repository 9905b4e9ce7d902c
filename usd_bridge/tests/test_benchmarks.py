from __future__ import annotations

import json
import stat

import pytest
from kilauea import child, environments
from kilauea.benchmarks import report, samples
from kilauea.benchmarks.engines import Run
from kilauea.benchmarks.job import Job
from kilauea.errors import KilaueaError


def test_rates_are_medians_over_rounds(tmp_path) -> None:
    job = Job("box.usda", tmp_path, {"resolution": [100, 50], "max_depth": 3})
    runs = [
        Run("path", "Kilauea", tmp_path, 4, 0.1, 0.2, seconds, seconds, seconds, 7, None, [])
        for seconds in (1.0, 2.0, 20.0)
    ]
    row = samples.row(job, "path", runs)
    assert row["Msamples_per_s"] == pytest.approx(0.01)
    assert (row["slowest"], row["fastest"]) == pytest.approx((0.001, 0.02))
    assert row["build_s"] == pytest.approx(0.3)


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
        '[ "$2" = pip ] && for name in thing-1.0 other-2.0; do'
        ' d="$(dirname "$0")/../lib/python3/site-packages/$name.dist-info" &&'
        ' mkdir -p "$d" && touch "$d/RECORD"; done\nexit 0\n'
    )
    base.chmod(base.stat().st_mode | stat.S_IXUSR)
    companions = (("other", "2.0"),)
    made = environments.Environment(
        "env", "thing", "1.0", None, "KILAUEA_NO_SUCH_VARIABLE", companions
    )
    monkeypatch.setattr(environments.sys, "executable", str(base))
    python = made.python()
    assert python == tmp_path / "cache/env/bin/python"
    assert (tmp_path / "python.log").read_text().count("venv") == 1
    assert made.python() == python
    assert (tmp_path / "python.log").read_text().count("venv") == 1
    assert made.requirements == ["other==2.0", "thing==1.0"]


def test_a_failed_command_says_its_last_line(capfd) -> None:
    with pytest.raises(KilaueaError, match="cannot do it: because"):
        child.run_apart(["sh", "-c", "echo because; exit 3"], "do it")


def test_a_command_is_measured() -> None:
    """What it prints, its time, and its processor time alone."""
    done = child.run_apart(["sh", "-c", "echo yes; echo no >&2"], "do it")
    assert done.output == "yes\n"
    assert done.wall_s > 0.0
    assert done.cpu_s >= 0.0


def test_a_missing_pipeline_is_said(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("KILAUEA_PIPELINE", str(tmp_path))
    with pytest.raises(KilaueaError, match="KILAUEA_PIPELINE"):
        environments.pipeline_script("cycles_render.py")
