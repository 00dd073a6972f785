"""Measurement of a sample surgery over HTTP, from upload to tables."""

from __future__ import annotations

import json
from pathlib import Path
from time import monotonic, sleep

from commands.shared.api_client import ApiClient, Document, ServiceError, SubmittedStage
from commands.shared.files import InputError, read_bytes, read_json
from commands.shared.job_progress import wait_for_jobs
from commands.shared.spine_tables import MAIN, print_measures
from commands.shared.surgery_tables import print_flags, print_links, print_motion, print_note, print_triads
from contract.summary import SPINE_NOT_COMPUTED, SurgerySummary

_SPINE_SECONDS = 30.0
_POLL_SECONDS = 0.05
_SURGERY_FIELDS = ("vertebrae", "reference_vertebra", "spine_axis")


def measure_surgery(client: ApiClient, folder: Path) -> bool:
    """Submit the stages in ``folder``, wait, print the results; return whether every job succeeded."""
    sample = _read_sample(folder / "surgery.json")
    surgery_id, submitted = _submit(client, folder, sample)
    surgery = f"/v1/surgeries/{surgery_id}"
    jobs = wait_for_jobs(client, submitted)
    measured = [stage.name for stage in submitted if jobs[stage.name]["state"] == "succeeded"]
    stages = {name: client.get(f"{surgery}/stages/{name}") for name in sample["stages"]}
    print_triads({name: client.get(f"{surgery}/stages/{name}/triads") for name in measured})
    first, *others = sample["stages"]
    for name in others:
        _print_motion(client, surgery, first, name)
    _print_spines(client, surgery)
    print_flags(stages, jobs)
    print_links(client.url, surgery)
    return len(measured) == len(submitted)


def _read_sample(path: Path) -> Document:
    sample: Document = read_json(path)
    if missing := {"id", "stages", *_SURGERY_FIELDS} - set(sample):
        raise InputError(f"{path} lacks {', '.join(sorted(missing))}; restore the sample surgery")
    return sample


def _submit(client: ApiClient, folder: Path, sample: Document) -> tuple[str, list[SubmittedStage]]:
    calibration = client.add_calibration(read_bytes(folder / "rig.json"))
    fields = {key: sample[key] for key in _SURGERY_FIELDS}
    surgery = client.add_surgery({"reference": f"SAMPLE-{sample['id']}", **fields})
    client.put_spine_setup(surgery, read_bytes(folder / "spine.json"))
    return surgery, [
        client.submit_stage(surgery, name, calibration, folder / name) for name in sample["stages"]
    ]


def _print_motion(client: ApiClient, surgery: str, start: str, end: str) -> None:
    try:
        print_motion(client.get(f"{surgery}/motion?from={start}&to={end}"))
    except ServiceError as error:  # a stage or the reference triad was not measured
        print_note(f"no motion from {start} to {end}: {error}")


def _print_spines(client: ApiClient, surgery: str) -> None:
    """Print the main measures of the stages when their spines are computed, or why a stage has none."""
    deadline = monotonic() + _SPINE_SECONDS
    summary = client.get(f"{surgery}/summary")
    while any(_waits(stage) for stage in summary["stages"]) and monotonic() < deadline:
        sleep(_POLL_SECONDS)
        summary = client.get(f"{surgery}/summary")
    stages = SurgerySummary.model_validate_json(json.dumps(summary)).stages
    print_measures([stage.spine for stage in stages if stage.spine is not None], MAIN)
    for stage in stages:
        if stage.spine is None:
            print_note(f"{stage.name}: no spine: {stage.spine_reason}")


def _waits(stage: Document) -> bool:
    """Return whether the spine of a stage is still to be computed."""
    waits: bool = stage["state"] == "succeeded" and stage["spine_reason"] == SPINE_NOT_COMPUTED
    return waits
