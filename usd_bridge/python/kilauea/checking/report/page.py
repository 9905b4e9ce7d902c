"""A check as one page that needs nothing else: styles, pictures and behaviour are in it."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from importlib import resources
from pathlib import PurePath
from string import Template
from typing import Any

import numpy as np

from kilauea.checking.bias import BiasTest
from kilauea.checking.images import Batches, NoisyImage
from kilauea.checking.judge import Verdict, percent
from kilauea.checking.report.charts import T_SHOWN, p_histogram, tile_map
from kilauea.checking.report.pixels import (
    DIVERGING,
    SEQUENTIAL,
    coloured,
    data_uri,
    displayed,
    exposure_of,
)
from kilauea.checking.report.record import Subject
from kilauea.checking.run import Outcome

DIFFERENCE_SHOWN = 0.2
"""Relative difference of a pixel that has the strongest colours."""
FLIP_SHOWN = 0.3
_TILES_LISTED = 8


def as_page(outcome: Outcome, subject: Subject) -> str:
    """Write the page."""
    ours, reference = outcome.light.ours, outcome.light.reference
    height, width = reference.mean.shape[:2]
    verdict = outcome.verdict
    exposure = exposure_of(reference.mean)
    return _template("page.html").substitute(
        verdict=verdict.value,
        title=escape(PurePath(subject.stage).name),
        sentence=escape(_sentence(outcome)),
        subtitle=escape(f"{ours.engine} against {reference.engine}, {subject.date}"),
        css=_template("page.css").substitute(
            diverging=_gradient(DIVERGING), sequential=_gradient(SEQUENTIAL)
        ),
        js=_text("page.js"),
        findings=_findings(outcome),
        width=width,
        height=height,
        ours_png=data_uri(displayed(ours.mean, exposure)),
        reference_png=data_uri(displayed(reference.mean, exposure)),
        difference_png=data_uri(_difference(outcome)),
        flip_png=data_uri(coloured(outcome.shape.looks.errors, SEQUENTIAL, 0.0, FLIP_SHOWN)),
        tile_svg=tile_map(outcome.light.tiles, outcome.light.tile, width, height),
        difference_range=f"{100.0 * DIFFERENCE_SHOWN:g} %",
        flip_range=f"{FLIP_SHOWN:g}",
        t_range=f"{T_SHOWN:g}",
        exposure=f"{exposure:.3g}",
        worst_tiles=_worst_tiles(outcome.light.tiles),
        histogram=p_histogram(outcome.light.tiles),
        n_tests=outcome.light.tiles.p.size,
        limits=_limits(outcome, subject),
        renders=_renders(outcome),
        settings=_pairs({**subject.settings, **subject.versions, **_machine(subject)}),
        command=escape(subject.command),
    )


def _sentence(outcome: Outcome) -> str:
    if outcome.verdict is Verdict.PASS:
        return "No difference beyond the margins, with enough samples to have found one."
    if outcome.verdict is Verdict.INCONCLUSIVE:
        return (
            "No difference was found, but there were too few samples to find the biases that must "
            "not go unnoticed."
        )
    failed = [f.title.lower() for f in outcome.findings if f.verdict is Verdict.FAIL]
    return f"Beyond the margins: {', '.join(failed)}."


def _template(name: str) -> Template:
    return Template(_text(name))


def _text(name: str) -> str:
    return resources.files(__package__ or "").joinpath(name).read_text(encoding="utf-8")


def _gradient(colours: Iterable[tuple[float, ...]]) -> str:
    return ", ".join(f"rgb({' '.join(f'{100 * c:.0f}%' for c in rgb)})" for rgb in colours)


def _difference(outcome: Outcome) -> np.ndarray:
    """Colour each pixel by the sum of its channels, against the reference with a dark floor."""
    ours, reference = outcome.light.ours.mean, outcome.light.reference.mean
    scale = np.maximum(reference.sum(axis=2), 0.1 * reference.sum(axis=2).mean())
    relative = (ours - reference).sum(axis=2) / np.maximum(scale, np.finfo(np.float64).tiny)
    return coloured(relative, DIVERGING, -DIFFERENCE_SHOWN, DIFFERENCE_SHOWN)


def _findings(outcome: Outcome) -> str:
    return "".join(
        f'<tr><td><span class="mark {f.verdict.value}">{f.verdict.value}</span></td>'
        f"<th>{escape(f.title)}</th><td>{escape(f.summary)}</td></tr>"
        for f in outcome.findings
    )


def _worst_tiles(tests: BiasTest) -> str:
    worst = np.abs(tests.t).argmax(axis=2)
    strength = np.abs(tests.t).max(axis=2)
    order = np.argsort(-strength, axis=None)[:_TILES_LISTED]
    rows = ["<tr><th>column, row</th><th></th><th>difference</th><th>t</th><th>p</th></tr>"]
    for row, column in zip(*np.unravel_index(order, strength.shape), strict=True):
        at = (row, column, worst[row, column])
        difference = percent(float(tests.difference[at]))
        rows.append(
            f"<tr><td>{column}, {row}</td><td>{'RGB'[worst[row, column]]}</td>"
            f"<td>{difference} ± {100.0 * tests.half_width[at]:.2f} %</td>"
            f"<td>{tests.t[at]:+.1f}</td><td>{tests.p[at]:.2g}</td></tr>"
        )
    return "".join(rows)


def _renders(outcome: Outcome) -> str:
    columns = (outcome.light.ours, outcome.light.reference)
    figures = [_figures(image) for image in columns]
    rows = "".join(
        f"<tr><th>{name}</th><td>{escape(ours)}</td><td>{escape(figures[1][name])}</td></tr>"
        for name, ours in figures[0].items()
    )
    rounds = ", ".join(map(str, outcome.rounds))
    return f"{rows}<tr><th>rounds</th><td colspan='2'>{rounds} samples per pixel</td></tr>"


def _figures(image: NoisyImage) -> dict[str, str]:
    mean = image.mean.mean(axis=(0, 1))
    error = float(np.sqrt(image.pixel_variance.mean()) / max(mean.mean(), 1e-300))
    is_made_now = isinstance(image, Batches)
    return {
        "engine": image.engine,
        "samples per pixel": str(image.samples_per_pixel or "not known"),
        "batches": str(image.n) if is_made_now else "stored",
        "mean R, G, B": ", ".join(f"{value:.5g}" for value in mean),
        "noise of a pixel": f"{100.0 * error:.2g} % of the mean",
        "rendering": f"{image.seconds:.1f} s" if is_made_now else "-",
    }


def _limits(outcome: Outcome, subject: Subject) -> str:
    reference = outcome.light.reference
    theirs = reference.warnings if isinstance(reference, Batches) else ()
    lists = {
        outcome.light.ours.engine: dict.fromkeys((*subject.notes, *outcome.light.ours.warnings)),
        reference.engine: dict.fromkeys(theirs),
    }
    parts = [
        f"<p>{escape(engine)}</p><ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>"
        for engine, lines in lists.items()
        if lines
    ]
    return "".join(parts) or "<p>Nothing: both render all that was found in the stage.</p>"


def _machine(subject: Subject) -> dict[str, Any]:
    return {"processor": f"{subject.machine['cpu']}, {subject.machine['cores']} cores"}


def _pairs(values: dict[str, Any]) -> str:
    return "".join(
        f"<tr><th>{escape(name.replace('_', ' '))}</th><td>{escape(str(value))}</td></tr>"
        for name, value in values.items()
    )
