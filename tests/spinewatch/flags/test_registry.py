import pytest

from spinewatch.flags import FLAGS, Flag


def test_every_kind_is_found_by_its_code_and_says_what_to_do() -> None:
    assert all(kind.code == code for code, kind in FLAGS.items())
    assert all(kind.meaning.endswith(".") and kind.action.endswith(".") for kind in FLAGS.values())
    assert {kind.subject for kind in FLAGS.values()} == {"image", "stage", "spine", "calibration"}


def test_a_flag_without_a_kind_is_refused() -> None:
    with pytest.raises(ValueError, match="spinewatch/flags"):
        Flag("no-such-flag", "detail")
