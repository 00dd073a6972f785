"""Values of parameters that were given and held, and that the image points contradict."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.solve.bundle import BundleAdjustment, adjust
from spinewatch.calibration.solve.collinearity import PARAMETER_NAMES, camera_vector
from spinewatch.errors import SpinewatchError
from spinewatch.flags import Flag


def held_value_doubts(
    adjustment: BundleAdjustment,
    camera_names: Sequence[str],
    held: Collection[str],
    parameters: CalibrationLimits,
) -> tuple[Flag, ...]:
    """Return a flag for each camera and value that was held and that its points contradict.

    Each parameter is adjusted in a second adjustment, in all cameras, and its value compared with the held one.

    Parameters
    ----------
    adjustment
        Adjustment with the parameters held.
    camera_names
        Names of its cameras.
    held
        Names of the parameters.
    parameters
        Limits: ``sigmas`` standard deviations of the adjusted value.

    Returns
    -------
    tuple of Flag
        ``held-value-contradicted``; none for a parameter that the points do not determine.

    References
    ----------
    The test of a single parameter by its adjusted value: T. Luhmann et al., Close-Range Photogrammetry and 3D Imaging,
    section 2.4.
    """
    flags: list[Flag] = []
    for name in (name for name in PARAMETER_NAMES if name in held):
        other = _freed(adjustment, name)
        if other is None:
            continue
        place = PARAMETER_NAMES.index(name)
        for c, camera_name in enumerate(camera_names):
            value, found = (camera_vector(one.block.cameras[c])[place] for one in (adjustment, other))
            sd = other.camera_sd(c)[name]
            if abs(found - value) > parameters.sigmas * sd:
                flags.append(
                    Flag(
                        "held-value-contradicted",
                        f"{camera_name}: {name} was held at {value:.5g}, and the points show {found:.5g} +- {sd:.2g};"
                        " adjust it instead of holding it, or give its calibrated value",
                    )
                )
    return tuple(flags)


def _freed(adjustment: BundleAdjustment, name: str) -> BundleAdjustment | None:
    """Return the adjustment with another parameter free; None when the points do not determine it."""
    block = adjustment.block
    free = tuple(tuple(n for n in PARAMETER_NAMES if n in names or n == name) for names in block.free)
    try:
        other = adjust(replace(block, free=free))
    except SpinewatchError:
        return None
    return other if other.is_determined and other.block.dof > 0 else None
