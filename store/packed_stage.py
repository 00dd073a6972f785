"""The result of a stage as its rows are stored: the process that measured it makes them, and the worker stores them.

Pickling models for the worker took longer than making the rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from pydantic_core import to_json

from contract.base import Schema
from contract.pair_result import PairResult
from contract.stage import StageResult
from store.json_text import JsonText
from store.pair_results import packed
from store.tables.base import Document

_IN_TABLES = frozenset({"features", "triads", "burst"})
"""Parts of a result that have tables of their own."""


@dataclass(frozen=True)
class PackedStage:
    """What is stored of a measured stage.

    Attributes
    ----------
    result
        The result without its features, triads and burst.
    features
        Side, number and JSON of the features of each image, and a strip of it; None without one.
    triads
        Label and JSON of each triad, in their order.
    burst
        JSON of the burst; None for a single pair.
    pairs
        What each pair was measured from, compressed, in the order in which they were taken.
    """

    result: Document
    features: Sequence[tuple[str, int, JsonText, bytes | None]]
    triads: Sequence[tuple[str | None, JsonText]]
    burst: JsonText | None
    pairs: Sequence[bytes]


def pack(
    result: StageResult,
    pairs: Sequence[PairResult] = (),
    strips: Mapping[str, bytes] = MappingProxyType({}),
) -> PackedStage:
    """Return what is stored of a measured stage.

    Parameters
    ----------
    result
        The result.
    pairs
        What each pair was measured from, in the order in which they were taken.
    strips
        Strips of the images of the first pair as they are stored, by side.

    Returns
    -------
    PackedStage
        The rows.
    """
    found = result.features
    return PackedStage(
        result=result.model_dump(mode="json", exclude=set(_IN_TABLES)),
        features=[
            (side, len(points), _json(points), strips.get(side))
            for side, points in (("left", found.left), ("right", found.right))
        ],
        triads=[(triad.label, _json(triad)) for triad in result.triads],
        burst=None if result.burst is None else _json(result.burst),
        pairs=[packed(pair) for pair in pairs],
    )


def _json(value: Schema | Sequence[Schema]) -> JsonText:
    return JsonText(to_json(value, by_alias=False).decode())
