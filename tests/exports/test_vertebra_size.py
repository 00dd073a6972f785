"""Nominal sizes of vertebral bodies."""

from __future__ import annotations

import pytest

from exports.vertebra_size import body_size_mm

LEVELS = [f"C{n}" for n in range(1, 8)] + [f"T{n}" for n in range(1, 14)] + [f"L{n}" for n in range(1, 7)]


@pytest.mark.parametrize("level", [*LEVELS, "S1", "S5", "L9", "T20", "S99"])
def test_every_name_has_a_plausible_size(level: str) -> None:
    depth, width, height = body_size_mm(level)
    assert 10 < depth < 40
    assert 15 < width < 55
    assert 10 < height < 35


def test_knots() -> None:
    assert body_size_mm("T1") == (18.0, 28.0, 16.0)
    assert body_size_mm("T12") == (31.0, 38.0, 24.0)
    assert body_size_mm("L3") == (34.0, 45.0, 27.0)
