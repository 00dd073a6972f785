"""glTF: no issue for Khronos' validator, and vertebrae where they are at each stage."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib as gl
import pytest

from contract.summary import SurgerySummary
from exports import gltf
from exports.coordinates import GLTF_FROM_PATIENT
from exports.selection import UnknownStageError
from exports.vertebra_size import body_size_mm
from spinewatch.arrays import Float
from spinewatch.spine.configuration import Origin
from tests.contract.spine_results import pose
from tests.exports.hostile import TEXTS, many_stages, stage_without_spine, with_text, without_spines

Validate = Callable[..., Any]


def document(summary: SurgerySummary, stage: str | None = None) -> gl.GLTF2:
    return gl.GLTF2.load_from_bytes(gltf.export(summary, stage))


def node(found: gl.GLTF2, name: str) -> gl.Node:
    (match,) = (candidate for candidate in found.nodes if candidate.name == name)
    return match


def numbers(found: gl.GLTF2, accessor: int) -> Float:
    part = found.accessors[accessor]
    view = found.bufferViews[part.bufferView]
    kind = {gl.FLOAT: "<f4", gl.UNSIGNED_SHORT: "<u2"}[part.componentType]
    size = {gl.SCALAR: 1, gl.VEC3: 3, gl.VEC4: 4}[part.type]
    values = np.frombuffer(found.binary_blob(), kind, part.count * size, view.byteOffset)
    return values.reshape(-1, size).astype(np.float64)


def channel(found: gl.GLTF2, name: str, path: str) -> tuple[Float, Float, str] | None:
    """Return times, values and interpolation of a node's channel."""
    (animation,) = found.animations
    index = found.nodes.index(node(found, name))
    for candidate in animation.channels:
        if (candidate.target.node, candidate.target.path) == (index, path):
            sampler = animation.samplers[candidate.sampler]
            return (
                numbers(found, sampler.input).ravel(),
                numbers(found, sampler.output),
                sampler.interpolation,
            )
    return None


def rotated(quaternion: Float, vector: Float) -> Float:
    """Turn a vector by a quaternion (x, y, z, w)."""
    u, w = np.asarray(quaternion)[:3], quaternion[3]
    return np.asarray(vector + 2 * np.cross(u, np.cross(u, vector) + w * vector))


def issues(validate: Validate, folder: Path, content: bytes) -> list[dict[str, Any]]:
    path = folder / "spine.glb"
    path.write_bytes(content)
    report = validate("gltf.mjs", path)
    messages: list[dict[str, Any]] = report["messages"]
    return messages


@pytest.mark.parametrize("stage", [None, "PRE", "EXTRA"])
def test_the_validator_finds_nothing(
    summary: SurgerySummary, stage: str | None, tmp_path: Path, validate: Validate
) -> None:
    assert issues(validate, tmp_path, gltf.export(summary, stage)) == []


def test_the_validator_finds_what_is_wrong(
    summary: SurgerySummary, tmp_path: Path, validate: Validate
) -> None:
    content = gltf.export(summary).replace(b'"POSITION"', b'"POSITIOM"')
    assert issues(validate, tmp_path, content)


