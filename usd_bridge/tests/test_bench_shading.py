"""`kilauea bench shading`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from kilauea import cli
from kilauea.benchmarks.shading import median_ratio

HALL = Path(__file__).parents[2] / "tests/scenes/hall_of_mirrors.usda"


def measure(target: Path, *words: str) -> list[dict]:
    small = ["-r", "24", "16", "-p", "1", "--rounds", "2", "--json", str(target)]
    assert cli.main(["bench", "shading", str(HALL), *small, *words]) == 0
    return json.loads(target.read_text())["rows"]


def test_every_way_traces_the_same_rays(tmp_path):
    rows = measure(tmp_path / "rows.json", "-j", "1", "2")
    assert [(row["way"], row["threads"]) for row in rows] == [
        (way, threads) for way in ("plain", "inline", "queued", "bytes") for threads in (1, 2)
    ]
    assert len({row["rays"] for row in rows}) == 1
    for row in rows:
        assert min(row["cpu_ns"], row["wall_ns"], row["/plain"]) > 0
        waits = row["way"] in ("queued", "bytes")
        assert (row["peak_bytes"] > 0) == waits == (row["bytes/question"] is not None)


def test_without_the_rule_all_pixels_are_in_flight(tmp_path):
    # No memory at all: one pixel after the other.
    words = ("--ways", "queued", "--shade-memory", "0")
    (bounded,) = measure(tmp_path / "bounded.json", *words)
    (unbounded,) = measure(tmp_path / "unbounded.json", *words, "--first-come")
    assert unbounded["peak_bytes"] >= 24 * 16 * bounded["peak_bytes"] / 2


def test_threads_apart_trace_one_frame_each(tmp_path):
    words = ("--ways", "plain", "-j", "2")
    (together,) = measure(tmp_path / "together.json", *words)
    (apart,) = measure(tmp_path / "apart.json", *words, "--apart")
    assert apart["rays"] == 2 * together["rays"]


def test_ratios_are_taken_round_by_round():
    assert median_ratio([1.0, 20.0, 3.0], [1.0, 10.0, 1.0]) == pytest.approx(2.0)
