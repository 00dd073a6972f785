"""The list of vertebrae on a command line."""

from __future__ import annotations

from spinewatch.errors import ParameterError


def parse_labels(labels: str | None, triads: int | None) -> tuple[str, ...]:
    """Return the names in a comma-separated list; raises ``ParameterError`` if they contradict ``triads``."""
    if triads is not None and triads < 1:
        raise ParameterError(f"--triads is {triads}; give the number of triads, 1 or more")
    if labels is None:
        return ()
    names = tuple(name.strip() for name in labels.split(","))
    if not all(names):
        raise ParameterError(f"--labels {labels!r} has an empty name; write it like L1,T11,T9,T7")
    if len(set(names)) < len(names):
        raise ParameterError(f"--labels {labels!r} names a vertebra twice; name each once")
    if triads is not None and len(names) != triads:
        raise ParameterError(f"--labels has {len(names)} names but --triads is {triads}; make them agree")
    return names
