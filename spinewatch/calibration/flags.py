"""Flags of a calibration."""

from __future__ import annotations

from collections.abc import Sequence

from spinewatch.calibration.solve.blunders import Blunder
from spinewatch.calibration.solve.bundle import BundleAdjustment
from spinewatch.flags import Flag

_EXPECTED_FREE = ("f", "x0", "y0", "K1")


def calibration_flags(
    adjustment: BundleAdjustment,
    blunders: Sequence[Blunder],
    camera_names: Sequence[str],
    shot_names: Sequence[str],
) -> tuple[Flag, ...]:
    """Return the flags of an adjustment.

    Parameters
    ----------
    adjustment
        The adjustment.
    blunders
        Points that were removed.
    camera_names, shot_names
        Names of its cameras and shots.

    Returns
    -------
    tuple of Flag
        ``control-point-removed`` per blunder, ``adjustment-unfinished``, ``no-redundancy`` and ``parameters-held``.
    """
    return (
        *(_removed(b, camera_names[b.camera], shot_names[b.shot]) for b in blunders),
        *_determinability(adjustment),
        *_held(adjustment, camera_names),
    )


def _removed(blunder: Blunder, camera: str, shot: str) -> Flag:
    return Flag(
        "control-point-removed",
        f"{camera}, shot {shot}: point {blunder.id} has a residual of {blunder.residual_px:.2f} px and was removed",
    )


def _determinability(adjustment: BundleAdjustment) -> list[Flag]:
    flags = []
    if not adjustment.converged:
        flags.append(
            Flag(
                "adjustment-unfinished",
                "the adjustment was stopped before it converged; give more points, or adjust fewer parameters",
            )
        )
    if adjustment.block.dof <= 0:
        flags.append(
            Flag(
                "no-redundancy",
                "there are no more observations than unknowns, and the accuracy cannot be estimated; show more points",
            )
        )
    return flags


def _held(adjustment: BundleAdjustment, camera_names: Sequence[str]) -> list[Flag]:
    flags = []
    for camera, free in zip(camera_names, adjustment.block.free, strict=True):
        if held := [name for name in _EXPECTED_FREE if name not in free]:
            flags.append(
                Flag(
                    "parameters-held",
                    f"{camera}: {', '.join(held)} held: not determined by the points, or not to be adjusted",
                )
            )
    return flags
