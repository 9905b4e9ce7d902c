"""`kilauea bench sets`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from kilauea import cli

HALL = Path(__file__).parents[2] / "tests/scenes/hall_of_mirrors.usda"


def test_sets_give_the_same_picture_and_say_what_they_were_asked(tmp_path):
    pytest.importorskip("kilauea._native")
    table, trace = tmp_path / "rows.json", tmp_path / "trace.json"
    words = [str(HALL), "--members", "1", "3", "-r", "24", "16", "-p", "1", "--rounds", "1"]
    assert cli.main(["bench", "sets", *words, "--json", str(table), "--trace", str(trace)]) == 0
    one, three = json.loads(table.read_text())["rows"]
    assert one["same_pixels"]
    assert three["same_pixels"]
    for kind in ("camera", "indirect"):
        # One member is asked what pierces anything at all.
        assert 0.0 < one[f"{kind}_asked"] <= 1.0
        assert one[f"{kind}_asked"] <= three[f"{kind}_asked"] <= 3.0
        assert three[f"{kind}_met"] <= three[f"{kind}_asked"]
        assert 0.0 < three[f"{kind}_to_lz4"] < three[f"{kind}_to"]
    assert one["memory"] == pytest.approx(1.0, abs=0.01)
    assert one["balance"] == 1.0
    sample = json.loads(trace.read_text())
    assert sample["rays"]
    assert sample["box_bytes"]
    assert all(b < len(sample["box_bytes"]) for ray in sample["rays"] for b in ray["boxes"])
    assert 0.0 < sample["met_share"]["camera"] <= 1.0
