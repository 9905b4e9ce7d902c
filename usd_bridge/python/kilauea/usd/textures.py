"""Images: found through the asset resolver, prepared once as tile files, listed in the frame."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pxr import Ar, Sdf, Usd

from kilauea import payload
from kilauea.usd import tile_files

CACHE_VARIABLE = "KILAUEA_TEXTURE_CACHE"
"""Environment variable that names the folder of tile files."""

_UDIM = "<UDIM>"
_UDIMS = range(1001, 1101)


_MAX_THREADS = 8
"""Each may hold an image of hundreds of megabytes."""


@dataclass(frozen=True, slots=True)
class _Image:
    """An image being prepared."""

    source: str
    """Resolved path."""
    color_space: str
    udim: int
    files: list[dict[str, Any]]
    """The texture's `TextureFile` records."""
    where: str
    """Prim and authored path, for messages."""


class TextureTable:
    """The frame's textures, each image once.

    Tile files are kept in a cache folder and found again as long as the image has the same path,
    size and time of modification. New ones are written by threads until `finish`.
    """

    def __init__(self, frame: payload.Frame, options: Any) -> None:
        self._frame = frame
        self._time = Usd.TimeCode(options.time)
        self._indices: dict[tuple[str, ...], int] = {}
        self._wraps: dict[int, tile_files.Wraps] = {}
        self._pool: ThreadPoolExecutor | None = None
        self._pending: list[tuple[Future[None], _Image]] = []

    def index_of_attribute(self, attribute: Usd.Attribute, color_space: str = "auto") -> int | None:
        """Return the index of the image that an asset attribute names; None where it names none."""
        asset = attribute.Get(self._time)
        if not isinstance(asset, Sdf.AssetPath) or not asset.path:
            return None
        path = str(attribute.GetPrim().GetPath())
        if _UDIM not in asset.path:
            return self.index(asset.resolvedPath, asset.path, color_space, path)
        tiles = _udim_tiles(asset, attribute.GetPropertyStack(self._time))
        key = (*tiles.values(), asset.path, color_space)
        return self._index(key, tiles, asset.path, color_space, path)

    def index(
        self, resolved: str, authored: str, color_space: str = "auto", prim_path: str = ""
    ) -> int:
        """Return the index of an image in `Frame.textures`.

        `resolved` is empty where the image was not found. `color_space` is auto, raw or sRGB.
        `prim_path` is for messages.
        """
        images = {0: resolved} if resolved else {}
        key = (resolved or authored, color_space)
        return self._index(key, images, authored, color_space, prim_path)

    def is_missing(self, index: int) -> bool:
        """Return whether there is no image to look up."""
        return not self._frame.textures[index]["files"]

    def wraps(self, index: int) -> tile_files.Wraps:
        """Return the wrap modes in the image's metadata."""
        return self._wraps.get(index, (None, None))

    def finish(self) -> None:
        """Wait for the tile files being written; images that turn out damaged become missing."""
        for future, image in self._pending:
            try:
                future.result()
            except (tile_files.UnreadableImageError, OSError) as error:
                self._warn(image, error)
                image.files[:] = [file for file in image.files if file["udim"] != image.udim]
                if not image.files:
                    self._miss(image.where)
        self._pending.clear()
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    def _index(
        self,
        key: tuple[str, ...],
        images: dict[int, str],
        authored: str,
        color_space: str,
        prim_path: str,
    ) -> int:
        if key in self._indices:
            return self._indices[key]
        index = self._indices[key] = len(self._frame.textures)
        files: list[dict[str, Any]] = []
        self._frame.textures.append({"path": authored, "files": files})
        where = f"{prim_path}: {authored}" if prim_path else authored
        for udim, source in images.items():
            image = _Image(source, color_space, udim, files, where)
            try:
                target, wraps = self._prepare(image)
            except (tile_files.UnreadableImageError, OSError) as error:
                self._warn(image, error)
                continue
            files.append({"udim": udim, "tiles": str(target)})
            self._wraps.setdefault(index, wraps)
        if not files:
            self._miss(where)
        return index

    def _prepare(self, image: _Image) -> tuple[Path, tile_files.Wraps]:
        """Return the tile file and wrap modes of an image; a new file is written by and by."""
        target = _target(image)
        wraps = tile_files.wraps(target)
        if wraps is None:
            with _on_disk(image.source) as file:
                wraps = tile_files.wraps_of_image(file)
            if self._pool is None:
                self._pool = ThreadPoolExecutor(min(os.cpu_count() or 1, _MAX_THREADS))
            self._pending.append((self._pool.submit(_write, image, target), image))
        return target, wraps

    def _warn(self, image: _Image, error: Exception) -> None:
        reason = " ".join(str(error).split())
        name = _file_name(image.source)
        self._frame.warnings.append(f"{image.where}: {name} cannot be prepared: {reason}")

    def _miss(self, where: str) -> None:
        self._frame.missing.append(f"{where}: texture not found or unreadable")


def cache_folder() -> Path:
    """Return the folder of tile files, made where it does not exist."""
    folder = os.environ.get(CACHE_VARIABLE)
    path = Path(folder) if folder else Path.home() / ".cache" / "kilauea" / "textures"
    path.mkdir(parents=True, exist_ok=True)
    return path.absolute()


def _udim_tiles(asset: Sdf.AssetPath, opinions: Sequence[Sdf.PropertySpec]) -> dict[int, str]:
    """Return the image of each UDIM tile that exists."""
    resolver = Ar.GetResolver()
    tiles: dict[int, str] = {}
    for udim in _UDIMS:
        tile = (asset.resolvedPath or asset.path).replace(_UDIM, str(udim))
        if not asset.resolvedPath and opinions:
            tile = Sdf.ComputeAssetPathRelativeToLayer(opinions[0].layer, tile)
        resolved = str(resolver.Resolve(tile))
        if resolved:
            tiles[udim] = resolved
    return tiles


def _target(image: _Image) -> Path:
    """Return where the tile file of an image is, or will be."""
    on_disk = Path(Ar.SplitPackageRelativePathOuter(image.source)[0])
    try:
        status = on_disk.stat()
        version: tuple[Any, ...] = (str(on_disk.absolute()), status.st_mtime_ns, status.st_size)
    except OSError:
        # From a resolver that is no file system: known by its content.
        version = (hashlib.sha256(_content(image.source)).hexdigest(),)
    key = repr((tile_files.VERSION, image.source, version, image.color_space))
    name = hashlib.sha256(key.encode()).hexdigest()[:32] + tile_files.SUFFIX
    return cache_folder() / name


def _write(image: _Image, target: Path) -> None:
    with _on_disk(image.source) as file:
        tile_files.write(file, target, image.color_space)


@contextmanager
def _on_disk(image: str) -> Iterator[str]:
    """Give the image's file, unpacked where it is in a package."""
    if Path(image).is_file():
        yield image
        return
    with tempfile.TemporaryDirectory(prefix="kilauea-") as folder:
        file = Path(folder) / f"image{Path(_file_name(image)).suffix}"
        file.write_bytes(_content(image))
        yield str(file)


def _content(image: str) -> bytes:
    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(image))
    if not asset:
        raise FileNotFoundError(f"{image} cannot be opened")
    return asset.GetBuffer()


def _file_name(image: str) -> str:
    return Path(image.rstrip("]").replace("[", "/")).name
