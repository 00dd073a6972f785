"""Reading and writing of rigs in every file format."""

from typing import Literal

RigFormat = Literal["json", "1995", "opencv", "openptv"]
"""Name of a rig file format."""
