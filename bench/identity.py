"""Whether two checkouts measure the same: ``python -m bench.identity OTHER SCENES [SCENES ...]``.

Runs ``spinewatch process`` of both on every stereo pair below SCENES and compares the JSON, number by number, to the
last bit; timings are left out. ``--renamed OLD=NEW`` maps a key of the other checkout, ``--intended PATTERN`` names
entries that may differ. OTHER holds ``.venv/bin/spinewatch``.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.tables import Grid
from bench.truth import read_rig
from spinewatch.rig_files.rig_json import rig_to_dict

PROJECT = Path(__file__).parents[1]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the comparison and return the exit status: 1 when a value differs that is not intended to."""
    parser = argparse.ArgumentParser(prog="python -m bench.identity", description=__doc__)
    parser.add_argument("other", type=Path, help="the other checkout")
    parser.add_argument("scenes", type=Path, nargs="+", help="folders of stereo pairs with truth.json")
    parser.add_argument(
        "--renamed", action="append", default=[], metavar="OLD=NEW", help="a key of the other"
    )
    parser.add_argument(
        "--intended", action="append", default=[], metavar="PATTERN", help="entries that may differ"
    )
    options = parser.parse_args(arguments)
    renamed = dict(pair.split("=", 1) for pair in options.renamed)
    intended = re.compile("|".join(options.intended) or r"(?!)")
    compared, differing = 0, defaultdict[str, list[float]](list)
    truths = {path.resolve() for root in options.scenes for path in root.rglob("truth.json")}
    folders = sorted(path.parent for path in truths if _has_rig(path))
    for folder in folders:
        with tempfile.TemporaryDirectory() as scratch:
            call = _call(folder, Path(scratch))
            old, new = (dict(_flat(_process(checkout, call))) for checkout in (options.other, PROJECT))
        old = {_mapped(key, renamed): value for key, value in old.items()}
        compared += len(old.keys() | new.keys())
        for key in old.keys() | new.keys():
            if old.get(key, ...) != new.get(key, ...):
                differing[re.sub(r"\d+", "*", key)].append(_difference(old.get(key, ...), new.get(key, ...)))
    rows = [
        (key, len(sizes), f"{max(sizes):.1g}", "intended" if intended.search(key) else "DIFFERS")
        for key, sizes in sorted(differing.items())
    ] or [("all", 0, "0", "equal to the last bit")]
    title = f"{len(folders)} pairs, {compared} values, {sum(map(len, differing.values()))} differ"
    Grid.of(title, ("entry", "values that differ", "largest relative difference", ""), rows).print()
    return int(any(not intended.search(key) for key in differing))


def _has_rig(truth: Path) -> bool:
    return "cameras" in json.loads(truth.read_text()) or (truth.parents[1] / "rig.json").exists()


def _call(folder: Path, scratch: Path) -> list[str]:
    truth = json.loads((folder / "truth.json").read_text())
    rig = scratch / "rig.json"
    rig.write_text(json.dumps(rig_to_dict(read_rig(folder, truth))))
    call = ["process", f"{folder / 'left.png'}", f"{folder / 'right.png'}", "--rig", str(rig)]
    labels = truth.get("labels_along_axis") or [triad["vertebra"] for triad in truth.get("triads", ())]
    if labels:
        call += ["--labels", ",".join(labels), "--spine-axis", truth.get("spine_axis", "auto")]
    return call


def _process(checkout: Path, call: Sequence[str]) -> Any:
    done = subprocess.run(
        [checkout.resolve() / ".venv/bin/spinewatch", *call],
        capture_output=True,
        text=True,
        check=False,
        cwd=checkout,
    )
    return json.loads(done.stdout) if done.returncode == 0 else {"error": done.stderr}


def _flat(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            if key != "timings_ms":
                yield from _flat(item, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _flat(item, f"{path}.{index}")
    else:
        yield path, value


def _mapped(path: str, renamed: Mapping[str, str]) -> str:
    return ".".join(renamed.get(part, part) for part in path.split("."))


def _difference(a: Any, b: Any) -> float:
    if isinstance(a, int | float) and isinstance(b, int | float):
        return abs(a - b) / max(abs(a), abs(b))
    return float("inf")


if __name__ == "__main__":
    sys.exit(main())
