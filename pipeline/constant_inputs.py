"""Inputs of material records that are the same everywhere."""

from __future__ import annotations

from typing import Any

from unsupported import UnsupportedError


def constant(record: dict[str, Any], name: str, default: Any) -> Any:
    """Return an input: a number where the default is one, else a triple.

    Raises
    ------
    UnsupportedError
        It comes from a texture or another pattern.
    """
    source = record["inputs"].get(name)
    if source is None:
        return default
    node = record["nodes"][source["node"]]
    if node["type"] != "constant":
        raise UnsupportedError(f"{record['path']}: a pattern for {name}")
    if source["channel"] == "rgb" and not isinstance(default, float):
        return tuple(node["value"][:3])
    return node["value"]["rgba".index(source["channel"]) if source["channel"] != "rgb" else 0]


def emission(record: dict[str, Any]) -> tuple[float, ...] | None:
    """Return the radiance of a material, None where it has none."""
    if "emissiveColor" not in record["inputs"]:
        return None
    value = constant(record, "emissiveColor", None)
    return value if any(value) else None
