"""Checks of the calibration of a stage against the stages of its surgery that were sent earlier."""

from __future__ import annotations

from collections.abc import Iterator

from contract.stage import RigCheck
from spinewatch.calibration.quality.lens_comparison import LensComparisonParameters, lens_flags
from spinewatch.camera import Rig
from spinewatch.flags import Flag
from spinewatch.matching.marker_scale import MarkerScale
from spinewatch.rig_files.rig_json import rig_from_dict
from spinewatch.triads.drift import series_flags
from store.stage_work import StageWork


def calibration_flags(
    work: StageWork, rig: Rig, check: RigCheck | None, lenses: LensComparisonParameters | None = None
) -> Iterator[Flag]:
    """Yield flags when the calibration of a stage is not that of a lens or of markers of the earlier stages.

    Parameters
    ----------
    work
        The stage and the earlier ones.
    rig
        The rig that the stage is measured with.
    check
        Check of the rig by the balls of the stage.
    lenses
        Limit of the comparison of lenses; the default one if None.

    Yields
    ------
    Flag
        ``lens-differs`` for a lens that differs from that of another calibration; ``calibration-drift`` when this stage
        alone does not show that the markers are not measured in their size, but all stages of this calibration
        together do. Stages that are not yet measured count for the lenses alone.
    """
    others = [(stage.name, stage.other_rig) for stage in work.earlier_calibrations]
    rigs = [(name, rig_from_dict(document)) for name, document in others if document is not None]
    yield from lens_flags(rig, rigs, lenses)
    if check is None or check.drifted or check.marker_scale is None:
        return
    before = [
        RigCheck.model_validate(stage.rig_check)
        for stage in work.earlier_calibrations
        if stage.rig_check is not None
    ]
    scales = [one.marker_scale for one in (*before, check) if one.marker_scale is not None]
    yield from series_flags([MarkerScale(**scale.model_dump()) for scale in scales])
