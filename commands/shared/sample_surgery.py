"""The sample surgery from upload to tables."""

from __future__ import annotations

import json
from pathlib import Path

from commands.shared.api_client import ApiClient, Document, ServiceError, Submitted
from commands.shared.follow import follow
from commands.shared.surgery_tables import print_flags, print_links, print_motion, print_note, print_triads


def measure_surgery(cart: ApiClient, folder: Path) -> bool:
    """Submit the stages in ``folder``, wait, print the results; return whether every job succeeded."""
    plan = json.loads((folder / "surgery.json").read_text())
    surgery_id, submitted = _submit(cart, folder, plan)
    surgery = f"/v1/surgeries/{surgery_id}"
    jobs = follow(cart, submitted)
    measured = [stage.name for stage in submitted if jobs[stage.name]["state"] == "succeeded"]
    stages = {name: cart.get(f"{surgery}/stages/{name}") for name in plan["stages"]}
    print_triads({name: cart.get(f"{surgery}/stages/{name}/triads") for name in measured})
    for later in plan["stages"][1:]:
        _print_motion(cart, surgery, plan["stages"][0], later)
    print_flags(stages, jobs)
    print_links(cart.url, surgery)
    return len(measured) == len(submitted)


def _print_motion(cart: ApiClient, surgery: str, first: str, later: str) -> None:
    try:
        print_motion(cart.get(f"{surgery}/motion?from={first}&to={later}"))
    except ServiceError as error:  # a stage or the reference triad was not measured
        print_note(f"no motion from {first} to {later}: {error}")


def _submit(cart: ApiClient, folder: Path, plan: Document) -> tuple[str, list[Submitted]]:
    calibration = cart.submit_calibration((folder / "rig.json").read_bytes())
    case = {key: plan[key] for key in ("vertebrae", "reference_vertebra", "spine_axis")}
    surgery = cart.open_surgery({"reference": f"SAMPLE-{plan['id']}", **case})
    return surgery, [cart.submit_stage(surgery, name, calibration, folder / name) for name in plan["stages"]]
