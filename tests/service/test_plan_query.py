from dataclasses import fields

import pytest

from service.plan_query import DepthQuery, MarkerQuery, RigQuery, TriadsQuery
from service.problems import InvalidInputError
from spinewatch.markers import FLAT_10_14_18
from spinewatch.planning.planned_rig import planned_rig
from spinewatch.rig_files.rig_json import rig_to_dict


def test_what_is_not_given_is_about_the_cart() -> None:
    assert rig_to_dict(RigQuery().planned()) == rig_to_dict(planned_rig())
    assert MarkerQuery().legs().distances_mm.tolist() == FLAT_10_14_18.distances_mm.tolist()


@pytest.mark.parametrize("name", [field.name for field in fields(RigQuery)][1:])
def test_a_calibration_excludes_every_number_of_a_rig(name: str) -> None:
    query = RigQuery(calibration_id="one", **{name: 100})
    with pytest.raises(InvalidInputError) as caught:
        query.require_calibration_alone()
    assert caught.value.loc == ["query", name]
    RigQuery(calibration_id="one").require_calibration_alone()


def test_an_implausible_rig_names_its_field() -> None:
    with pytest.raises(InvalidInputError, match="focal_length_mm"):
        RigQuery(focal_length_mm=1.0).planned()


@pytest.mark.parametrize("levels", ["L1,L1", "T1,T11,T9", "T13,C9"])
def test_names_that_are_no_spine_are_refused(levels: str) -> None:
    with pytest.raises(InvalidInputError) as caught:
        TriadsQuery(levels=levels).parameters((0.0, 1.0))
    assert caught.value.loc == ["query", "levels"]


def test_balls_that_cannot_be_told_apart_are_refused() -> None:
    with pytest.raises(InvalidInputError, match="equal"):
        MarkerQuery(xx_mm=10.0, yy_mm=14.0, mx_mm=10.0).legs()


def test_exchanged_depths_are_refused() -> None:
    assert DepthQuery(planes=3).heights_mm() == (-60.0, 0.0, 60.0)
    with pytest.raises(InvalidInputError, match="exchange"):
        DepthQuery(depth_from_mm=10.0, depth_to_mm=-10.0).heights_mm()
