"""Flags of an image."""

from __future__ import annotations

from spinewatch.flags.kind import FlagKind

KINDS = (
    FlagKind(
        "blank-image",
        "image",
        "The gray levels of an image span almost nothing; no feature can be detected.",
        "Look for a closed aperture, a lens cap or a loose cable.",
        "0 of 22 rendered images of stages (`python -m bench.scenes`)",
    ),
    FlagKind(
        "image-dark",
        "image",
        "The image is darker than it should be even after two gamma corrections; features may be missed.",
        "Open the aperture or brighten the lamp.",
        "0 of 18 rendered images of normal exposure or with glare (`python -m bench.scenes`)",
    ),
    FlagKind(
        "image-saturated",
        "image",
        "A large part of the image is at full scale; balls in it cannot be detected.",
        "Close the aperture or dim the lamp.",
        "0 of 20 rendered images of normal or low exposure (`python -m bench.scenes`)",
    ),
    FlagKind(
        "no-features",
        "image",
        "Nothing in the image resembles a ball.",
        "Check that the cameras are aimed at the field and that the calibration belongs to this rig.",
        "0 of 22 rendered images of stages (`python -m bench.scenes`)",
    ),
    FlagKind(
        "image-compressed",
        "image",
        "The image was compressed as JPEG, of quality 90 or less. Centres are less accurate; the networks state so,"
        " and deviations are enlarged further by what they miss (`image-quality.md`).",
        "Send the camera's frame as PNG or TIFF, without lossy compression.",
        "0 of 58 sound rendered and real images, and 0 of 522 variants of them (`image-quality.md`)",
    ),
    FlagKind(
        "image-damaged",
        "image",
        "A part of the image is lost or displaced: the gray levels of a JPEG jump from one block on, an area has one"
        " gray level without noise, or the rows are displaced to the side from one row on. Balls may be displaced"
        " together, which is a false depth.",
        "Copy the file again, or take the stage again.",
        "0 of 58 sound rendered and real images, and 0 of 522 variants of them; displaced rows: 0 of 67, and 3 of 1,560"
        " variants, doubled rows and overexposure (`image-quality.md`)",
    ),
    FlagKind(
        "image-blurred",
        "image",
        "Edges at the balls are wide: the lens is out of focus, or something moved during the exposure. Deviations"
        " are enlarged with the width.",
        "Focus both cameras; expose for a shorter time, in apnoea.",
        "0 of 38 sound rendered images of stages, and 0 of 228 variants of them (`image-quality.md`)",
    ),
    FlagKind(
        "image-banded",
        "image",
        "The brightness changes in periodic bands over the height: the shutter rolls while the lamps flicker. The"
        " centres are hardly affected, but rows are exposed at different times.",
        "Expose for whole periods of the mains, or use lamps without flicker.",
        "0 of 58 sound rendered and real images, and 0 of 522 variants of them (`image-quality.md`)",
    ),
    FlagKind(
        "image-interlaced",
        "image",
        "The fields of an interlaced frame were exposed at different times, or one field was doubled. Deviations are"
        " enlarged by what was measured for such frames.",
        "Send whole frames, whose rows are exposed at the same time.",
        "0 of 58 sound rendered and real images, and 0 of 522 variants of them (`image-quality.md`)",
    ),
    FlagKind(
        "image-coarse",
        "image",
        "The image has far fewer gray levels than its range.",
        "Export the image with 8 bits or more.",
        "0 of 58 sound rendered and real images, and 0 of 522 variants of them (`image-quality.md`)",
    ),
    FlagKind(
        "image-noisy",
        "image",
        "The noise is so large that balls may be missed.",
        "Use more light and less amplification.",
        "0 of 58 sound rendered and real images, and 0 of 522 variants of them (`image-quality.md`)",
    ),
    FlagKind(
        "image-negative",
        "image",
        "Balls are found in the negative of the image only.",
        "Export the image with black as zero.",
        "0 of 38 sound rendered images of stages, and 0 of 228 variants of them (`image-quality.md`)",
    ),
    FlagKind(
        "exposure-unequal",
        "image",
        "One view is much darker than the other.",
        "Give both cameras the same exposure; look for a covered lens or a closed aperture.",
        "0 of 38 sound rendered images of stages, and 0 of 228 variants of them (`image-quality.md`)",
    ),
    FlagKind(
        "pixel-defect",
        "image",
        "Lone pixels of an image of more than 8 bits need a bit depth that no other pixel uses; they are taken as"
        " white.",
        "Correct the defects of the sensor in the camera.",
        "0 of 38 sound rendered images of stages, written with 16 bits",
    ),
)
"""Kinds of flags of an image, in the order of docs/flags.md."""
