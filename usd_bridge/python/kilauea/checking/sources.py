"""Where images come from: our engine and Cycles, as batches of renders with seeds of their own."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from kilauea import interrupt
from kilauea.checking.images import Batches, NoisyImage, StoredImage
from kilauea.errors import KilaueaError
from kilauea.payload import Frame
from kilauea.progress import Progress
from kilauea.reference import export_frame, run_cycles
from kilauea.render import RenderOptions, build_scene, native, settings_record, wait


class Source(Protocol):
    """Something that gives an image with known noise."""

    def render(self, samples_per_batch: int, n: int, first_seed: int, /) -> NoisyImage:
        """Render batches with the seeds from `first_seed` on, or return what there is."""
        ...


class BatchSource(Protocol):
    """An engine with a scene."""

    def render(self, samples_per_batch: int, n: int, first_seed: int, /) -> Batches:
        """Render batches with the seeds from `first_seed` on."""
        ...


@dataclass
class StoredSource:
    """A reference that was made before."""

    image: StoredImage

    def render(self, _samples_per_batch: int, _n: int, _first_seed: int) -> StoredImage:
        """Return the image, whatever is asked for."""
        return self.image


@dataclass
class KilaueaSource:
    """Our engine; the scene is built once."""

    frame: Frame
    options: RenderOptions

    @cached_property
    def _scene(self) -> Any:
        return build_scene(self.frame, self.options)

    def render(self, samples_per_batch: int, n: int, first_seed: int) -> Batches:
        """Render batches."""
        images, variances, warnings = [], [], [*self.frame.warnings, *self._scene.warnings()]
        seconds = 0.0
        with tempfile.TemporaryDirectory(prefix="kilauea-") as folder:
            file = Path(folder) / "batch.exr"
            for seed in range(first_seed, first_seed + n):
                stats = self._render_one(file, samples_per_batch, seed)
                seconds += stats["times"]["render"]
                warnings += stats.get("warnings", ())
                pixels = read_channels(file, ("R", "G", "B", "variance"))
                images.append(pixels[..., :3])
                variances.append(pixels[..., 3])
        return Batches(
            engine=f"Kilauea {metadata.version('kilauea')}",
            images=np.stack(images),
            samples_per_batch=samples_per_batch,
            # One sample tells nothing about the variance.
            claimed_variance=np.mean(variances, axis=0) if samples_per_batch > 1 else None,
            warnings=tuple(dict.fromkeys(warnings)),
            seconds=seconds,
        )

    def _render_one(self, file: Path, samples: int, seed: int) -> dict[str, Any]:
        settings = settings_record(self.frame, self.options)
        settings |= {"samples_per_pixel": samples, "seed": seed, "aovs": ["variance"]}
        camera = self.frame.camera["path"]
        header = {"stage": self.frame.stage, "frame": self.frame.time, "camera": camera}
        engine = native()
        try:
            job = self._scene.render(json.dumps(settings), json.dumps(header))
            wait(job, Progress(shown=False))
            return json.loads(interrupt.run(lambda: job.finish([str(file)])))
        except (engine.SceneError, engine.RenderError) as error:
            raise KilaueaError(str(error)) from None


@dataclass
class CyclesSource:
    """Cycles, from the scene exactly as our engine has it."""

    frame: Frame
    options: RenderOptions

    def render(self, samples_per_batch: int, n: int, first_seed: int) -> Batches:
        """Render batches."""
        with tempfile.TemporaryDirectory(prefix="kilauea-") as name:
            folder = Path(name)
            export_frame(self.frame, self.options, folder)
            out = folder / "cycles.exr"
            flags = {"--samples": samples_per_batch, "--seed": first_seed, "--batches": n}
            stats = run_cycles(folder, out, *(str(word) for flag in flags.items() for word in flag))
            images = [read_channels(file, ("R", "G", "B")) for file in _numbered(out, n)]
        return Batches(
            engine=stats["engine"],
            images=np.stack(images),
            samples_per_batch=samples_per_batch,
            warnings=tuple(stats["warnings"]),
            seconds=stats["render_s"],
        )


def read_channels(file: Path, names: tuple[str, ...]) -> NDArray[np.float32]:
    """Read channels of an EXR as (height, width, channels).

    Raises
    ------
    KilaueaError
        It cannot be read, or lacks one of them.
    """
    image = oiio.ImageBuf(str(file))
    if image.has_error:
        raise KilaueaError(f"{file}: {image.geterror()}")
    channels = list(image.spec().channelnames)
    lacking = [name for name in names if name not in channels]
    if lacking:
        raise KilaueaError(f"{file} has no channel {lacking[0]}")
    pixels = np.asarray(image.get_pixels(oiio.FLOAT))
    return np.ascontiguousarray(pixels[..., [channels.index(name) for name in names]])


def _numbered(out: Path, n: int) -> Iterator[Path]:
    return (out.with_suffix(f".{idx}.exr") for idx in range(n))
