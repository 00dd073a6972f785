from dataclasses import replace

import numpy as np
import pytest

from spinewatch.spine.configuration import Origin, SpineConfiguration
from spinewatch.spine.measure_changes import measure_changes
from spinewatch.spine.measure_functions import wrapped
from spinewatch.spine.measures import measure_spine
from spinewatch.spine.results import MeasureStatus, MeasureValue
from spinewatch.spine.uncertainty import QUANTILE_95
from tests.spinewatch.spine.spines import disturbed, errors, scoliosis, tilted

BEFORE = tilted([-25.0, -20.0, 0.0, 20.0, 30.0], axial_deg=-9.0)
AFTER = tilted([-10.0, -6.0, 0.0, 7.0, 12.0], axial_deg=-4.0)


def by_definition(values: tuple[MeasureValue, ...]) -> dict[str, MeasureValue]:
    return {value.definition: value for value in values}


def stages(seed: int, initial_deg: float = 1.0) -> tuple[SpineConfiguration, SpineConfiguration]:
    rng = np.random.default_rng(seed)
    factors = {"initial": errors(17, 0.3, initial_deg), "triads POST": errors(17, 0.3, 1.0)}
    units = {source: rng.standard_normal(102) for source in factors}
    before = disturbed(scoliosis(), {"initial": factors["initial"]}, units)
    return before, disturbed(scoliosis(0.5, 0.6), factors, units)


def test_changes_are_later_less_earlier() -> None:
    changes = by_definition(measure_changes(BEFORE, AFTER, BEFORE))
    assert changes["cobb-fixed"].value == pytest.approx(22.0 - 55.0)
    assert changes["cobb-reselected"].value == pytest.approx(22.0 - 55.0)
    assert changes["apical-rotation"].value == pytest.approx(5.0)
    assert changes["kyphosis"].reason == "at the earlier stage the configuration of the spine has no T5"


def test_they_are_the_differences_of_the_measures() -> None:
    before, after = stages(0)
    first, second = (measure_spine(stage, before).measures for stage in (before, after))
    assert {"cobb-fixed", "kyphosis", "coronal-balance"} <= {measure.definition for measure in first}
    for a, b, change in zip(first, second, measure_changes(before, after, before), strict=True):
        assert (change.definition, change.curve) == (b.definition, b.curve)
        assert float(wrapped(np.array(change.value - b.value + a.value))) == pytest.approx(0, abs=1e-9)


def test_the_reference_vertebra_has_no_change() -> None:
    before, after = (replace(spine, reference="L3") for spine in (BEFORE, AFTER))
    found = by_definition(measure_changes(before, after, before))
    for definition in ("apical-rotation", "apical-rotation-projected", "apical-translation"):
        assert found[definition].levels == ("L3",)
        assert found[definition].status is MeasureStatus.NOT_MEASURED
        assert "L3 is the reference vertebra" in (found[definition].reason or "")
    assert found["cobb-fixed"].status is MeasureStatus.MEASURED


def test_errors_that_both_stages_share_cancel() -> None:
    shared = {"initial": errors(5, 0.3, 2.0)}
    before, after = replace(BEFORE, errors=shared), replace(AFTER, errors=shared)
    change = by_definition(measure_changes(before, after, before))["cobb-fixed"]
    alone = by_definition(measure_spine(after, before).measures)["cobb-fixed"]
    assert alone.sd == pytest.approx(2.0 * np.sqrt(2))
    assert change.sd < 0.05
    own = replace(AFTER, errors={**shared, "triads POST": errors(5, 0.3, 0.5)})
    change = by_definition(measure_changes(before, own, before))["cobb-fixed"]
    assert change.sd == pytest.approx(0.5 * np.sqrt(2), rel=0.01)
    assert change.upper - change.value == pytest.approx(QUANTILE_95 * change.sd)


def test_a_change_is_known_better_than_the_measure() -> None:
    before, after = stages(1)
    absolute = measure_spine(after, before).measures
    pairs = [
        (value, change)
        for value, change in zip(absolute, measure_changes(before, after, before), strict=True)
        if value.definition.startswith("cobb")
    ]
    assert len(pairs) == 6
    assert all(change.sd < value.sd for value, change in pairs)


def test_nothing_has_changed_between_a_stage_and_itself() -> None:
    before, _ = stages(2)
    changes = measure_changes(before, before, before)
    assert {"cobb-fixed", "cobb-reselected", "kyphosis"} <= {change.definition for change in changes}
    for change in changes:
        assert change.value == 0.0
        # Which vertebrae are tilted most is not known better at the same stage.
        assert change.sd == 0.0 or change.definition == "cobb-reselected"


def test_an_interpolated_vertebra_brackets_the_change() -> None:
    after = replace(
        AFTER,
        origins=(*AFTER.origins[:4], Origin.INTERPOLATED),
        alternatives=(tilted([-10.0, -6.0, 0.0, 7.0, 15.0]).poses,),
    )
    changes = by_definition(measure_changes(BEFORE, after, BEFORE))
    change = changes["cobb-fixed"]
    assert (change.lower, change.upper) == pytest.approx((-33.0, -30.0))
    assert change.status is MeasureStatus.BRACKETED
    again = changes["cobb-reselected"]
    assert (again.lower, again.upper) == pytest.approx((-33.0, -30.0))
    assert again.status is MeasureStatus.BRACKETED


def test_an_undetermined_plane_has_no_change() -> None:
    after = replace(tilted([0.0, 1.0, 0.5, 0.0, 0.2]), errors={"triads A": errors(5)})
    change = by_definition(measure_changes(BEFORE, after, BEFORE))["plane-of-maximum-curvature"]
    assert (change.reason or "").startswith("at the later stage L1 and L5 are so nearly parallel")


def test_95_percent_intervals_of_changes_cover_the_truth() -> None:
    truth = scoliosis()
    true = measure_changes(truth, scoliosis(0.5, 0.6), truth)
    covered = []
    for seed in range(150):
        found = measure_changes(*stages(seed), truth)
        covered += [f.lower <= t.value <= f.upper for f, t in zip(found, true, strict=True)]
    assert 0.94 <= np.mean(covered) <= 0.97
