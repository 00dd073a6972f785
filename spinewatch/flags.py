"""Flags: named doubts about a result. Nothing is dropped or doubted without one.

`FLAGS` lists every flag with its meaning and what to do; docs/flags.md is generated from it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class FlagKind:
    """What a flag means.

    Attributes
    ----------
    code
        Stable name, for machines.
    subject
        What the flag is about: image, stage, calibration.
    meaning
        What was found.
    action
        What to do about it.
    false_alarms
        How often sound input raises the flag where it has a threshold: measured rate, on what, and the command that
        prints it. Empty for a flag without a threshold.
    """

    code: str
    subject: str
    meaning: str
    action: str
    false_alarms: str = ""


@dataclass(frozen=True)
class Flag:
    """A flag raised on a result.

    Attributes
    ----------
    code
        Code of a kind in `FLAGS`.
    detail
        Sentence with the numbers that raised it, for people.
    """

    code: str
    detail: str

    def __post_init__(self) -> None:
        if self.code not in FLAGS:
            raise ValueError(f"{self.code!r} is no flag; add its kind to spinewatch/flags.py")


_KINDS = (
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
        "A part of the image is lost: the gray levels of a JPEG jump from one block on, or an area has one gray level"
        " without noise. Balls may be displaced together, which is a false depth.",
        "Copy the file again, or take the stage again.",
        "0 of 58 sound rendered and real images, and 0 of 522 variants of them (`image-quality.md`)",
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
    FlagKind(
        "triad-count-low",
        "stage",
        "Fewer triads were found than were placed; those that were found are given.",
        "Look for a hidden ball, clear the view and take the stage again.",
        "0 of 500 sound simulated stages with every ball in view (`python -m bench.mistakes`)",
    ),
    FlagKind(
        "ball-occluded",
        "stage",
        "A ball is hidden in one view; the pose of its triad follows from the other ball images, with larger"
        " deviations.",
        "Clear the view and take the stage again where the deviations matter.",
        "0 of 500 sound simulated stages with every ball in view (`python -m bench.mistakes`)",
    ),
    FlagKind(
        "ball-manual",
        "stage",
        "A person placed the centre of a ball; its deviation is that of such a centre, and the pose follows from it.",
        "Compare the images with the centre, and look at the residuals of the triad.",
    ),
    FlagKind(
        "edit-lost",
        "stage",
        "A person had decided on the label of a triad, and after further edits of ball centres no triad is there.",
        "Look at the triads and their labels again.",
    ),
    FlagKind(
        "labels-kept",
        "stage",
        "The stage that had decided on labels was revised, and labels were found again; those that a person gave stay.",
        "Compare the labels with those of the other stages.",
    ),
    FlagKind(
        "parameters-changed",
        "stage",
        "A revision measured the images with other parameters than the workers' own: what raises other flags may be"
        " changed too, so that one is missing here.",
        "Compare the result and its flags with those of the take before. Measure again without parameters that were"
        " not meant.",
    ),
    FlagKind(
        "triad-incomplete",
        "stage",
        "The visible balls of a triad do not determine its pose; the triad is given without one.",
        "Clear the view and take the stage again.",
        "0 of 500 sound simulated stages with every ball in view (`python -m bench.mistakes`)",
    ),
    FlagKind(
        "triad-doubtful",
        "stage",
        "What was found may be no triad, or one with a wrong ball; it is given without a pose and without a label.",
        "Look at the ball images of the triad. Place their centres, or clear the view and take the stage again.",
        "0 of 50 true triads of 11 rendered stages; more in images unlike those of the training"
        " (`python -m bench.doubt`)",
    ),
    FlagKind(
        "appearance-unusual",
        "stage",
        "The residuals of the triads are larger than in the images that the detector was trained with: other light,"
        " blur or material of the balls. All deviations were enlarged by as much; what all balls of an image share does"
        " not show in residuals.",
        "Check the lamp, the focus and the surface of the balls. Compare stages only if they look the same.",
        "none of 11 rendered stages like those of the training (`python -m bench.scenes`)",
    ),
    FlagKind(
        "labels-uncertain",
        "stage",
        "Triads are missing and the gaps between the others do not determine which, or there are more triads than"
        " labels;"
        " all labels are null.",
        "Take the stage again with every triad in view.",
        "0 of 500 sound simulated stages with every ball in view (`python -m bench.mistakes`)",
    ),
    FlagKind(
        "calibration-drift",
        "stage",
        "A camera has moved since the calibration: the ball images are off their epipolar lines, or the markers are"
        " not"
        " measured in their size, which a rotation about the vertical of the image or a changed base causes. A"
        " shift of"
        " a few millimetres towards the field is not detected. Movement of the patient between exposures that were not"
        " taken together looks the same (`views-not-synchronous`).",
        "Check the cameras and calibrate again. If only the size is off, check that the markers are the ones"
        " configured.",
        "0.5% of 200 simulated stages with calibration errors of 0.005 degrees and 0.05 mm (`python -m"
        " bench.matching`); none of"
        " 22 rendered ones",
    ),
    FlagKind(
        "triad-count-high",
        "stage",
        "More triads are in full view than were expected; all of them are given, without labels.",
        "Name every triad in view, in order, and measure the stage again.",
        "0 of 350 simulated stages with 10 to 185 false features",
    ),
    FlagKind(
        "no-triads",
        "stage",
        "None, or fewer than half, of the triads were found; the detail names the likeliest cause: left and right"
        " exchanged, an image mirrored or turned, a camera that moved, or balls hidden.",
        "Mend the cause that is named and measure again; without one, check that both images are of the same"
        " exposure and"
        " of this rig, and clear the view.",
        "no wrong cause in 154 rendered pairs with hidden balls, exchanged images, images of two moments, another"
        " rig or a"
        " moved camera",
    ),
    FlagKind(
        "calibration-old",
        "stage",
        "The calibration was older than `SPINEWATCH_CALIBRATION_MAX_AGE_DAYS` when the stage was taken. Cameras are"
        " refocused and the cart is moved between operations, so each needs its own calibration; errors may exceed"
        " the"
        " stated deviations.",
        "Calibrate before the operation. If the rig was not touched since, look at the drift of its stages"
        " (`GET /v1/calibrations/{id}/checks`).",
    ),
    FlagKind(
        "rig-refined",
        "stage",
        "The relative orientation of the cameras was corrected from the ball images before measuring.",
        "Calibrate again when possible.",
    ),
    FlagKind(
        "levels-implausible",
        "stage",
        "The distances between the triads do not fit the vertebrae that were named: a distance per level is outside"
        " that"
        " of a spine, or other vertebrae fit a hundred times better; all labels are null.",
        "Check the names of the vertebrae, and declare T13 or L6 as an extra level. The triads themselves are"
        " measured.",
        "0.1% of 18 000 simulated chains of 2 to 7 triads with 22 and 27 mm per level, 0.5% at 20 mm, 2.6% at 18 mm;"
        " 0 of 500 sound simulated stages (`python -m bench.mistakes`)",
    ),
    FlagKind(
        "spine-axis-implausible",
        "stage",
        "The triads do not lie along the spine axis that was given, or between the axes x and y when none was"
        " given, so"
        " that their order is not determined; all labels are null.",
        "Give the object axis along which the spine lies.",
        "0 of 500 sound simulated stages (`python -m bench.mistakes`)",
    ),
    FlagKind(
        "frame-repeated",
        "stage",
        "An image is that of an earlier stage of the surgery, exactly or all but noise: no part of it has moved."
        " Motion"
        " between the two stages is zero because it is the same exposure, not because nothing moved.",
        "Send the images that were taken at this stage. A camera or frame grabber may have delivered an old frame.",
        "0 of 182 pairs of different rendered scenes, in which most moves; 0 of 160 pairs in which one region of 80"
        " px"
        " moved by 0.5 px or more (`tests/spinewatch/imaging/test_comparison.py`). A second exposure in which nothing"
        " moves by 0.1 px is flagged.",
    ),
    FlagKind(
        "time-implausible",
        "stage",
        "The stage was captured before its calibration was made (or stored, if that time is unknown), or before a"
        " stage"
        " that was sent earlier, by more than `SPINEWATCH_CLOCK_TOLERANCE_SECONDS`.",
        "Check the clock of the cart, the calibration that was named, and that the images belong to this stage.",
        "0 with clocks within the tolerance of 300 s; stages that are sent in another order than they were captured"
        " are"
        " flagged.",
    ),
    FlagKind(
        "pair-mixed",
        "stage",
        "The two images do not belong together as left and right: an image is the other side's of an earlier stage.",
        "Send the two images that both cameras took at the same time, each as its own side.",
    ),
    FlagKind(
        "views-not-synchronous",
        "stage",
        "The two views were exposed at different times, and a vertebra that breathes may have moved between them by"
        " more than the measurement can bear: its depth is wrong by several times that, and the rays miss each other.",
        "Trigger both cameras together, or expose in apnoea.",
        "Exact: the delay comes with the times of exposure",
    ),
    FlagKind(
        "burst-outlier",
        "stage",
        "In some pairs of the burst a triad is far from where the others show it; these poses are left out of the"
        " mean.",
        "Look at those pairs: something may have touched the marker or hidden a part of it.",
        "0 of 2000 simulated bursts of 8 to 40 pairs, half of them breathing by 2 mm every 4 s",
    ),
    FlagKind(
        "burst-incomplete",
        "stage",
        "Some pairs of the burst show no pose of a triad that others show; its mean is over fewer pairs.",
        "Nothing if its deviation is small enough. Otherwise clear the view of the marker and take the burst again.",
    ),
    FlagKind(
        "breathing-unresolved",
        "stage",
        "The pairs of the burst neither determine breathing nor average it: the mean may be displaced by a part of its"
        " amplitude, mostly the same for all vertebrae.",
        "Take more pairs over two breaths or more and send their times, or expose in apnoea.",
    ),
    FlagKind(
        "radiograph-landmark-left-out",
        "spine",
        "A common landmark names a triad that has no pose at the baseline stage, and is left out of the fit of the"
        " radiographs.",
        "Take the baseline stage again, or give the point in object space.",
    ),
    FlagKind(
        "reference-moved",
        "spine",
        "The reference triad moved against all others, which did not move among each other: either its clamp slipped,"
        " or the whole spine moved against the reference vertebra. A clamp that slipped shows as a motion of every"
        " other vertebra.",
        "Look at the clamp of the reference. If it slipped, name another reference in the setup of the spine.",
        "1.3% of 600 sound pairs of simulated stages with T7, T9, T11 and L1, 0% of 596 with markers on end vertebrae"
        " and apices; a slip of 8 degrees is seen in 91% (`python -m bench.spine --part plausibility`)",
    ),
    FlagKind(
        "intervertebral-distance-implausible",
        "spine",
        "The distance between the triads of neighbouring vertebrae changed by more than a spine allows.",
        "Look whether one of the two markers was clamped again or bent; if it was, re-baseline it"
        " (`POST /v1/surgeries/{id}/spine/rebaselines`).",
        "0.7% and 0.3% of the same pairs (`python -m bench.spine --part plausibility`)",
    ),
    FlagKind(
        "intervertebral-rotation-implausible",
        "spine",
        "Neighbouring vertebrae turned against each other by more than the segments between them allow.",
        "Look whether one of the two markers was clamped again or touched; if it was, re-baseline it.",
        "0 of 1,196 of the same pairs (`python -m bench.spine --part plausibility`)",
    ),
    FlagKind(
        "neighbours-disagree",
        "spine",
        "A vertebra moved far from where the motion of its two marked neighbours would carry it.",
        "Look whether its marker was clamped again or touched; if it was, re-baseline it.",
        "0 of 1,196 of the same pairs; a marker turned by 45 degrees raises a flag in 100%"
        " (`python -m bench.spine --part plausibility`)",
    ),
    FlagKind(
        "radiograph-scale",
        "spine",
        "The scale of the fit from the radiographs to object space differs from 1 by 2% or more, or by more than its"
        " deviation explains; all distances between vertebrae share the error.",
        "Give the pixel spacing at the patient instead of that at the detector, and look at the common points.",
        "1 of 1,000 simulated pairs of radiographs (`python -m bench.radiographs --pairs 1000`)",
    ),
    FlagKind(
        "radiograph-point-doubtful",
        "spine",
        "A point that radiographs and cameras have in common lies farther from where the others place it than its error"
        " explains.",
        "Digitize the point again, or leave it out.",
        "0 of 1,000 simulated pairs of radiographs (`python -m bench.radiographs --pairs 1000`)",
    ),
    FlagKind(
        "radiograph-points-disagree",
        "spine",
        "The common points fit worse than their errors explain, and no single one is the cause: the spine had another"
        " posture in the radiographs, or the landmarks are less accurate than stated. Deviations are enlarged.",
        "State a larger landmark_sd_px, or use points that do not depend on posture.",
        "0 of 1,000 simulated pairs of radiographs (`python -m bench.radiographs --pairs 1000`)",
    ),
    FlagKind(
        "radiograph-heights-differ",
        "spine",
        "The PA and the lateral radiograph show the same points at different heights: their scales differ, or the"
        " patient moved between them.",
        "Check both pixel spacings and that both views show the same moment.",
        "0 of 1,000 simulated pairs of radiographs (`python -m bench.radiographs --pairs 1000`)",
    ),
    FlagKind(
        "radiograph-axes-differ",
        "spine",
        "The fit turns the axes of the radiographs by more than 30 degrees against the patient axes that the setup"
        " states; a spine bends less between two postures.",
        "Check the directions to the head and to the left in the setup, and the names of the common points.",
        "0 of 200 simulated pairs of radiographs, whose axes are those of the setup"
        " (`tests/spinewatch/spine/test_radiographs.py`)",
    ),
    FlagKind(
        "radiograph-rotation-unknown",
        "spine",
        "Vertebrae without pedicles in the PA radiograph have no measured axial rotation; it is set to 0 with a large"
        " deviation.",
        "Digitize both pedicles where they show.",
    ),
    FlagKind(
        "control-point-removed",
        "calibration",
        "An image point of the control field contradicts the others and was removed; the detail names side, shot,"
        " point"
        " and residual.",
        "Look at the point in the image. Measure its coordinates again if the same point is removed in several"
        " shots.",
        "1 of 200 sound simulated calibrations (`python -m bench.calibration_alarms`)",
    ),
    FlagKind(
        "parameters-held",
        "calibration",
        "One of f, x0, y0 and K1 was held at zero or at the given value: the points do not determine it, or it was"
        " not"
        " to be adjusted.",
        "Nothing if it was intended. Otherwise show more points, nearer the corners and of more different heights, or"
        " another tilted shot.",
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
        "A shot shows the board where an earlier shot shows it: another file or exposure of the same placement. It"
        " was"
        " left out of adjustment and verification.",
        "Move or tilt the board between shots.",
        "0 of 200 simulated calibrations, 1 to 4 shots, shifted by 10 mm on average",
    ),
)

FLAGS: Mapping[str, FlagKind] = {kind.code: kind for kind in _KINDS}
"""Every kind of flag by its code."""
