from contract.stage_measures import StageMeasures
from tests.contract.spine_results import stage_spine


def test_measures_are_those_of_the_spine_without_its_vertebrae() -> None:
    spine = stage_spine(2)
    found = StageMeasures.of(spine)
    assert found.measures == spine.measures
    assert found.target_measures == spine.target_measures
    assert found.curves == spine.curves
    assert (found.stage, found.take, found.version) == (spine.stage, spine.take, spine.version)
    assert spine.since_baseline is not None
    assert found.since_baseline is not None
    assert found.since_baseline.since == spine.since_baseline.since
    assert found.since_baseline.attribution == spine.since_baseline.attribution
    assert '"covariance"' not in found.model_dump_json()


def test_the_baseline_has_no_change() -> None:
    found = StageMeasures.of(stage_spine(0))
    assert found.since_baseline is None
    assert found.since_previous is None
