"""Robust statistics."""

from __future__ import annotations

MAD_TO_SD = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
