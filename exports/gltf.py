"""glTF 2.0 of the spine, as one binary file (GLB): one node a level, and an animation over the stages.

Coordinates are glTF's: metres, y up (cephalad), z to the front (anterior), x to the patient's left. A node's rotation
turns the vertebra's own axes, which are parallel to these when the rotation is the identity. The bodies are a nominal
vertebra, coloured by origin (Okabe and Ito's palette); arrows are the vertebra's axes: x vermilion, y bluish green, z
blue. The rest position is that of the last stage with a spine, which the scene is named after; a stage without one has
an empty node that says so. The animation stays one second at each stage and moves in a straight line for one second to
the next; what lies between stages is drawn, not measured. A vertebra without a pose at a stage is not drawn there.
Numbers with their deviations, intervals, status and definitions are in the nodes' and the scene's ``extras``, in mm and
degrees.

References
----------
Khronos Group, glTF 2.0 Specification; checked with Khronos' glTF validator.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pygltflib as gl
from numpy.typing import NDArray

from contract.spine import StageSpine, VertebraState
from contract.summary import SummaryStage, SurgerySummary
from exports.coordinates import GLTF_FROM_PATIENT, transform
from exports.gltf_extras import asset_extras, level_extras, scene_extras, stage_extras
from exports.selection import selected_stages
from exports.vertebra_mesh import Mesh, arrow, vertebra
from exports.vertebra_size import body_size_mm
from spinewatch.arrays import Float
from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.spine.configuration import Origin

MEDIA_TYPE = "model/gltf-binary"
FILE_SUFFIX = ".glb"

_M_PER_MM = 1e-3
_ARROW_MM = 35.0
_HOLD_S = 1.0
_MOVE_S = 1.0
_ORIGIN_COLOURS = {
    Origin.MEASURED: (0.0, 0.447, 0.698),
    Origin.INTERPOLATED: (0.902, 0.624, 0.0),
    Origin.ASSUMED: (0.8, 0.475, 0.655),
}
_AXIS_COLOURS = {"x": (0.835, 0.369, 0.0), "y": (0.0, 0.62, 0.451), "z": (0.0, 0.447, 0.698)}
_AXES = {
    "x": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "y": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "z": np.eye(3),
}
"""Rotations that take the arrow, which points along z, to each of the vertebra's axes."""


def export(summary: SurgerySummary, stage: str | None = None) -> bytes:
    """Return the spine as GLB.

    Parameters
    ----------
    summary
        The surgery with all its stages.
    stage
        Name of one stage, which is then shown without an animation; None for all.

    Returns
    -------
    bytes
        The binary glTF; without a spine its scene has no bodies.

    Raises
    ------
    UnknownStageError
        If the surgery has no stage of that name.
    """
    stages = selected_stages(summary, stage)
    spines = [found.spine for found in stages if found.spine is not None]
    writer = _Writer()
    levels = list(dict.fromkeys(state.vertebra for spine in spines for state in spine.vertebrae))
    names = [spine.stage for spine in spines]
    tracks = [_Track(level, [_state(spine, level) for spine in spines], names) for level in levels]
    geometry = _Geometry(writer, {origin for track in tracks for origin in track.origins})
    roots = [_add_level(writer, geometry, track) for track in tracks]
    if len(spines) > 1:
        writer.animate("stages", tracks, names)
    roots += [writer.node(_without_spine(found)) for found in stages if found.spine is None]
    scene = gl.Scene(name=f"spine at {names[-1]}" if names else "no spine", extras=scene_extras(stages))
    if roots:
        scene.nodes = roots
    return writer.file(scene, asset_extras(summary))


@dataclass(frozen=True, eq=False)
class _Drawing:
    """A node that is drawn at some stages only: its scale is zero at the others."""

    node: int
    scale: Float
    visible: list[bool]


@dataclass
class _Track:
    """One level over the stages; its node and drawings are filled as they are made."""

    level: str
    states: list[VertebraState | None]
    stages: list[str]
    node: int = -1
    drawings: list[_Drawing] = field(default_factory=list)

    @property
    def visible(self) -> list[bool]:
        return [_drawn(state) for state in self.states]

    @property
    def origins(self) -> list[Origin]:
        return sorted({state.origin for state in self.states if state is not None and _drawn(state)})

    @property
    def matrices(self) -> list[Float]:
        """Poses of the stages; a stage without a pose has that of the one before, or of the first pose."""
        known = [_matrix(state) if state is not None and _drawn(state) else None for state in self.states]
        last = next((matrix for matrix in known if matrix is not None), np.eye(4))
        filled = []
        for matrix in known:
            last = last if matrix is None else matrix
            filled.append(last)
        return filled


def _state(spine: StageSpine, level: str) -> VertebraState | None:
    return next((state for state in spine.vertebrae if state.vertebra == level), None)


