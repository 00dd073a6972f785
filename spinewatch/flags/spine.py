"""Flags of a spine."""

from __future__ import annotations

from spinewatch.flags.kind import FlagKind

KINDS = (
    FlagKind(
        "initial-tilts-doubtful",
        "spine",
        "The tilts of the initial poses do not follow the line of their centroids, are 0 or of another size than it"
        " shows, or all are below 1.6 degrees along several levels, as they are when angles in radians are given as"
        " degrees. Every tilt and Cobb angle of the spine follows from them.",
        "Check units, signs and order of the angles, that every tilt was read, and the axes of the positions.",
        "0.4% of 3,000 simulated spines with curves of 20 to 90 degrees and 0.4% of 3,000 with curves below 15, of 2"
        " to 17 vertebrae, with errors of 6 degrees and 2 mm (sd); none of them is refused. With their angles in"
        " radians 85% are refused and 13% flagged; with the opposite coronal sign 74% of the larger curves are"
        " flagged (`tests/spinewatch/spine/test_initial_tilts.py`). With tilts over more than 30 degrees, coronal"
        " tilts that are 0 are seen in 81%, halved ones in 34%, doubled ones in 76% (`python -m bench.spine --part"
        " setups`)",
    ),
    FlagKind(
        "initial-poses-reversed",
        "spine",
        "The triads of the baseline are at least 1,000 times more likely with initial poses whose left and right,"
        " front and back, or both are exchanged: as when a radiograph is read from the other side. The Cobb angle of"
        " the baseline then has the wrong side, and those of later stages are wrong by up to twice the correction.",
        "Check from which side the radiographs were read, the signs of the poses, and the patient axes.",
        "0 of 998 sound setups of simulated surgeries with 3 to 8 triads: of adolescents, adults, children, with a"
        " kyphosis or a mild curve. With tilts over more than 30 degrees, left and right exchanged are seen"
        " in 75%, both in 95%; in smaller curves in 27 and 89% (`python -m bench.spine --part setups`)",
    ),
    FlagKind(
        "initial-poses-misfit",
        "spine",
        "The triads of the baseline differ from where the initial poses expect them by more than clamps and poses"
        " vary: 8 mm and 10 degrees (sd). The poses may be those of another patient or position, or of other"
        " vertebrae.",
        "Check that the poses are of this patient and baseline, and the names of the vertebrae. If the"
        " clamps are placed that differently, nothing.",
        "0 of 998 of the same setups. Poses of another patient are seen in 48%, by this flag or the one above or a"
        " refusal, with smaller curves in 31% (`python -m bench.spine --part setups`)",
    ),
    FlagKind(
        "patient-axes-doubtful",
        "spine",
        "The initial configuration or the triads of the baseline show other patient axes than the setup states, by"
        " more than 12 degrees and than both deviations explain; or cephalad is far from the line of the spine, or"
        " the triads do not face the back. Cobb angles, axial rotations, balance and the components of every motion"
        " are those of the stated axes. Beyond 25 degrees and a probability of 1 in a million there is no spine.",
        "Check the directions or landmarks of the patient axes, and the frame of the initial poses. If they are only"
        " known roughly, state a larger deviation of the axes.",
        "0 of 900 setups of 300 simulated surgeries whose axes err by 3 degrees (sd); none is refused. Axes turned by"
        " 20 degrees about z are flagged or refused in 93% with rotations in object axes and in 4% with poses in"
        " patient axes, about x in 29% and 90% (`python -m bench.spine --part axes`)",
    ),
    FlagKind(
        "initial-levels-shifted",
        "spine",
        "The triads are a hundred times likelier where they are if the vertebrae of the initial configuration are named"
        " one or two levels off. Cobb angles and all other measures are then those of other vertebrae.",
        "Count the vertebrae in the radiographs again, and check the names of the triads. If the holders of the triads"
        " are known to reach that far up or down, nothing.",
        "0 of 600 right setups of 300 simulated surgeries, poses in object axes or radiographs, whose holders have 5 mm"
        " (sd) each; 0 with another 5 mm in common, 1.3% with 8 mm. Named a level off, 93 to 99% of the same setups"
        " are flagged, 84 to 93% and 79 to 83% with the errors in common, and 1% of those with poses in patient axes"
        " (`python -m bench.level_shift`)",
    ),
    FlagKind(
        "initial-far-from-triads",
        "spine",
        "The triads are farther from the vertebrae of the initial configuration than the deviations of holders and of"
        " the poses explain (probability below 1 in 10,000).",
        "Check the names of the vertebrae, the patient, the units and the common points of the radiographs.",
        "0 of the same 1,800 right setups (`python -m bench.level_shift`)",
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
        "rebaseline-moved",
        "spine",
        "A marker was stored as clamped again between two stages, but the triads that stayed in place moved among"
        " each other between them. What its vertebra moved there is lost, at this stage and all beyond.",
        "Name two stages between which nothing was done to the spine. If there are none, begin with a new baseline.",
        "0 of 997 spines that did not move while a marker was clamped again, and 0 of 997 that settled by"
        " 0.5 mm and 0.5 degrees (sd); a coronal motion of 5 degrees or more that is lost is seen in 91%"
        " (`python -m bench.spine --part setups`)",
    ),
    FlagKind(
        "rebaseline-unchecked",
        "spine",
        "A marker was clamped again, and besides the reference no other triad stayed in place that would"
        " show whether the spine moved meanwhile.",
        "Make sure that nothing was done to the spine between the two stages.",
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
        "radiograph-spacing-unequal",
        "spine",
        "The pixel spacing of a radiograph has distances of rows and of columns that differ by more than 1%, though"
        " pixels of radiographs are square. If one of them is wrong, every tilt and Cobb angle is: by 3.5 degrees"
        " (median of simulated pairs) for a difference of 10%.",
        "Correct the pixel spacing; it is the distance of rows, then that of columns. Nothing if the detector has such"
        " pixels.",
        "Exact: the spacings are compared. Of 40 simulated pairs with three common points and a difference of 10% in"
        " the PA view, 7 raise no other flag.",
    ),
    FlagKind(
        "radiograph-point-doubtful",
        "spine",
        "A point that radiographs and cameras have in common lies farther from where the others place it than its"
        " error explains.",
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
        "The fit turns the axes of the radiographs against the patient axes that the setup states, by more than 12"
        " degrees and than their deviations explain: 3 degrees (sd) of the films in the patient, that of the fit and"
        " that of the setup. Beyond 25 degrees and a probability of 1 in a million there is no spine.",
        "Check the directions to the head and to the left in the setup, and the names of the common points.",
        "at most 2 of 400 simulated pairs of radiographs whose films and axes err by 3 degrees each"
        " (`tests/spinewatch/spine/test_radiographs.py`)",
    ),
    FlagKind(
        "radiograph-mirror-possible",
        "spine",
        "The common points fit a mirrored PA or lateral view, alone or as well as the one that was given, and the"
        " patient axes of the setup do not decide: three points, or points in one plane, cannot show that an image was"
        " mirrored or its side named wrongly.",
        "Give a further common point out of the plane of the others. Check which side each image shows.",
        "0 of 360 simulated pairs with 4, 6 and 8 common points; with three all of 60 without stated patient axes and 9"
        " of 60 with them. Of 60 pairs with a mirrored PA view and three points, stated axes refuse 59 and flag one; of"
        " 180 with more points and no axes, 133 are flagged and 47 refused by their scale",
    ),
    FlagKind(
        "radiograph-rotation-unknown",
        "spine",
        "Vertebrae without pedicles in the PA radiograph have no measured axial rotation; it is set to 0 with a large"
        " deviation.",
        "Digitize both pedicles where they show.",
    ),
)
"""Kinds of flags of a spine, in the order of docs/flags.md."""
