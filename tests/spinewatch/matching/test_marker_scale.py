from dataclasses import replace

import pytest

from spinewatch.matching.marker_scale import MarkerScale, MarkerScaleParameters, pooled_scale

ONE = MarkerScale(12, 0.995, 0.002, 0.0, 0.01, False, -0.15, 2.1)


def test_pooled_stages_have_a_smaller_deviation() -> None:
    pooled = pooled_scale([ONE, replace(ONE, scale=0.997)] * 2)
    assert pooled is not None
    assert pooled.scale == pytest.approx(0.996)
    assert pooled.sd == pytest.approx(0.001)
    assert pooled.distances == 48
    assert pooled.drifted  # 4 standard deviations


def test_exact_stages_count_more() -> None:
    pooled = pooled_scale([ONE, replace(ONE, scale=1.0, sd=0.02)])
    assert pooled is not None
    assert pooled.scale == pytest.approx(0.995, abs=1e-4)


def test_the_common_deviation_does_not_average_out() -> None:
    common = replace(ONE, common_sd=0.004)
    pooled = pooled_scale([common] * 100)
    assert pooled is not None
    assert pooled.common_sd == pytest.approx(0.004)
    assert not pooled.drifted  # 1.2 standard deviations, however many stages


def test_the_limit_is_that_of_the_parameters() -> None:
    strict, lax = (pooled_scale([ONE], MarkerScaleParameters(max_p_value=p)) for p in (1e-9, 0.5))
    assert strict is not None
    assert lax is not None
    assert (strict.drifted, lax.drifted) == (False, True)


def test_no_stages_have_no_scale() -> None:
    assert pooled_scale([]) is None


def test_the_message_has_the_scale_and_what_would_explain_it() -> None:
    assert "0.9950 ± 0.0020" in ONE.message
    assert "0.15 ± 0.06 degrees" in ONE.message
    assert "+2.1 ± 0.8 mm" in ONE.message