def _drawn(state: VertebraState | None) -> bool:
    return (
        state is not None
        and state.position_mm is not None
        and state.rotation is not None
        and state.origin in _ORIGIN_COLOURS
    )


def _matrix(state: VertebraState) -> Float:
    return transform(GLTF_FROM_PATIENT, np.array(state.rotation), _M_PER_MM * np.array(state.position_mm))


class _Geometry:
    """The meshes that nodes share: a body per origin, and the arrows."""

    def __init__(self, writer: _Writer, origins: set[Origin]) -> None:
        self.bodies: dict[Origin, int] = {}
        if not origins:
            return
        shape = writer.shape(_turned(vertebra(), GLTF_FROM_PATIENT))
        for origin in sorted(origins):
            material = writer.material(origin.value, _ORIGIN_COLOURS[origin])
            self.bodies[origin] = writer.mesh(f"vertebra {origin.value}", [(shape, material)])
        self.arrows = writer.mesh("axes", [
            (
                writer.shape(_turned(arrow(), GLTF_FROM_PATIENT @ _AXES[axis])),
                writer.material(f"{axis} axis", colour),
            )
            for axis, colour in _AXIS_COLOURS.items()
        ])  # fmt: skip


def _turned(mesh: Mesh, rotation: Float) -> Mesh:
    return Mesh(mesh.positions @ rotation.T, mesh.normals @ rotation.T, mesh.triangles)


def _add_level(writer: _Writer, geometry: _Geometry, track: _Track) -> int:
    node = gl.Node(name=track.level, extras=level_extras(track.level, track.stages, track.states))
    if any(track.visible):
        last = track.matrices[-1]
        node.translation = last[:3, 3].tolist()
        node.rotation = _quaternion(last[:3, :3]).tolist()
        node.children = _add_drawings(writer, geometry, track)
    track.node = writer.node(node)
    return track.node


def _add_drawings(writer: _Writer, geometry: _Geometry, track: _Track) -> list[int]:
    depth, width, height = body_size_mm(track.level)
    size = _M_PER_MM * np.array([width, height, depth])
    parts = [
        (
            origin.value,
            geometry.bodies[origin],
            size,
            [_drawn(state) and state is not None and state.origin is origin for state in track.states],
        )
        for origin in track.origins
    ]
    parts.append(("axes", geometry.arrows, np.full(3, _M_PER_MM * _ARROW_MM), track.visible))
    for name, mesh, scale, visible in parts:
        shown = (scale if visible[-1] else 0 * scale).tolist()
        node = writer.node(gl.Node(name=f"{track.level} {name}", mesh=mesh, scale=shown))
        track.drawings.append(_Drawing(node, scale, visible))
    return [drawing.node for drawing in track.drawings]


def _quaternion(R: Float) -> Float:
    """Return the unit quaternion (x, y, z, w) of a rotation."""
    vector = vector_from_rotation(R)
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle > 0 else vector
    return np.append(np.sin(angle / 2) * axis, np.cos(angle / 2))


def _quaternions(rotations: Float) -> Float:
    """Return quaternions of successive rotations, with the signs that make each turn the shorter one."""
    quaternions = np.array([_quaternion(R) for R in rotations])
    turns = np.where(np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0, -1.0, 1.0)
    return quaternions * np.cumprod([1.0, *turns])[:, None]


def _times(stages: int) -> Float:
    """Return the times when the animation reaches and leaves each stage, s."""
    start = np.arange(stages) * (_HOLD_S + _MOVE_S)
    return np.column_stack([start, start + _HOLD_S]).ravel()


def _scales(drawing: _Drawing, shown: Sequence[bool]) -> Float | None:
    """Return the scale at each time, None when it never changes.

    A drawing stays until the next stage is reached when the level is drawn there, in whatever colour.
    """
    following = [*shown[1:], shown[-1]]
    seen = [[here, here and then] for here, then in zip(drawing.visible, following, strict=True)]
    if all(drawing.visible):
        return None
    return np.outer(np.array(seen, dtype=np.float64).ravel(), drawing.scale)


