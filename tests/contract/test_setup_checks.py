"""Checks of a setup against its surgery; tests/http/test_spine.py has the rest of the bad setups."""

from typing import Any

import pytest

from contract.setup_checks import SpineSetupError, SurgeryContext, check_rebaseline, check_setup
from contract.spine_setup import NewRebaseline
from tests.store.builders import spine_setup

CONTEXT = SurgeryContext(
    vertebrae=["L1", "T11", "T9", "T7"],
    reference_vertebra="L1",
    extra_levels=["T13"],
    stages=["PRE", "POST"],
    radiographs={"a": "pa", "b": "lateral"},
)
CORNERS = {
    "pa": ("superior_left", "superior_right", "inferior_left", "inferior_right"),
    "lateral": ("superior_anterior", "superior_posterior", "inferior_anterior", "inferior_posterior"),
}


def common(name: str, triad: str = "L1") -> dict[str, Any]:
    return {"name": name, "pa": [0.0, 0.0], "lateral": [0.0, 0.0], "triad": triad}


def radiographs(**changes: Any) -> dict[str, Any]:
    vertebrae = [
        {
            "vertebra": level,
            **{view: {corner: [0.0, 0.0] for corner in names} for view, names in CORNERS.items()},
        }
        for level in CONTEXT.vertebrae
    ]
    document = {"kind": "radiographs", "pa": "a", "lateral": "b", "vertebrae": vertebrae}
    return {**document, "common": [common(name) for name in "xyz"], **changes}


def poses(*levels: str) -> dict[str, Any]:
    listed = [{"vertebra": v, "position_mm": [0.0, 0.0, 0.0], "angles_deg": [0.0, 0.0, 0.0]} for v in levels]
    return {"kind": "poses", "frame": "patient", "poses": listed}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"baseline": "PRE", "levels": ["L1", "T9"], "reference_vertebra": "T9"},
        {"initial": poses("T7", "T9", "T11", "T13", "L1")},
        {"initial": poses("L1", "T9"), "levels": ["L1", "T9"]},
        {"initial": radiographs()},
        {"target": [{"vertebra": "T9", "angles_deg": [0.0, 0.0, 0.0]}]},
    ],
)
def test_setups_that_can_be_used(changes: dict[str, Any]) -> None:
    check_setup(spine_setup(**changes), CONTEXT)


@pytest.mark.parametrize(
    ("changes", "code", "path"),
    [
        ({"levels": ["T9"]}, "not-marked", ("reference_vertebra",)),
        ({"initial": radiographs(pa="b", lateral="a")}, "wrong-view", ("initial", "pa")),
        ({"initial": radiographs(pa="c")}, "unknown-radiograph", ("initial", "pa")),
        (
            {"initial": radiographs(common=[common("x")] * 3)},
            "duplicate-name",
            ("initial", "common", 1, "name"),
        ),
        (
            {"initial": radiographs(common=[common(name, "T8") for name in "xyz"])},
            "not-marked",
            ("initial", "common", 0, "triad"),
        ),
        ({"initial": {"kind": "generic", "cranial": "T14"}}, "unknown-level", ("initial", "cranial")),
    ],
)  # fmt: skip
def test_setups_that_cannot(changes: dict[str, Any], code: str, path: tuple[str | int, ...]) -> None:
    with pytest.raises(SpineSetupError) as error:
        check_setup(spine_setup(**changes), CONTEXT)
    assert (error.value.code, error.value.path) == (code, path)
    assert str(error.value).startswith(".".join(map(str, path)))


@pytest.mark.parametrize(
    ("new", "code"),
    [
        (("T8", "PRE", "POST"), "not-marked"),
        (("L1", "PRE", "POST"), "reference-clamped-again"),
        (("T9", "NEVER", "POST"), "unknown-stage"),
        (("T9", "PRE", "NEVER"), "unknown-stage"),
        (("T9", "POST", "PRE"), "stages-out-of-order"),
        (("T9", "PRE", "PRE"), "stages-out-of-order"),
    ],
)
def test_markers_that_cannot_have_been_clamped_again(new: tuple[str, str, str], code: str) -> None:
    vertebra, before, after = new
    with pytest.raises(SpineSetupError) as error:
        check_rebaseline(NewRebaseline(vertebra=vertebra, before=before, after=after), spine_setup(), CONTEXT)
    assert error.value.code == code


def test_the_reference_is_that_of_the_setup() -> None:
    new = NewRebaseline(vertebra="L1", before="PRE", after="POST")
    check_rebaseline(new, spine_setup(reference_vertebra="T9"), CONTEXT)
