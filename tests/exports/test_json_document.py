"""JSON: the summary comes back as it was, with the definitions that it refers to."""

from __future__ import annotations

import json

import pytest

from contract.summary import SurgerySummary
from exports import json_document
from exports.selection import UnknownStageError
from spinewatch.spine.definitions import DEFINITIONS
from tests.exports.hostile import TEXTS, many_stages, with_text, without_spines


def back(content: bytes) -> SurgerySummary:
    return SurgerySummary.model_validate_json(json.dumps(json.loads(content)["summary"]))


def test_round_trip(summary: SurgerySummary) -> None:
    assert back(json_document.export(summary)) == summary
    assert back(json_document.export(without_spines())) == without_spines()


@pytest.mark.parametrize("text", TEXTS)
def test_hostile_text_comes_back(text: str) -> None:
    assert back(json_document.export(with_text(text))) == with_text(text)


def test_one_stage(summary: SurgerySummary) -> None:
    assert [stage.name for stage in back(json_document.export(summary, "INTER")).stages] == ["INTER"]
    with pytest.raises(UnknownStageError):
        json_document.export(summary, "LATER")


def test_the_document_says_what_it_is(summary: SurgerySummary) -> None:
    document = json.loads(json_document.export(summary))
    assert (document["schema"], document["schema_version"]) == ("spinewatch/surgery-summary", 1)
    assert document["definitions"]["cobb-fixed"]["formula"] == DEFINITIONS["cobb-fixed"].formula


def test_sixty_stages() -> None:
    assert len(back(json_document.export(many_stages())).stages) == 60
