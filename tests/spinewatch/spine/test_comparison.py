import pytest

from spinewatch.spine.attribution import attribute
from spinewatch.spine.comparison import compare_stages
from spinewatch.spine.measure_changes import measure_changes
from spinewatch.spine.measure_parameters import MeasureParameters
from tests.spinewatch.spine.spines import scoliosis


def test_a_comparison_has_motions_changes_and_attribution() -> None:
    before, after = scoliosis(), scoliosis(0.5)
    parameters = MeasureParameters(kyphosis=(("T4", "T12"),))
    found = compare_stages(before, after, before, "L5", parameters)
    assert [change.vertebra for change in found.vertebrae] == list(before.levels)
    t5 = found.vertebrae[before.index("T5")]
    cobb = next(m for m in found.measures if m.levels == ("T5", "T12") and m.definition == "cobb-fixed")
    t12 = found.vertebrae[before.index("T12")]
    assert cobb.value == pytest.approx(t12.coronal_deg - t5.coronal_deg)
    assert [m.levels for m in found.measures if m.definition == "kyphosis"] == [("T4", "T12")]
    assert len(found.measures) == len(measure_changes(before, after, before, parameters))
    assert len(found.attribution) == len(attribute(before, after, before, "L5"))
