"""The report of `kilauea bench error` as Markdown."""

from __future__ import annotations

from statistics import geometric_mean
from typing import Any

from kilauea.benchmarks.markdown import conditions, table
from kilauea.benchmarks.summary import BASELINE, CLOCKS

Report = dict[str, Any]

SHOWN = ("kilauea", "path")
"""Engines whose ratios make the headline: the first that a stage has. The default is first."""
CONSISTENT = ("kilauea-consistent",)
AGAINST = {"agreed": "an image that two engines agree on", "own": "each engine's own image"}
_CLOCK_NAMES = {
    "seconds": "whole command",
    "render_s": "rendering",
    "cpu_s": "processor time",
}


TRIMMED = "whole command, trimmed"
NOTHING_COMPARED = "No stage was rendered by both."
CLOCK_OF_REPORT = {"wall": "seconds", "cpu": "cpu_s"}
"""The clock on which ratios are fair, by what the times of a report were measured with."""


def sentence(report: Report) -> str:
    """Say in a few lines how our error compares with the baseline's."""
    lines = [compared(report, engines) for engines in (SHOWN, CONSISTENT)]
    if not lines[0]:
        return NOTHING_COMPARED
    name = _CLOCK_NAMES[CLOCK_OF_REPORT[report["stages"][0].get("clock", "wall")]]
    exact, consistent = (
        extremes({line["stage"]: line[name] for line in found if line[name]}) for found in lines
    )
    text = f"relMSE over that of Cycles at equal time ({name}): {exact}"
    if consistent is not None:
        text += f"; with `--gi consistent` {consistent}"
    return f"{text}. Below 1, ours is better."


def extremes(ratios: dict[str, float]) -> str | None:
    """Say what the ratios of some stages are in the mean, and at most."""
    if len(ratios) == 1:
        return " ".join(
            f"{ratio:.2f} at {stage}, the only stage measured so far"
            for stage, ratio in ratios.items()
        )
    if not ratios:
        return None
    best, worst = min(ratios, key=ratios.__getitem__), max(ratios, key=ratios.__getitem__)
    return (
        f"{geometric_mean(ratios.values()):.2f} in the geometric mean of {len(ratios)} stages, "
        f"from {ratios[best]:#.2g} ({best}) to {ratios[worst]:.2f} ({worst})"
    )


def headline(report: Report) -> str:
    """Say per stage how our error compares with the baseline's at equal time."""
    lines = compared(report)
    if not lines:
        return NOTHING_COMPARED
    lines.append({"stage": "geometric mean", **means(lines)})
    return f"{conditions(report)}\n\n{table(lines)}"


def compared(report: Report, engines: tuple[str, ...] = SHOWN) -> list[dict[str, Any]]:
    """Return a line for each stage that the baseline and one of `engines` rendered, the first."""
    machines = {stage["stage"]: stage["machine"] for stage in report["stages"]}
    lines = []
    for stage in stages(report):
        found = {row["engine"]: row for row in report["summary"] if row["stage"] == stage}
        ours = next((found[engine] for engine in engines if engine in found), None)
        if ours is None or BASELINE not in found:
            continue
        lines.append(
            {
                "stage": f"`{stage}`",
                "seconds": found[BASELINE]["seconds"],
                **{_CLOCK_NAMES[clock]: ours[f"ratio_{clock}"] for clock in CLOCKS},
                TRIMMED: trimmed_ratio(ours, found[BASELINE]),
                "time to its error": ours["time_ratio"],
                "measured against": AGAINST[ours["reference"]],
                "on": "{cpu}, {date}".format_map(machines[stage]),
            }
        )
    return lines


def trimmed_ratio(ours: dict[str, Any], theirs: dict[str, Any]) -> float:
    """Return the ratio without the worst pixels, of which a few decide in some stages by luck.

    Errors are taken to fall with one over the time of the whole command.
    """
    errors = [row["trimmed_relMSE"] * row["seconds"] for row in (ours, theirs)]
    return errors[0] / errors[1]


def means(lines: list[dict[str, Any]]) -> dict[str, float]:
    """Average the ratios of all stages."""
    columns = (*(_CLOCK_NAMES[clock] for clock in CLOCKS), TRIMMED, "time to its error")
    present = {name: [line[name] for line in lines if line[name]] for name in columns}
    return {name: geometric_mean(values) for name, values in present.items() if values}


def comparison(report: Report) -> str:
    """Tell what each engine did at each stage in its longest time."""
    columns = {
        "stage": "stage",
        "engine": "engine",
        "samples": "samples",
        "load_s": "load, s",
        "build_s": "build, s",
        "render_s": "render, s",
        "seconds": "whole, s",
        "relMSE": "relMSE",
        "trimmed_relMSE": "trimmed",
        "FLIP": "FLIP",
        "variance": "variance",
        "bias_squared": "bias²",
        "efficiency": "1/(MSE t)",
        "slope": "slope",
        "Msamples_per_s": "Msamples/s",
        "Mrays_per_s": "Mrays/s",
        "peak_MB": "MB",
    }
    return table(
        [{title: row[name] for name, title in columns.items()} for row in report["summary"]]
    )


def references(report: Report) -> str:
    """Tell on what the engines of each stage were found to agree, or by how much they differ."""
    lines = []
    for stage in report["stages"]:
        for test in stage.get("reference", {}).get("tests", []):
            ratios = " ".join(f"{ratio:.3f}" for ratio in test["mean_ratio"])
            lines.append(
                {
                    "stage": f"`{stage['stage']}`",
                    "engines": ", ".join(test["engines"]),
                    "tiles that differ": f"{test['n_rejected']} of {test['n_tests']}",
                    "smallest p": test["smallest_p"],
                    "standard error": test["standard_error"],
                    "tiles that tell nothing": test.get("n_undecided", ""),
                    "missed by both": _missed(test.get("missed_by_both", {})),
                    "ratio of the means": ratios,
                    "reference": "this pair" if test["agrees"] else "",
                }
            )
    return table(lines)


def _missed(found: dict[str, int]) -> str:
    return ", ".join(f"{n_tests} of {witness}" for witness, n_tests in found.items() if n_tests)


def not_expressed(report: Report) -> str:
    """List the engines that took no part, and what others did not take over."""
    lines = []
    for stage in report["stages"]:
        name = stage["stage"]
        for engine, reason in stage.get("skipped", {}).items():
            lines.append(f"- `{name}`, {engine}: {reason.rpartition('unsupported: ')[2]}")
        lines += [
            f"- `{name}`, {engine_and_time}" for engine_and_time in stage.get("unreached", ())
        ]
        for engine, warnings in stage.get("notes", {}).items():
            more = f" and {len(warnings) - 1} more" if len(warnings) > 1 else ""
            lines.append(f"- `{name}`, {engine} renders without: {warnings[0]}{more}")
    return "\n".join(lines) or "Every engine rendered every stage."


def stages(report: Report) -> list[str]:
    """Return the names of the stages that have rows."""
    return list(dict.fromkeys(row["stage"] for row in report["summary"]))
