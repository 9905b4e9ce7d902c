"""What was measured, as it is written into the documentation."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from kilauea import cli
from kilauea.benchmarks import equal_time, error_tables, ledger, plot, speed_tables
from kilauea.benchmarks.engines import ENGINES
from kilauea.benchmarks.markdown import number, table
from kilauea.errors import KilaueaError

ROOT = Path(__file__).resolve().parents[2]
MACHINE = {"cpu": "Abacus", "cores": 2, "memory": 4e9, "load_average": 0.5, "date": "2001-02-03"}


def summary(engine: str, ratio: float) -> dict:
    names = ("samples", "load_s", "build_s", "render_s", "seconds", "relMSE", "trimmed_relMSE")
    names += ("FLIP", "variance", "efficiency", "slope", "Msamples_per_s", "peak_MB")
    ratios = ("ratio_seconds", "ratio_render_s", "ratio_cpu_s", "time_ratio")
    return {
        "stage": "box",
        "engine": engine,
        **dict.fromkeys(names, 1.5),
        **dict.fromkeys(ratios, ratio),
        "bias_squared": None,
        "Mrays_per_s": None,
        "reference": "own",
    }


ERROR = {
    "machine": MACHINE,
    "rows": [{"stage": "box", "engine": "path", "version": "Kilauea", "seed": 3}],
    "summary": [summary("path", 0.5), summary("cycles", 1.0)],
    "stages": [
        {
            "stage": "box",
            "machine": MACHINE,
            "resolution": [4, 2],
            "max_depth": 16,
            "skipped": {"mitsuba": "cannot render with mitsuba: mitsuba: unsupported: hair"},
            "notes": {"cycles": ["no caustics", "no fog"]},
            "unreached": ["luxcore: not one sample in 2 s"],
            "reference": {
                "tests": [
                    {
                        "engines": ["cycles", "path"],
                        "n_tests": 12,
                        "n_rejected": 1,
                        "smallest_p": 1e-9,
                        "standard_error": 0.01,
                        "mean_ratio": [1.0, 1.01, 0.99],
                        "agrees": False,
                    }
                ]
            },
        }
    ],
}


def page(*names: str) -> str:
    return "prose\n" + "\n".join(f"<!-- ledger {n} -->\nold {n}\n<!-- end {n} -->" for n in names)


def test_sections_are_rewritten_and_prose_stays() -> None:
    once = ledger.rewritten(page("headline", "references"), {"error": ERROR}, "page.md")
    assert once.startswith("prose\n<!-- ledger headline -->\n2001-02-03: 2 cores of Abacus")
    assert "old" not in once
    assert ledger.rewritten(once, {"error": ERROR}, "page.md") == once


def test_a_section_without_its_report_stays() -> None:
    assert ledger.rewritten(page("rays"), {"error": ERROR}, "page.md") == page("rays")


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("<!-- ledger headline -->", "no end"),
        ("<!-- ledger headline --><!-- end error -->", "no end"),
        (page("weather"), "weather"),
    ],
)
def test_broken_pages_are_refused(text: str, complaint: str) -> None:
    with pytest.raises(KilaueaError, match=complaint):
        ledger.rewritten(text, {"error": ERROR}, "page.md")


@pytest.mark.parametrize("text", ["{", "[]", '{"rows": []}'])
def test_broken_reports_are_named(tmp_path, text: str) -> None:
    (tmp_path / "error.json").write_text(text)
    with pytest.raises(KilaueaError, match=r"error\.json"):
        ledger.read_reports(tmp_path)


def test_the_headline_compares_with_the_baseline() -> None:
    text = error_tables.headline(ERROR)
    on = "{cpu}, {date}".format_map(MACHINE)
    assert f"| `box` | 1.5 | 0.5 | 0.5 | 0.5 | 1 | 0.5 | each engine's own image | {on} |" in text
    assert "| geometric mean |  | 0.5 |" in text
    assert "3 seeds; 4x2 pixels, 16 bounces, box filter" in text


def test_ratios_are_told_by_mean_and_by_median_of_the_seeds() -> None:
    errors = {"cycles": (1.0, 2.0, 3.0), "path": (0.5, 1.0, 30.0)}
    rows = [
        {
            "stage": "box",
            "engine": engine,
            "seed": seed,
            "samples_asked": int(seconds),
            "seconds": seconds,
            "relMSE": error / seconds + 0.25,
            "relMSE_of_reference": 0.25,
        }
        for engine, found in errors.items()
        for seconds in (2.0, 8.0)
        for seed, error in enumerate(found, start=1)
    ]
    rows.append(rows[0] | {"stage": "hall", "engine": "path"})
    assert equal_time.ratios({"rows": rows}).splitlines()[2:] == [
        "| `box` | 2 | 3 | 5.25 (0.5) |",
        "| `box` | 8 | 3 | 5.25 (0.5) |",
    ]


def test_errors_without_the_worst_pixels_are_compared_at_equal_time() -> None:
    ours = {"trimmed_relMSE": 0.1, "seconds": 4.0}
    theirs = {"trimmed_relMSE": 0.4, "seconds": 2.0}
    assert error_tables.trimmed_ratio(ours, theirs) == 0.5


def test_the_default_integrator_makes_the_headline() -> None:
    learning = ERROR | {"summary": [*ERROR["summary"], summary("kilauea", 0.25)]}
    assert "0.25 at `box`" in error_tables.sentence(learning)


def test_the_sentence_names_the_extremes() -> None:
    other = [row | {"stage": "hall"} for row in (summary("path", 2.0), summary("cycles", 1.0))]
    stages = [*ERROR["stages"], ERROR["stages"][0] | {"stage": "hall"}]
    both = {"summary": [*ERROR["summary"], *other], "stages": stages}
    text = error_tables.sentence(ERROR | both)
    assert "(whole command): 1.00 in the geometric mean of 2 stages" in text
    assert "from 0.50 (`box`) to 2.00 (`hall`)" in text
    assert "0.50 at `box`, the only" in error_tables.sentence(ERROR)
    consistent = [*ERROR["summary"], summary("kilauea-consistent", 0.1)]
    text = error_tables.sentence(ERROR | {"summary": consistent})
    assert "0.50 at `box`" in text
    assert "with `--gi consistent` 0.10 at `box`" in text
    assert error_tables.sentence(ERROR | {"summary": []}) == error_tables.NOTHING_COMPARED


def test_what_cannot_be_compared_is_said() -> None:
    assert error_tables.not_expressed(ERROR).splitlines() == [
        "- `box`, mitsuba: hair",
        "- `box`, luxcore: not one sample in 2 s",
        "- `box`, cycles renders without: no caustics and 1 more",
    ]
    assert "| `box` | cycles, path | 1 of 12 |" in error_tables.references(ERROR)
    assert "| box | path | 1.5 |" in error_tables.comparison(ERROR)


def test_each_engine_has_a_colour_of_its_own() -> None:
    assert plot.COLOURS.keys() == ENGINES.keys()
    assert len(set(plot.COLOURS.values())) == len(ENGINES)


def test_tables() -> None:
    assert table([]) == ""
    assert table([{"a": 1, "b": None}, {"a": 0.123456}]) == (
        "| a | b |\n| --- | --- |\n| 1 |  |\n| 0.123 |  |\n"
    )
    assert [number(12345.6), number(3), number("x")] == ["1.23e+04", "3", "x"]


def test_rays_stand_beside_both_modes() -> None:
    rows = [
        {
            "mesh": "room",
            "triangles": 1200,
            "rays": kind,
            "ours_name": "ours",
            "ours": 6.0,
            "peer_name": f"Embree 4.4.0 {mode}",
            "ratio": ratio,
        }
        for kind in speed_tables.RAY_KINDS
        for mode, ratio in (("robust", 0.5), ("medium", 0.25))
    ]
    tree = {"mesh": "room", "triangles": 1200, "builder": "ours", "bytes_per_triangle": 63.4}
    builds = [tree | {"threads": n, "seconds": 1.0 / n} for n in (1, 2)]
    text = speed_tables.rays({"machine": MACHINE, "rows": rows, "builds": builds})
    four = " / ".join(["{}"] * 4)
    values = (four.format(*[x] * 4) for x in (6, 0.5, 0.25))
    assert "| `room` | 1,200 | " + " | ".join(values) + " |" in text
    assert "| ours | 1 | 0.5 | 63 |" in text


def test_the_pages_have_sections_for_everything(tmp_path, monkeypatch) -> None:
    """The command rewrites the real pages without an error, in a copy of them."""
    docs = tmp_path / "docs"
    (docs / "ledger").mkdir(parents=True)
    (docs / "images").mkdir()
    (docs / "ledger/error.json").write_text(json.dumps(ERROR))
    for name in ("README.md", "docs/benchmarks.md"):
        (tmp_path / name).write_text((ROOT / name).read_text(encoding="utf-8"), encoding="utf-8")
    drawn: list[Path] = []
    monkeypatch.setattr(ledger.plot, "write", lambda rows, stem: drawn.append(stem))
    assert cli.main(["bench", "ledger", "--docs", str(docs)]) == 0
    assert drawn == [docs / "images/error-against-time"]
    written = (docs / "benchmarks.md").read_text(encoding="utf-8")
    written += (tmp_path / "README.md").read_text(encoding="utf-8")
    assert all(f"<!-- ledger {name} -->" in written for name in ledger.SECTIONS)
    assert "cores of Abacus" in written
