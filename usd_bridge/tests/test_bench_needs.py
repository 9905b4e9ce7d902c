"""`kilauea bench needs`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from kilauea import cli
from kilauea.benchmarks import needs
from kilauea.benchmarks.needs import Variant

BOX = Path(__file__).parents[2] / "tests/scenes/box_rect_light.usda"


def variant(*seconds: tuple[float, float], saved_bytes: int = 0, is_same: bool = True) -> Variant:
    def never() -> None:
        raise AssertionError

    return Variant(never, list(seconds), saved_bytes, is_same)


def test_frames_are_compared_with_those_right_before_them() -> None:
    # The machine was three times slower in the second pair, and hiccuped in the last.
    pairs = (0.8, 1.0), (2.4, 3.0), (5.0, 1.0)
    row = needs.row("a.usda", "lens", variant(*pairs, saved_bytes=40))
    assert (row["special_s"], row["general_s"]) == (0.8, 1.0)
    assert row["saved_percent"] == pytest.approx(20.0)
    assert row["spread_percent"] == pytest.approx(105.0)
    assert row["saved_bytes"] == 40
    assert row["same_pixels"]
    assert not needs.row("a", "lens", variant((1.0, 1.0), is_same=False))["same_pixels"]


def test_a_stage_is_rendered_without_each_skip(tmp_path, capsys) -> None:
    pytest.importorskip("kilauea._native")
    table = tmp_path / "rows.json"
    words = [str(BOX), "-r", "16", "16", "-p", "2", "--rounds", "1", "--json", str(table)]
    assert cli.main(["bench", "needs", *words]) == 0
    report = json.loads(table.read_text())
    assert report["machine"]["cores"] >= 1
    rows = {row["skip"]: row for row in report["rows"]}
    assert all(row["same_pixels"] and row["stage"] == BOX.name for row in rows.values())
    # One lamp over matte walls: nothing else can be met, and nothing lets rays pass.
    assert {"cutouts", "light_choice", "infinite_lights", "textures", "lens"} <= set(rows)
    assert not {"lights", "area_lights", "surface_layers"} & set(rows)
    assert rows[needs.RAYS]["saved_bytes"] > 0
    assert all(row["special_s"] > 0.0 and row["general_s"] > 0.0 for row in rows.values())
    assert needs.RAYS in capsys.readouterr().out


def test_nothing_to_measure_is_a_failure(monkeypatch) -> None:
    monkeypatch.delenv("KILAUEA_ASSETS", raising=False)
    assert cli.main(["bench", "needs"]) == 1
