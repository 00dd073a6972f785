from commands.shared.installed import UNKNOWN, locked_hashes, packages
from tests.paths import PROJECT

LOCK = "".join(
    (PROJECT / name).read_text(encoding="utf-8") for name in ("requirements.lock", "requirements-dev.lock")
)
LINES = """\
# comment
some_package==1.0 \\
    --hash=sha256:{0} \\
    --hash=sha256:{1}
    # via other
other==2.0 ; implementation_name != 'pypy' \\
    --hash=sha256:{1}
""".format("a" * 64, "b" * 64)


def test_hashes_are_read_by_name_and_version() -> None:
    assert locked_hashes(LINES) == {
        ("some-package", "1.0"): ("a" * 64, "b" * 64),
        ("other", "2.0"): ("b" * 64,),
    }


def test_what_is_needed_to_run_is_listed_with_licence_and_hashes() -> None:
    found = {package.name: package for package in packages(LOCK)}
    assert {"spinewatch", "numpy", "psycopg", "psycopg-binary", "starlette", "highdicom"} <= set(found)
    assert not {"pytest", "mypy", "ruff", "pip"} & set(found)
    assert [name for name, package in found.items() if package.licence == UNKNOWN] == ["spinewatch"]
    locked = {name for name, package in found.items() if package.hashes}
    assert set(found) - locked == {"spinewatch"}


def test_only_what_an_extra_needs_is_optional() -> None:
    optional = {package.name for package in packages("") if package.optional}
    assert {"highdicom", "weasyprint"} <= optional
    assert not {"spinewatch", "numpy", "pydicom", "psycopg-binary"} & optional


def test_tools_of_developers_are_listed_on_request() -> None:
    assert "pytest" in {package.name for package in packages("", everything=True)}