class _Writer:
    """Collects the parts of a document and the bytes of its one buffer."""

    def __init__(self) -> None:
        self._document = gl.GLTF2(scenes=[])
        self._data = bytearray()

    def node(self, node: gl.Node) -> int:
        self._document.nodes.append(node)
        return len(self._document.nodes) - 1

    def material(self, name: str, colour: tuple[float, float, float]) -> int:
        surface = gl.PbrMetallicRoughness(
            baseColorFactor=[*_linear(colour), 1.0], metallicFactor=0.0, roughnessFactor=0.7
        )
        self._document.materials.append(gl.Material(name=name, pbrMetallicRoughness=surface))
        return len(self._document.materials) - 1

    def shape(self, mesh: Mesh) -> tuple[int, int, int]:
        """Return the accessors of positions, normals and indices."""
        return (
            self._accessor(mesh.positions, gl.VEC3, gl.ARRAY_BUFFER, bounds=True),
            self._accessor(mesh.normals, gl.VEC3, gl.ARRAY_BUFFER),
            self._accessor(mesh.triangles.ravel(), gl.SCALAR, gl.ELEMENT_ARRAY_BUFFER),
        )

    def mesh(self, name: str, parts: Sequence[tuple[tuple[int, int, int], int]]) -> int:
        primitives = [
            gl.Primitive(
                attributes=gl.Attributes(POSITION=positions, NORMAL=normals),
                indices=indices,
                material=material,
            )
            for (positions, normals, indices), material in parts
        ]
        self._document.meshes.append(gl.Mesh(name=name, primitives=primitives))
        return len(self._document.meshes) - 1

    def animate(self, name: str, tracks: Sequence[_Track], stages: Sequence[str]) -> None:
        animation = gl.Animation(name=name)
        times = _times(len(stages))
        keys = self._accessor(times, gl.SCALAR, bounds=True)
        for track in tracks:
            if not any(track.visible):
                continue
            matrices = np.repeat(np.array(track.matrices), 2, axis=0)
            self._channel(animation, keys, track.node, "translation", matrices[:, :3, 3])
            self._channel(animation, keys, track.node, "rotation", _quaternions(matrices[:, :3, :3]))
            for drawing in track.drawings:
                scales = _scales(drawing, track.visible)
                if scales is not None:
                    self._channel(animation, keys, drawing.node, "scale", scales, gl.ANIM_STEP)
        animation.extras = {
            "stages": [
                {"stage": stage, "from_s": float(start), "to_s": float(end)}
                for stage, (start, end) in zip(stages, times.reshape(-1, 2), strict=True)
            ],
            "between_stages": "drawn, not measured",
        }
        if animation.channels:
            self._document.animations.append(animation)

    def file(self, scene: gl.Scene, asset_extras: dict[str, Any]) -> bytes:
        self._document.asset = gl.Asset(generator="Spinewatch", version="2.0", extras=asset_extras)
        self._document.scenes = [scene]
        self._document.scene = 0
        if self._data:
            self._document.buffers.append(gl.Buffer(byteLength=len(self._data)))
        return _glb(
            self._document.gltf_to_json(separators=(",", ":"), indent=None).encode(), bytes(self._data)
        )

    def _channel(
        self,
        animation: gl.Animation,
        keys: int,
        node: int,
        path: str,
        values: Float,
        interpolation: str = gl.ANIM_LINEAR,
    ) -> None:
        output = self._accessor(values, gl.VEC4 if path == "rotation" else gl.VEC3)
        animation.samplers.append(gl.AnimationSampler(input=keys, output=output, interpolation=interpolation))
        target = gl.AnimationChannelTarget(node=node, path=path)
        animation.channels.append(gl.AnimationChannel(sampler=len(animation.samplers) - 1, target=target))

    def _accessor(
        self, values: Float | NDArray[np.uint16], kind: str, target: int | None = None, bounds: bool = False
    ) -> int:
        integer = values.dtype == np.uint16
        array = np.ascontiguousarray(values, dtype="<u2" if integer else "<f4")
        content = array.tobytes()
        view = gl.BufferView(buffer=0, byteOffset=len(self._data), byteLength=len(content), target=target)
        self._data += content + bytes(-len(content) % 4)
        self._document.bufferViews.append(view)
        accessor = gl.Accessor(
            bufferView=len(self._document.bufferViews) - 1,
            componentType=gl.UNSIGNED_SHORT if integer else gl.FLOAT,
            count=len(array),
            type=kind,
        )
        if bounds:
            accessor.min = np.atleast_1d(array.min(axis=0)).tolist()
            accessor.max = np.atleast_1d(array.max(axis=0)).tolist()
        self._document.accessors.append(accessor)
        return len(self._document.accessors) - 1


def _glb(document: bytes, data: bytes) -> bytes:
    """Return the container of glTF 2.0, section 4.4: a JSON chunk, and a binary chunk unless it is empty."""
    chunks = _chunk(b"JSON", document, b" ") + (_chunk(b"BIN\0", data, b"\0") if data else b"")
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _chunk(kind: bytes, content: bytes, filler: bytes) -> bytes:
    content += filler * (-len(content) % 4)
    return struct.pack("<I4s", len(content), kind) + content


def _linear(colour: tuple[float, float, float]) -> list[float]:
    """Return linear RGB of sRGB (IEC 61966-2-1): glTF's factors are linear."""
    return [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colour]


def _without_spine(stage: SummaryStage) -> gl.Node:
    return gl.Node(name=f"{stage.name} has no spine", extras=stage_extras(stage))
