"""Flags: named doubts about a result, in one table per subject.

Nothing is dropped or doubted without a flag. `FLAGS` lists every flag with its meaning and what to do; docs/flags.md is
generated from it.
"""

from spinewatch.flags.kind import FlagKind
from spinewatch.flags.registry import FLAGS, Flag

__all__ = ["FLAGS", "Flag", "FlagKind"]
