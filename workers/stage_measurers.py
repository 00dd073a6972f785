"""The measurers that a worker keeps prepared, and the one that a stage is measured with."""

from __future__ import annotations

import json
from collections.abc import Mapping
from concurrent.futures import Executor
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic_core import to_jsonable_python

from contract.revision import Remeasurement
from spinewatch.detection.candidates.templates import (
    TemplateError,
    TemplateSet,
    default_template_set,
    read_template_set,
)
from spinewatch.parameters import Parameters
from spinewatch.pipeline import StageMeasurer
from spinewatch.rig_files.rig_json import parse_rig
from spinewatch.rig_plausibility import check_measurable_rig
from store.regular_file import MAX_DOCUMENT_BYTES, read_regular
from store.stage_work import StageWork
from workers.stage_revision import (
    Changed,
    changed_parameters,
    chosen_templates,
    parameters_of,
    revised_parameters,
    with_changes,
)

_MAX_RIGS = 8
"""Measurers that a worker keeps prepared, one per rig."""


class StageMeasurers:
    """Measurers by rig, parameters and templates, prepared when they are first used.

    Parameters
    ----------
    templates
        The worker's own template set.
    parameters
        The worker's own parameters.
    pool
        Executor of the right view.
    """

    def __init__(self, templates: TemplateSet, parameters: Parameters, pool: Executor) -> None:
        self._parameters = own = parameters

        @lru_cache(maxsize=_MAX_RIGS)
        def measurer(rig_json: str, changes_json: str, version: str | None) -> StageMeasurer:
            changes = json.loads(changes_json)
            used = revised_parameters(own, changes) if changes else own
            rig = parse_rig(rig_json)
            if used.search.matching.epipolar.range_mm is None:
                check_measurable_rig(rig)
            return StageMeasurer(rig, used, chosen_templates(version, templates), pool)

        self._measurer = measurer

    def of(self, work: StageWork) -> StageMeasurer:
        """Return the measurer of a stage.

        Parameters
        ----------
        work
            The stage, its rig, and what was sent or is revised.

        Returns
        -------
        StageMeasurer
            The measurer with the parameters and templates that the stage is to be measured with.

        Raises
        ------
        SpinewatchError
            The stage cannot be measured with its rig, these parameters or these templates.
        """
        return self._measurer(json.dumps(work.rig), json.dumps(_wanted(work), sort_keys=True), _version(work))

    def changed(self, work: StageWork) -> Changed:
        """Return the parameters of a revision that are neither the worker's own nor sent with the images.

        Parameters
        ----------
        work
            The stage.

        Returns
        -------
        Changed
            Their values and the usual ones; none for a stage that is not revised.
        """
        if work.revision is None:
            return {}
        used, usual = (
            to_jsonable_python(revised_parameters(self._parameters, changes))
            for changes in (_wanted(work), work.measuring.parameters)
        )
        return changed_parameters(used, usual)


def template_set(file: Path | None) -> TemplateSet:
    """Return the worker's own template set.

    Parameters
    ----------
    file
        Its file; None for the set that ships with the library.

    Returns
    -------
    TemplateSet
        The set.

    Raises
    ------
    TemplateError
        The file cannot be read, or is none of a template set.
    """
    if file is None:
        return default_template_set()
    try:
        return read_template_set(read_regular(file, MAX_DOCUMENT_BYTES))
    except OSError as error:
        raise TemplateError(f"cannot read {file}: {error.strerror}; set SPINEWATCH_TEMPLATES") from error


def _version(work: StageWork) -> str | None:
    """Return the version of the templates that a stage is to be measured with; None for the worker's own."""
    sent = work.measuring.templates
    if work.revision is None:
        return sent
    if isinstance(work.revision.changes, Remeasurement):
        return work.revision.changes.templates or sent
    return work.revision.revised.result.templates


def _wanted(work: StageWork) -> Mapping[str, Any]:
    """Return the parameters that differ from the worker's own."""
    sent = work.measuring.parameters
    if work.revision is None:
        return sent
    if isinstance(work.revision.changes, Remeasurement):
        return with_changes(sent, work.revision.changes.parameters)
    return parameters_of(work.revision.revised.result)
