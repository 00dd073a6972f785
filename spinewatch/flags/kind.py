"""What a flag means and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FlagKind:
    """What a flag means.

    Attributes
    ----------
    code
        Stable name, for machines.
    subject
        What the flag is about: image, stage, spine or calibration.
    meaning
        What was found.
    action
        What to do about it.
    false_alarms
        How often sound input raises the flag where it has a threshold: measured rate, on what, and the command that
        prints it. Empty for a flag without a threshold.
    """

    code: str
    subject: str
    meaning: str
    action: str
    false_alarms: str = ""
