import subprocess
import sys

import pytest

from commands import main
from spinewatch.errors import ParameterError
from tests.paths import PROJECT


def test_a_named_error_is_one_line_and_exit_status_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail() -> None:
        raise ParameterError("the number is wrong; give another")

    monkeypatch.setattr(main, "cli", fail)
    with pytest.raises(SystemExit) as stopped:
        main.app()
    assert stopped.value.code == 2
    assert capsys.readouterr() == ("", "spinewatch: the number is wrong; give another\n")


def test_help_loads_no_large_library() -> None:
    large = {"cv2", "scipy", "sqlalchemy", "fastapi", "httpx", "jinja2", "rich.progress"}
    code = f"import sys, commands.main; print(*sorted({large} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=PROJECT
    )
    assert done.stdout.strip() == ""


def test_numpy_finds_one_thread_of_linear_algebra() -> None:
    code = "import sys, commands.main, os; print(os.environ['OPENBLAS_NUM_THREADS'])"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=PROJECT
    )
    assert done.stdout.strip()
