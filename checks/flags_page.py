"""docs/flags.md from the registry of flags: ``python -m checks.flags_page`` compares, ``--write`` writes it."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from spinewatch.flags import FLAGS

PAGE = Path(__file__).parents[1] / "docs" / "flags.md"

_HEAD = """\
# Flags

A flag is a named doubt about a result: a stable `code` for machines and a `detail` for people, a sentence with the
numbers that raised it. A flagged result is still given. The detail of a flag about one image begins with `left:` or
`right:`. [mistakes.md](mistakes.md) lists what can go wrong between the cart and the database, the answer to each, and
what nothing in the input reveals. Figures without a command come from experiments that no command repeats.

This page is generated from `spinewatch/flags/` by `python -m checks.flags_page --write`.
"""


def page() -> str:
    """Return the text of docs/flags.md."""
    parts = [_HEAD]
    for subject in dict.fromkeys(kind.subject for kind in FLAGS.values()):
        rows = [
            f"| `{kind.code}` | {kind.meaning} | {kind.action} | {kind.false_alarms or '-'} |"
            for kind in FLAGS.values()
            if kind.subject == subject
        ]
        head = f"## Flags of {'an image' if subject == 'image' else f'a {subject}'}\n"
        parts.append(
            "\n".join([head, "| code | meaning | action | false alarms |", "|---|---|---|---|", *rows]) + "\n"
        )
    return "\n".join(parts)


def main(arguments: Sequence[str]) -> int:
    """Write the page, or return 1 when the committed one differs from the registry."""
    if "--write" in arguments:
        PAGE.write_text(page(), encoding="utf-8")
        return 0
    if PAGE.read_text(encoding="utf-8") == page():
        return 0
    sys.stderr.write(
        "docs/flags.md differs from spinewatch/flags; run: python -m checks.flags_page --write\n"
    )
    return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
