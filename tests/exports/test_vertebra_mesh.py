"""The mesh of a vertebra: closed, outwards, and of a shape that shows which way it faces."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from exports.vertebra_mesh import Mesh, arrow, vertebra

MESHES = pytest.mark.parametrize("mesh", [vertebra(), arrow()], ids=["vertebra", "arrow"])


@MESHES
def test_every_edge_is_between_two_triangles_that_run_opposite_ways(mesh: Mesh) -> None:
    corners = [tuple(row) for row in np.round(mesh.positions, 6) + 0.0]
    edges = Counter(
        (corners[triangle[i]], corners[triangle[(i + 1) % 3]])
        for triangle in mesh.triangles
        for i in range(3)
    )
    assert edges.total() == 3 * len(mesh.triangles) > 0
    assert all(edges[b, a] == count for (a, b), count in edges.items())


@MESHES
def test_normals_are_unit_and_the_faces_own(mesh: Mesh) -> None:
    a, b, c = (mesh.positions[mesh.triangles[:, i]] for i in range(3))
    faces = np.cross(b - a, c - a)
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    for i in range(3):
        np.testing.assert_allclose(mesh.normals[mesh.triangles[:, i]], faces, atol=1e-5)


def volume(mesh: Mesh) -> float:
    a, b, c = (mesh.positions[mesh.triangles[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


def test_volumes_are_positive_so_that_faces_look_outwards() -> None:
    assert volume(vertebra()) > 0.8
    assert volume(arrow()) == pytest.approx(0.8 * 0.04**2 / 2 + 0.2 * 0.12**2 / 2 / 3)


def test_the_body_has_size_one_and_the_processes_are_behind_symmetric_and_caudal() -> None:
    low, high = vertebra().positions.min(axis=0), vertebra().positions.max(axis=0)
    assert high[0] == pytest.approx(0.5)
    assert low[0] < -1.2
    assert high[1] == pytest.approx(-low[1])
    assert high[2] == pytest.approx(0.5)
    assert low[2] < -0.6


def test_the_arrow_points_along_z() -> None:
    tip = arrow().positions[arrow().positions[:, 2].argmax()]
    assert tip.tolist() == [0.0, 0.0, 1.0]
