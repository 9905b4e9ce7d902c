from __future__ import annotations

import pytest
from kilauea import framespec
from kilauea.errors import UsageError


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("7", [7]),
        ("1,3,5", [1, 3, 5]),
        ("1:4", [1, 2, 3, 4]),
        ("1:10x4", [1, 5, 9]),
        ("3:1", [3, 2, 1]),
        ("-2:0", [-2, -1, 0]),
        ("0:0.3x0.1", [0, 0.1, 0.2, 0.3]),
        ("1:3,2,9", [1, 2, 3, 9]),
    ],
)
def test_parse_frames(text, frames):
    assert framespec.parse_frames(text) == pytest.approx(frames)


@pytest.mark.parametrize("text", ["", "a", "1:", "1:5x0", "1:5x-1", "1:1e12", "1:nan"])
def test_bad_frames(text):
    with pytest.raises(UsageError):
        framespec.parse_frames(text)


@pytest.mark.parametrize(
    ("pattern", "name"),
    [
        ("a.$F.exr", "a.7.exr"),
        ("a.$F4.exr", "a.0007.exr"),
        ("a.${F4}b.exr", "a.0007b.exr"),
        ("a.<F4>.exr", "a.0007.exr"),
        ("a.%04d.exr", "a.0007.exr"),
        ("a.####.exr", "a.0007.exr"),
        ("a.$N.exr", "a.3.exr"),
        ("a.exr", "a.exr"),
    ],
)
def test_expand(pattern, name):
    assert framespec.expand(pattern, 7.0, index=2) == name


@pytest.mark.parametrize(("frame", "text"), [(1.5, "0001.5"), (-3, "-003"), (12345, "12345")])
def test_frame_numbers(frame, text):
    assert framespec.format_frame(frame, 4) == text


def test_frames_never_share_a_file():
    assert framespec.output_files(["a.$F.exr", "a.$F.png"], [1, 2]) == [
        ["a.1.exr", "a.1.png"],
        ["a.2.exr", "a.2.png"],
    ]
    with pytest.raises(UsageError, match=r"a\.exr"):
        framespec.output_files(["a.exr"], [1, 2])
    with pytest.raises(UsageError, match=r"a\.1\.exr"):
        framespec.output_files(["a.$F.exr", "a.%d.exr"], [1])
