"""Tests of commands.shared.loading."""

import gc

import pytest

from commands.shared.loading import loading


def test_no_garbage_is_looked_for_while_loading() -> None:
    with loading():
        assert not gc.isenabled()
    assert gc.isenabled()


def test_it_is_looked_for_again_when_loading_fails() -> None:
    with pytest.raises(ValueError, match="broken"), loading():
        raise ValueError("broken")
    assert gc.isenabled()
