"""A check as one JSON object."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from kilauea.checking.bias import BiasTest
from kilauea.checking.images import Batches, NoisyImage
from kilauea.checking.run import Outcome


@dataclass(frozen=True)
class Subject:
    """What was checked, as the report names it."""

    stage: str
    frame: float
    command: str
    """To run it again."""
    settings: dict[str, Any]
    versions: dict[str, str]
    machine: dict[str, Any]
    date: str
    notes: tuple[str, ...]
    """What our engine could not express, and what is to know about the reference."""


def as_record(outcome: Outcome, subject: Subject) -> dict[str, Any]:
    """Describe a check; everything is finite, None stands for what is not known."""
    light, shape = outcome.light, outcome.shape
    record = {
        "verdict": outcome.verdict.value,
        "stage": subject.stage,
        "frame": subject.frame,
        "command": subject.command,
        "date": subject.date,
        "findings": [
            {"name": f.name, "verdict": f.verdict.value, "summary": f.summary}
            for f in outcome.findings
        ],
        "thresholds": outcome.criteria.record(),
        "rounds": outcome.rounds,
        "ours": _image(light.ours),
        "reference": _image(light.reference),
        "image": _test(light.image),
        "tiles": {"size": light.tile, **_test(light.tiles)},
        "shift": None if shape.shift is None else _test(shape.shift),
        "flip": {"mean": shape.looks.mean, "noise": shape.looks.noise},
        "noise": {
            "over_claim": outcome.noise.over_claim,
            "over_fewer_samples": outcome.noise.over_fewer_samples,
            "over_pixels": outcome.noise.over_pixels,
        },
        "invalid_pixels": {"ours": light.n_invalid_ours, "reference": light.n_invalid_reference},
        "settings": subject.settings,
        "versions": subject.versions,
        "machine": subject.machine,
        "notes": list(subject.notes),
    }
    return _finite(record)


def _image(image: NoisyImage) -> dict[str, Any]:
    record: dict[str, Any] = {
        "engine": image.engine,
        "samples_per_pixel": image.samples_per_pixel,
        "mean": image.mean.mean(axis=(0, 1)).tolist(),
        "variance_of_a_pixel": float(image.pixel_variance.mean()),
    }
    if isinstance(image, Batches):
        record |= {
            "batches": image.n,
            "render_secs": image.seconds,
            "warnings": list(image.warnings),
        }
    return record


def _test(test: BiasTest) -> dict[str, Any]:
    return {
        "difference": test.difference.tolist(),
        "standard_error": test.error.tolist(),
        "t": test.t.tolist(),
        "dof": test.dof.tolist(),
        "p": test.p.tolist(),
        "p_beyond_margin": test.p_margin.tolist(),
        "level": test.level,
        "margin": test.margin,
        "is_significant": test.is_significant.tolist(),
        "detectable": test.detectable.tolist(),
    }


def _finite(value: Any) -> Any:
    """Replace what JSON cannot hold."""
    if isinstance(value, dict):
        return {key: _finite(v) for key, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(v) for v in value]
    if isinstance(value, np.generic):
        return _finite(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
