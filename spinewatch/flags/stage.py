"""Flags of a stage."""

from __future__ import annotations

from spinewatch.flags.kind import FlagKind

KINDS = (
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
        "centre-unused",
        "stage",
        "No triad with a pose uses a centre that a person placed: it is not where a ball of a triad can be. The feature"
        " that was detected there is gone, so that its ball may count as hidden.",
        "Compare the centre with the image, and move it or take the edit back.",
        "only in stages whose centres were edited",
    ),
    FlagKind(
        "centre-displaced",
        "stage",
        "A person placed the centre of a ball beside a detected feature like a ball that no triad uses, or all centres"
        " of a triad in an image are displaced together from such features: the pose then has another place, mostly"
        " another depth, with residuals as small as before. The deviation of a single displaced centre was widened by"
        " the distance. A centre where nothing like a ball was detected has a wider deviation and no flag.",
        "Compare the centres with the image, and move them or take the edits back.",
        "2 of 201 edits of rendered pairs that place one or three centres on balls, both where the three had not been"
        " detected. Three centres of a triad 8 px off along the rows in one image raise it in 44 of 51, and other flags"
        " in the other 7; a single one in 30 of 51, and other flags in 20 (`python -m bench.placed_centres`)",
    ),
    FlagKind(
        "triad-moved-by-edit",
        "stage",
        "A triad with a centre that a person placed is far from where the take before had found it, in full view and"
        " without such a centre.",
        "Compare both takes with the images. If the take before was wrong, nothing; otherwise take the edits back.",
        "0 of the same 201 edits; three centres 20 px off raise it in 41 of 50, and 8 px off balls that were not"
        " detected in 50 of 51 (`python -m bench.placed_centres`)",
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
        " labels; all labels are null.",
        "Take the stage again with every triad in view.",
        "0 of 500 sound simulated stages with every ball in view (`python -m bench.mistakes`)",
    ),
    FlagKind(
        "calibration-drift",
        "stage",
        "A camera has moved since the calibration: the ball images are off their epipolar lines, or the markers are"
        " not measured in their size, which a rotation about the vertical of the image or a changed base causes. A"
        " shift of a few millimetres towards the field is not detected. Movement of the patient between exposures that"
        " were not taken together looks the same (`views-not-synchronous`). The size of the markers is also judged over"
        " all stages of a surgery that were measured before with the same calibration.",
        "Check the cameras and calibrate again. If only the size is off, check that the markers are the ones"
        " configured.",
        "0.5% of 200 simulated stages with calibration errors of 0.005 degrees and 0.05 mm (`python -m"
        " bench.matching`); none of 22 rendered ones",
    ),
    FlagKind(
        "lens-differs",
        "stage",
        "The calibration of the stage describes another lens than that of an earlier stage of the surgery: distortion"
        " or the aspect of pixels differ by more than between two calibrations of one lens. In one of them K1 may have"
        " the wrong sign. What the lenses displace appears as motion between the stages.",
        "Look at K1 and the pixel size of both calibrations; adjust the same parameters in both. Nothing if another"
        " cart was used.",
        "0 of 542 pairs of simulated calibrations of one rig, 1 and 3 shots of a peg board, noise to 0.1 px; about 3%"
        " with 0.2 px. The other sign of K1 in one of two is flagged in all of 544 ordered pairs, noise of 0.1 and"
        " 0.2 px",
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
        "Mend the cause that is named and measure again; without one, check that both images are of the same exposure"
        " and of this rig, and clear the view.",
        "no wrong cause in 154 rendered pairs with hidden balls, exchanged images, images of two moments, another rig"
        " or a moved camera",
    ),
    FlagKind(
        "calibration-old",
        "stage",
        "The calibration was older than `SPINEWATCH_CALIBRATION_MAX_AGE_DAYS` when the stage was taken. Cameras are"
        " refocused and the cart is moved between operations, so each needs its own calibration; errors may exceed the"
        " stated deviations.",
        "Calibrate before the operation. If the rig was not touched since, look at the drift of its stages"
        " (`GET /v1/calibrations/{id}/checks`).",
    ),
    FlagKind(
        "marker-doubtful",
        "stage",
        "Most triads are missing or have hidden balls with the marker that was given, and fit another one in full view:"
        " the lengths of its legs in another order, in cm, inches, halves or doubles, or the marker of the thesis. The"
        " poses are those of a wrong marker.",
        "Name the marker, or give the lengths of its legs in mm and in the order of its balls, and measure again.",
        "0 of 900 simulated stages with the right marker, in 600 of which a sixth or a third of the images of balls"
        " are hidden; of 300 stages of 2 to 6 triads whose marker is reversed 80% raise it"
        " (`python -m bench.given_markers`)",
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
        " that of a spine, or other vertebrae fit a hundred times better; or the earlier stage that was given has other"
        " vertebrae, or fits in the opposite order; all labels are null. Or labels that a person"
        " gave are not in the order of the surgery's vertebrae along the spine axis, or do not fit the distances; they"
        " stay as they were given, and motion that follows from them is likely wrong.",
        "Check the names of the vertebrae, and declare T13 or L6 as an extra level. The triads themselves are"
        " measured. Correct labels that were given by hand.",
        "0.1% of 18 000 simulated chains of 2 to 7 triads with 22 and 27 mm per level, 0.5% at 20 mm, 2.6% at 18 mm;"
        " 0 of 500 sound simulated stages (`python -m bench.mistakes`). 0 of 600 stages of simulated surgeries beside"
        " their baseline as the earlier stage; 598 of them in the opposite order",
    ),
    FlagKind(
        "spine-axis-implausible",
        "stage",
        "The triads do not lie along the spine axis that was given, or between the axes x and y when none was given,"
        " so that their order is not determined; all labels are null.",
        "Give the object axis along which the spine lies.",
        "0 of 500 sound simulated stages (`python -m bench.mistakes`)",
    ),
    FlagKind(
        "frame-repeated",
        "stage",
        "An image is that of an earlier stage of the surgery, exactly or all but noise: no part of it has moved."
        " Motion between the two stages is zero because it is the same exposure, not because nothing moved.",
        "Send the images that were taken at this stage. A camera or frame grabber may have delivered an old frame.",
        "0 of 182 pairs of different rendered scenes, in which most moves; 0 of 160 pairs in which one region of 80 px"
        " moved by 0.5 px or more (`tests/spinewatch/imaging/test_comparison.py`). A second exposure in which nothing"
        " moves by 0.1 px is flagged.",
    ),
    FlagKind(
        "time-implausible",
        "stage",
        "The stage was captured before its calibration was made (or stored, if that time is unknown), before a stage"
        " that was sent earlier, or, as a later take, after a stage that comes after it, by more than"
        " `SPINEWATCH_CLOCK_TOLERANCE_SECONDS`.",
        "Check the clock of the cart, the calibration that was named, and that the images belong to this stage.",
        "0 with clocks within the tolerance of 300 s; stages that are sent in another order than they were captured"
        " are flagged.",
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
)
"""Kinds of flags of a stage, in the order of docs/flags.md."""
