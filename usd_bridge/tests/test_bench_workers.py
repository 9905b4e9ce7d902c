"""`kilauea bench workers`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from kilauea import cli
from kilauea.benchmarks import workers
from kilauea.benchmarks.workers import Variant
from kilauea.child import Finished

BOX = Path(__file__).parents[2] / "tests/scenes/box_rect_light.usda"
RAYS = {"camera": 600, "shadow": 400}


def variant(*frames: tuple[float, float, float], n: int = 0, links: int | None = None) -> Variant:
    """Return frames of so many seconds, processor seconds and seconds of rendering."""
    found = Variant(n, 2 if links else 1)
    seat = {"links": {"bytes_sent": links}} if links else None
    for wall_s, cpu_s, render_s in frames:
        found.commands.append(Finished("", wall_s, cpu_s))
        stats = {"times": {"render": render_s - 0.5, "photon": 0.5}, "rays": RAYS}
        stats |= {"workers": [{"peak_rss": 70, "seat": seat}] * n, "memory": {"peak_rss": 90}}
        found.stats.append(stats)
    return found


def test_the_fastest_of_each_count() -> None:
    # A second round in which the machine had something else to do.
    alone = variant((5.0, 4.0, 4.0), (9.0, 6.0, 8.0))
    two = variant((7.0, 6.0, 5.0), (3.0, 5.0, 2.0), n=2, links=3000)
    row = workers.row("a", "path", two, alone)
    assert (row["seconds"], row["speedup"], row["cpu_ratio"]) == (3.0, 2.0, 1.25)
    assert (row["photon_s"], row["gather_s"], row["render_s"]) == (0.5, 0.0, 1.5)
    assert (row["peak_rss"], row["bytes_a_ray"]) == (70, 6.0)
    row = workers.row("a", "path", alone, alone)
    assert (row["peak_rss"], row["bytes_a_ray"], row["speedup"]) == (90, None, 1.0)


def test_pixels_are_those_of_one_process(tmp_path) -> None:
    pytest.importorskip("kilauea._native")
    table = tmp_path / "rows.json"
    words = [str(BOX), "-r", "16", "16", "-p", "2", "--rounds", "1", "--json", str(table)]
    words += ["--workers", "1", "2", "--set-size", "1", "2", "--broadcast", "culled", "full"]
    assert cli.main(["bench", "workers", *words]) == 0
    rows = json.loads(table.read_text())["rows"]
    ways = [(row["workers"], row["set"], row["broadcast"]) for row in rows]
    assert ways == [(0, 1, None), (1, 1, None), (2, 1, None), (2, 2, "culled"), (2, 2, "full")]
    assert all(row["same_pixels"] for row in rows)
    assert all(row["bytes_a_ray"] > 0.0 for row in rows[3:])


def test_links_of_all_kinds_give_the_same_pixels(tmp_path) -> None:
    pytest.importorskip("kilauea._native")
    table = tmp_path / "rows.json"
    words = [str(BOX), "-r", "16", "16", "-p", "2", "--rounds", "1", "--json", str(table)]
    words += ["--workers", "2", "--set-size", "1", "2", "--links", "channels", "tls"]
    assert cli.main(["bench", "workers", *words]) == 0
    rows = json.loads(table.read_text())["rows"]
    ways = [(row["set"], row["links"]) for row in rows]
    assert ways == [(1, None), (1, "channels"), (1, "tls"), (2, "channels"), (2, "tls")]
    assert len({row["pixels"] for row in rows}) == 1


def test_links_of_a_cluster_need_its_address(capsys) -> None:
    assert cli.main(["bench", "workers", str(BOX), "--links", "ray"]) == 2
    assert "those of a --cluster" in capsys.readouterr().err


def test_workers_that_make_no_set(capsys) -> None:
    assert cli.main(["bench", "workers", str(BOX), "--workers", "3", "--set-size", "2"]) == 2
    assert "can be divided into sets of 2" in capsys.readouterr().err
