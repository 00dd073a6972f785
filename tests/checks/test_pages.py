from pathlib import Path
from types import ModuleType

import pytest

from checks import architecture, flags_page, mirror


@pytest.mark.parametrize(("module", "name"), [(architecture, "architecture.md"), (flags_page, "flags.md")])
def test_a_page_that_differs_fails_until_it_is_written(
    module: ModuleType,
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    page = tmp_path / name
    page.write_text("# Page\n\n<!-- tree -->\n```text\nbefore the write\n```\n<!-- /tree -->\n")
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
