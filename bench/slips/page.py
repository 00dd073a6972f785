"""docs/mistakes.md: every slip with the answer to it, and what nothing in the input reveals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from bench.slips.simulated import Rate
from bench.slips.slip import ROUTINE_FLAGS, Kind, Outcome

PAGE = Path(__file__).parents[2] / "docs" / "mistakes.md"

_HEAD = """\
# Mistakes

What can go wrong between the cart and the database, and the answer to it. Every mistake is made from sound samples and
given to the command line or to a running service. A refusal is one sentence with the file, line or field; a flag
([flags.md](flags.md)) comes with the result and states the numbers that raised it; accepted input gives the result of
its sound neighbour. This page is written by `python -m bench.mistakes --page`, which also prints the sentences;
`tests/cases` has a smaller set, with files to try.
"""

_TITLES: dict[Kind, str] = {
    "labels": "Names of vertebrae",
    "order": "Order",
    "marker": "Markers",
    "edit": "Centres placed by hand",
    "setup": "Setups of spines",
    "swap": "Images and cameras exchanged",
    "rig": "Rigs",
    "unit": "Units",
    "stale": "Repeated images",
    "time": "Times",
    "exposure": "Exposure",
    "image": "Images",
    "table": "Point tables and control fields",
    "camera file": "Camera files",
    "calibration": "Shots of a calibration",
    "system": "Files and folders",
}


def page(outcomes: Sequence[Outcome], rates: Sequence[Rate], unseen: Sequence[tuple[str, str]]) -> str:
    """Return the text of docs/mistakes.md.

    Parameters
    ----------
    outcomes
        One per slip.
    rates
        Flags on simulated stages: sound ones, then those of moved cameras.
    unseen
        Mistakes that nothing in the input reveals, and why.

    Returns
    -------
    str
        Markdown.
    """
    parts = [_HEAD]
    for kind, title in _TITLES.items():
        rows = [(o.slip.name, o.slip.command, answer(o)) for o in outcomes if o.slip.kind == kind]
        if rows:
            parts.append(_section(title, ("mistake", "given to", "answer"), rows))
    parts.append(_section("Simulated stages", ("stages", "number", "flagged"), _rates(rates)))
    parts.append(_section("What nothing in the input reveals", ("mistake", "why"), unseen))
    return "\n".join(parts)


def answer(outcome: Outcome) -> str:
    """Return the answer to a slip in a few words; one that is not right is marked."""
    codes = ", ".join(f"`{code}`" for code in sorted(outcome.answer.codes - ROUTINE_FLAGS))
    match outcome.verdict:
        case "refused":
            return "refused"
        case "flagged":
            return codes or "warning"
        case "read":
            return f"accepted, {codes}" if codes else "accepted"
        case verdict:
            return f"**{verdict}**: {codes or 'no flag'}"


def _rates(rates: Sequence[Rate]) -> Iterator[tuple[str, str, str]]:
    for rate in rates:
        yield rate.name, str(rate.stages), f"{rate.percent:.1f}%"


def _section(
    title: str, columns: Sequence[str], rows: Iterator[Sequence[str]] | Sequence[Sequence[str]]
) -> str:
    lines = [columns, ["---"] * len(columns), *rows]
    return f"## {title}\n\n" + "".join(f"| {' | '.join(cells)} |\n" for cells in lines)
