"""Gray levels of colours. This module loads no OpenCV, so that the service may read files with it."""

from __future__ import annotations

LUMA_BGR = (0.114, 0.587, 0.299)
"""Shares of blue, green and red in a gray level (ITU-R BT.601)."""
