import pytest

from commands.shared.terminal_progress import terminal_progress


def test_nothing_is_printed_in_a_log(capsys: pytest.CaptureFixture[str]) -> None:
    with terminal_progress() as progress:
        progress("detect", 0.0)
        progress("solve", 0.5)
    out, err = capsys.readouterr()
    assert (out, err.strip()) == ("", "")
