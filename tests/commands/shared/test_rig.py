from pathlib import Path

import pytest

from commands.shared.files import InputError
from commands.shared.rig import read_rig
from spinewatch.errors import RigError
from tests.paths import SAMPLES


def test_the_rig_of_a_file() -> None:
    assert read_rig(SAMPLES / "D1" / "rig.json").name == "dev_large"


def test_the_error_names_the_file_and_the_field(tmp_path: Path) -> None:
    path = tmp_path / "rig.json"
    with pytest.raises(InputError, match=str(path)):
        read_rig(path)
    path.write_text('{"name": ""}')
    with pytest.raises(RigError, match=f"'name' of {path} must be"):
        read_rig(path)
