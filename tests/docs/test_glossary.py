"""The glossary lists terms that are used, once each, and words that it replaced do not return."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.paths import PROJECT

GLOSSARY = PROJECT / "docs" / "glossary.md"
SUFFIXES = {".py", ".md", ".json", ".toml"}
FOLDERS = (
    *(
        "spinewatch",
        "contract",
        "exports",
        "reports",
        "settings",
        "store",
        "workers",
        "service",
        "commands",
        "migrations",
    ),
    *("bench", "training", "checks", "docs", "openapi", "tests"),
)

ABOLISHED = (
    # archaic or literary words
    *("afresh", "anew", "anyhow", "lest", "nought", "so many", "thereof", "whereat", "whereby", "wholly"),
    # names of the project's own that standard terms replaced
    *("carry_out", "pictures?", "sightings", "the bell", "the scout", "the judge"),
    # names of quantities: min_, max_, chi2, p_value, log_odds, rotation
    *(r"least_(?!squares)\w+", r"most_\w+", "turn_deg", "turn_sd_deg"),
    # American and -ise spellings beside the British ones with -ize that the project uses
    *("center", "centers", "centered", "color", "grey", "labeled", "modeled", r"neighbor\w*"),
    r"\w*(binari|initiali|lineari|maximi|minimi|normali|optimi|parameteri|recogni|standardi)s(e[ds]?|ing|ation)\w*",
)


def files() -> Iterator[Path]:
    """Yield every file of the project, except those that name what was before, and this one."""
    yield PROJECT / "README.md"
    for folder in FOLDERS:
        for path in (PROJECT / folder).rglob("*"):
            if path.suffix in SUFFIXES and "migrations" not in path.parts and path != Path(__file__):
                yield path


@cache
def texts() -> dict[str, str]:
    return {path.relative_to(PROJECT).as_posix(): path.read_text() for path in files()}


def rows() -> list[list[str]]:
    lines = [line for line in GLOSSARY.read_text().splitlines() if line.startswith("| ")]
    cells = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]
    return [row for row in cells if row[0] not in {"term", "---"} and not set(row[0]) <= set("-|")]


def terms() -> list[str]:
    return [row[0].strip("`") for row in rows()]


def plain(text: str) -> str:
    """Return a text in lower case, with words separated by one space."""
    return re.sub(r"[\s_\-`*]+", " ", text.lower())


def test_every_row_has_a_term_a_meaning_and_a_source() -> None:
    for row in rows():
        assert len(row) == 3, row
        assert all(row), row


def test_terms_are_sorted_and_unique() -> None:
    keys = [term.lower() for term in terms()]
    assert keys == sorted(keys)
    assert len(set(keys)) == len(keys)


def test_every_term_is_used() -> None:
    skipped = ("docs/glossary.md", "openapi/", "tests/")
    used = plain("\n".join(text for name, text in texts().items() if not name.startswith(skipped)))
    unused = [term for term in terms() if not re.search(rf"(?<!\w){re.escape(plain(term))}", used)]
    assert not unused


@pytest.mark.parametrize("word", ABOLISHED)
def test_an_abolished_word_does_not_occur(word: str) -> None:
    pattern = re.compile(rf"\b(?:{word})\b", re.IGNORECASE)
    found = [
        f"{name}:{number}: {line.strip()}"
        for name, text in texts().items()
        for number, line in enumerate(text.splitlines(), 1)
        if pattern.search(line)
    ]
    assert not found
