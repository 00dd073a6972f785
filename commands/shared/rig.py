"""The rig of a command."""

from __future__ import annotations

from pathlib import Path

from commands.shared.files import read_bytes
from spinewatch.camera import Rig
from spinewatch.errors import RigError
from spinewatch.rig_files.rig_json import parse_rig


def read_rig(path: Path) -> Rig:
    """Return the rig in a rig JSON file; raises ``InputError`` or ``RigError`` with the name of the file."""
    try:
        return parse_rig(read_bytes(path))
    except RigError as error:
        raise RigError(error.field, f"of {path} {error.problem}") from error
