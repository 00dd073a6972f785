"""Flags of a calibration."""

from __future__ import annotations

from spinewatch.flags.kind import FlagKind

KINDS = (
    FlagKind(
        "control-point-removed",
        "calibration",
        "An image point of the control field contradicts the others and was removed; the detail names side, shot,"
        " point and residual.",
        "Look at the point in the image. Measure its coordinates again if the same point is removed in several shots.",
        "1 of 200 sound simulated calibrations (`python -m bench.calibration_alarms`)",
    ),
    FlagKind(
        "parameters-held",
        "calibration",
        "One of f, x0, y0 and K1 was held at zero or at the given value: the points do not determine it, or it was not"
        " to be adjusted.",
        "Nothing if it was intended. Otherwise show more points, nearer the corners and of more different heights, or"
        " another tilted shot.",
    ),
    FlagKind(
        "held-value-contradicted",
        "calibration",
        "A value at which a parameter was held, as by `--fix f=8`, is not that which the points show, by more than 4"
        " standard deviations: positions of the cameras and all measurements follow from it.",
        "Adjust the parameter. A nominal focal length or the centre of the image are seldom those of a lens.",
        "0 of 120 simulated calibrations with f, K1 or x0 and y0 held at their true values, 1 to 3 shots, noise of 0.03"
        " to 0.2 px; f held 1% off is flagged in 18 of 25, 3% off in 25 of 25",
    ),
    FlagKind(
        "no-redundancy",
        "calibration",
        "There are as many unknowns as observations: residuals are zero and no deviation can be stated.",
        "Show more points or give more shots.",
    ),
    FlagKind(
        "adjustment-unfinished",
        "calibration",
        "The adjustment was stopped while it still improved; the rig and its deviations are not those of least"
        " squares.",
        "Show more points or free fewer parameters.",
    ),
    FlagKind(
        "pixel-size-doubtful",
        "calibration",
        "The image points show another aspect of the pixels (height over width) than the pixel size that was given or"
        " assumed; focal length and distances along the optical axes may be wrong.",
        "Give the pixel size of the camera (`--pixel-size`), or adjust the aspect (`--estimate-aspect`).",
        "0 of 200 simulated calibrations, 1 to 4 shots, noise 0.02 to 0.3 px (`python -m bench.calibration_alarms`)",
    ),
    FlagKind(
        "calibration-poor",
        "calibration",
        "The image residuals, the deviation of the baseline or the residuals on the board are larger than those of a"
        " careful calibration; the rig is given, and its positions are less accurate.",
        "Check pixel size and control field, look at the points with large residuals, and give more shots, tilted"
        " differently.",
        "0 of 200 simulated calibrations, 1 to 4 shots, noise 0.02 to 0.1 px; 4 of 200 with noise to 0.3 px, whose"
        " baselines are less accurate than 1%. The real cavity is flagged: it was photographed through glass.",
    ),
    FlagKind(
        "shot-repeated",
        "calibration",
        "A shot shows the board where an earlier shot shows it: another file or exposure of the same placement. It was"
        " left out of adjustment and verification.",
        "Move or tilt the board between shots.",
        "0 of 200 simulated calibrations, 1 to 4 shots, shifted by 10 mm on average",
    ),
)
"""Kinds of flags of a calibration, in the order of docs/flags.md."""
