from pathlib import Path

import pytest

from checks import docstrings

WHOLE = '''
def area(width_mm: float, height_mm: float) -> float:
    """Return an area.

    Parameters
    ----------
    width_mm, height_mm
        Sides, mm.

    Returns
    -------
    float
        Area, mm^2.
    """
    return width_mm * height_mm
'''


@pytest.fixture
def lacking(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):  # type: ignore[no-untyped-def]
    monkeypatch.setattr(docstrings, "PROJECT", tmp_path)

    def check(source: str) -> list[str]:
        path = tmp_path / "module.py"
        path.write_text(source)
        return [line.split(": ", 2)[2] for line in docstrings.check(path)]

    return check


def test_a_whole_docstring_lacks_nothing(lacking) -> None:  # type: ignore[no-untyped-def]
    assert lacking(WHOLE) == []


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("width_mm, height_mm\n ", "width_mm\n ", "Parameters lacks height_mm"),
        (
            "width_mm, height_mm\n ",
            "width_mm, height_mm, depth_mm\n ",
            "Parameters has depth_mm, which is not there",
        ),
        ("Returns\n    -------", "Notes\n    -----", "has no Returns or Yields"),
    ],
)
def test_what_is_missing_is_named(lacking, old: str, new: str, sentence: str) -> None:  # type: ignore[no-untyped-def]
    assert lacking(WHOLE.replace(old, new)) == [sentence]


def test_fields_of_a_dataclass_are_due_and_private_names_are_not(lacking) -> None:  # type: ignore[no-untyped-def]
    source = (
        '@dataclass(frozen=True)\nclass {name}:\n    """A point."""\n\n    x_mm: float\n    _cache: int\n'
    )
    assert lacking(source.format(name="Point")) == ["Attributes lacks x_mm"]
    assert lacking(source.format(name="_Point")) == []
