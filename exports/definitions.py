"""The definitions that the measures of an export refer to."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict

from contract.spine import MeasureValue, StageSpine
from spinewatch.spine.definitions import DEFINITIONS


def definitions_of(spines: Iterable[StageSpine]) -> list[str]:
    """Return the identifiers of the definitions that spines refer to.

    Parameters
    ----------
    spines
        Spines of a surgery.

    Returns
    -------
    list of str
        The identifiers, sorted.
    """
    used: set[str] = set()
    for spine in spines:
        values: list[MeasureValue] = [*spine.measures, *(spine.target_measures or [])]
        for change in (spine.since_baseline, spine.since_previous):
            if change is not None:
                values += change.measures
                used |= {item.quantity for item in change.attribution}
        used |= {value.definition for value in values}
    return sorted(used)


def definition_table(identifiers: Iterable[str]) -> dict[str, dict[str, str]]:
    """Return what definitions say.

    Parameters
    ----------
    identifiers
        Identifiers of definitions.

    Returns
    -------
    dict
        Name, unit, formula, sign and reference by identifier; empty for one that this version does not know.

    Examples
    --------
    >>> definition_table(["from-a-later-version"])
    {'from-a-later-version': {}}
    """
    table: dict[str, dict[str, str]] = {}
    for identifier in identifiers:
        known = DEFINITIONS.get(identifier)
        fields = {} if known is None else {name: str(value) for name, value in asdict(known).items()}
        fields.pop("id", None)
        table[identifier] = fields
    return table