def test_a_vertebra_is_where_it_is_at_the_last_stage(summary: SurgerySummary) -> None:
    found = document(summary)
    body = pose("T9", 2)
    x, y, z = body.position_mm / 1000
    np.testing.assert_allclose(node(found, "T9").translation, [y, z, x])
    cephalad = rotated(np.array(node(found, "T9").rotation), np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(cephalad, GLTF_FROM_PATIENT @ body.rotation[:, 2], atol=1e-12)


def test_a_stage_alone_does_not_move(summary: SurgerySummary) -> None:
    found = document(summary, "PRE")
    x, y, z = pose("T9", 0).position_mm / 1000
    np.testing.assert_allclose(node(found, "T9").translation, [y, z, x])
    assert not found.animations


def test_one_node_a_level_with_the_colour_of_its_origin(summary: SurgerySummary) -> None:
    found = document(summary)
    roots = [found.nodes[index].name for index in found.scenes[0].nodes]
    assert roots[:-1] == ["T5", "T6", "T7", "T8", "T9", "T10", "T11", "T12", "L1", "L2"]
    for level, origin in (("T9", "measured"), ("T8", "interpolated")):
        part = node(found, f"{level} {origin}")
        (primitive,) = found.meshes[part.mesh].primitives
        assert found.materials[primitive.material].name == origin
        depth, width, height = body_size_mm(level)
        np.testing.assert_allclose(part.scale, np.array([width, height, depth]) / 1000)
    assert not node(found, "T5").children
    colours = {material.name: material.pbrMetallicRoughness.baseColorFactor for material in found.materials}
    assert colours["measured"] == pytest.approx([0.0, 0.1679, 0.4452, 1.0], abs=1e-3)  # linear of #0072b2


def test_the_mesh_faces_to_the_front(summary: SurgerySummary) -> None:
    found = document(summary)
    mesh = found.meshes[node(found, "T9 measured").mesh]
    positions = numbers(found, mesh.primitives[0].attributes.POSITION)
    assert positions[:, 2].max() == pytest.approx(0.5)  # the body, anterior
    assert positions[:, 2].min() < -1.2  # the spinous process, posterior
    axes = found.meshes[node(found, "T9 axes").mesh].primitives
    tips = [numbers(found, part.attributes.POSITION) for part in axes]
    ends = [part[np.linalg.norm(part, axis=1).argmax()].tolist() for part in tips]
    assert ends == [[0, 0, 1], [1, 0, 0], [0, 1, 0]]  # anterior, left, cephalad


def test_the_animation_passes_through_every_stage(summary: SurgerySummary) -> None:
    found = document(summary)
    moved, turned = channel(found, "T9", "translation"), channel(found, "T9", "rotation")
    assert moved is not None
    assert turned is not None
    times, places, interpolation = moved
    assert times.tolist() == [0, 1, 2, 3, 4, 5]
    assert interpolation == "LINEAR"
    for stage in range(3):
        body = pose("T9", stage)
        for key in (2 * stage, 2 * stage + 1):
            np.testing.assert_allclose(places[key], GLTF_FROM_PATIENT @ body.position_mm / 1000, atol=1e-7)
            front = rotated(turned[1][key], np.array([0.0, 0.0, 1.0]))
            np.testing.assert_allclose(front, GLTF_FROM_PATIENT @ body.rotation[:, 0], atol=1e-6)
    assert found.animations[0].extras["stages"][1] == {"stage": "INTER", "from_s": 2.0, "to_s": 3.0}
    assert channel(found, "T9 measured", "scale") is None


def with_states(summary: SurgerySummary, level: str, changes: list[dict[str, Any]]) -> SurgerySummary:
    """Return the summary with other states of one level at its three stages."""
    stages = []
    for stage, update in zip(summary.stages, changes, strict=False):
        assert stage.spine is not None
        vertebrae = [
            state.model_copy(update=update) if state.vertebra == level else state
            for state in stage.spine.vertebrae
        ]
        spine = stage.spine.model_copy(update={"vertebrae": vertebrae})
        stages.append(stage.model_copy(update={"spine": spine}))
    return summary.model_copy(update={"stages": stages})


LOST = {"position_mm": None, "rotation": None, "origin": Origin.NOT_MEASURED}


def test_a_vertebra_is_not_drawn_where_it_was_not_measured(
    summary: SurgerySummary, tmp_path: Path, validate: Validate
) -> None:
    content = gltf.export(with_states(summary, "T9", [{}, LOST, {}]))
    assert issues(validate, tmp_path, content) == []
    found = gl.GLTF2.load_from_bytes(content)
    for part in ("T9 measured", "T9 axes"):
        scales = channel(found, part, "scale")
        assert scales is not None
        assert scales[2] == "STEP"
        assert (scales[1].max(axis=1) > 0).tolist() == [True, False, False, False, True, True]


def test_a_vertebra_that_is_lost_last_is_not_drawn_at_rest(
    summary: SurgerySummary, tmp_path: Path, validate: Validate
) -> None:
    content = gltf.export(with_states(summary, "T9", [{}, {}, LOST]))
    assert issues(validate, tmp_path, content) == []
    assert node(gl.GLTF2.load_from_bytes(content), "T9 measured").scale == [0, 0, 0]


def test_a_colour_changes_with_the_origin(
    summary: SurgerySummary, tmp_path: Path, validate: Validate
) -> None:
    content = gltf.export(with_states(summary, "T9", [{"origin": Origin.ASSUMED}, {}, {}]))
    assert issues(validate, tmp_path, content) == []
    found = gl.GLTF2.load_from_bytes(content)
    first, later = channel(found, "T9 assumed", "scale"), channel(found, "T9 measured", "scale")
    assert first is not None
    assert later is not None
    assert (first[1].max(axis=1) > 0).tolist() == [True, True, False, False, False, False]
    assert (later[1].max(axis=1) > 0).tolist() == [False, False, True, True, True, True]
    assert node(found, "T9 assumed").scale == [0, 0, 0]


def test_extras_carry_numbers_with_units_and_definitions(summary: SurgerySummary) -> None:
    found = document(summary)
    extras = node(found, "T9").extras
    assert extras["origin"] == "measured"
    assert extras["units"] == {"position": "mm", "angle": "deg"}
    assert [stage["stage"] for stage in extras["stages"]] == ["PRE", "INTER", "POST"]
    assert extras["stages"][2]["position_mm"] == pytest.approx(pose("T9", 2).position_mm)
    assert node(found, "T5").extras["stages"][0]["reason"] == "it lies outside the marked vertebrae T7 to L1"
    cobb = found.scenes[0].extras["stages"][0]["measures"][0]
    assert (cobb["definition"], cobb["value"], cobb["unit"], cobb["status"]) == (
        "cobb-fixed", 58.3, "deg", "measured"
    )  # fmt: skip
    assert cobb["interval"] == pytest.approx([56.144, 60.456])
    assert "cobb-fixed" in found.scenes[0].extras["definitions"]
    assert found.scenes[0].extras["stages"][0]["frame"].startswith("patient axes at stage PRE")


def test_a_stage_without_a_spine_has_a_node_that_says_why(
    summary: SurgerySummary, tmp_path: Path, validate: Validate
) -> None:
    stages = [summary.stages[0], stage_without_spine(summary)]
    whole = summary.model_copy(update={"stages": stages})
    found = document(whole)
    assert found.scenes[0].name == "spine at PRE"
    extras = node(found, "POST has no spine").extras
    assert extras["spine_reason"] == "the reference triad L1 has no pose in stage POST"
    assert issues(validate, tmp_path, gltf.export(whole)) == []


@pytest.mark.parametrize("text", TEXTS)
def test_hostile_text(text: str, tmp_path: Path, validate: Validate) -> None:
    assert issues(validate, tmp_path, gltf.export(with_text(text))) == []


def test_no_spine_is_an_empty_scene(tmp_path: Path, validate: Validate) -> None:
    assert issues(validate, tmp_path, gltf.export(without_spines())) == []


def test_sixty_stages(tmp_path: Path, validate: Validate) -> None:
    content = gltf.export(many_stages())
    assert issues(validate, tmp_path, content) == []
    assert len(content) < 4_000_000


def test_the_same_bytes_again_and_unknown_stages(summary: SurgerySummary) -> None:
    assert gltf.export(summary) == gltf.export(summary)
    with pytest.raises(UnknownStageError):
        gltf.export(summary, "LATER")
