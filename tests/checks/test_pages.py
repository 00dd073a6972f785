from pathlib import Path
from types import ModuleType

import pytest

from checks import architecture, codes_page, flags_page, limits_page, measures_page, mirror

PLACES = {
    "architecture.md": "<!-- tree -->\n```text\nbefore the write\n```\n<!-- /tree -->",
    "operations.md": "<!-- limits -->\nbefore the write\n<!-- /limits -->",
}
"""Where the generated part goes in a page that is written by hand otherwise."""


@pytest.mark.parametrize(
    ("module", "name"),
    [
        (architecture, "architecture.md"),
        (codes_page, "codes.md"),
        (flags_page, "flags.md"),
        (limits_page, "operations.md"),
        (measures_page, "measures.md"),
    ],
)
def test_a_page_that_differs_fails_until_it_is_written(
    module: ModuleType,
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    page = tmp_path / name
    page.write_text(f"# Page\n\n{PLACES.get(name, '')}\n")
    monkeypatch.setattr(module, "PAGE", page)
    assert module.main(()) == 1
    assert "--write" in capsys.readouterr().err
    assert module.main(("--write",)) == 0
    assert module.main(()) == 0
    assert "before the write" not in page.read_text()


def test_a_module_without_tests_and_a_test_without_module_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for path in (
        "spinewatch/a.py",
        "spinewatch/b.py",
        "tests/spinewatch/test_b.py",
        "tests/spinewatch/test_c.py",
    ):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).touch()
    monkeypatch.setattr(mirror, "PROJECT", tmp_path)
    assert mirror.main() == 1
    assert capsys.readouterr().out.splitlines() == [
        "spinewatch/a.py has no test file of its own",
        "tests of spinewatch/c: there is no such module",
    ]


def test_a_limit_that_is_on_no_page_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "service").mkdir()
    (tmp_path / "service" / "new.py").write_text("MAX_PARTS = 7\n_MIN_PARTS: int = 1\nmax_other = 3\n")
    monkeypatch.setattr(limits_page, "PROJECT", tmp_path)
    lines = limits_page.missing()
    assert lines[:2] == [
        "service/new.MAX_PARTS is a limit that docs/operations.md does not list",
        "service/new._MIN_PARTS is a limit that docs/operations.md does not list",
    ]
    assert "service/limits.MAX_HEADERS is no constant" in lines
