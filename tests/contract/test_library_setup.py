"""The library's setup has what the documents say, in object space of the baseline stage."""

from __future__ import annotations

import numpy as np
import pytest

from contract.library_setup import SurgeryLevels, library_setup, marked_poses
from contract.spine_setup import NewRebaseline
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.configuration import InitialKind, Rebaseline
from spinewatch.spine.initial_tilts import InitialTiltsError
from spinewatch.spine.orientation import rotation_from_tilts
from spinewatch.spine.patient_axes import PatientAxesContradictedError
from spinewatch.triads.pose import Pose
from tests.store.builders import spine_setup

AXES = np.column_stack([[0, 0, -1], [0, 1, 0], [1, 0, 0]]).astype(float)
"""Patient axes of cephalad +x and left +y."""
LEVELS = SurgeryLevels("L1")
TRIADS = {
    "T11": Pose(np.array([60.0, 0, 40]), np.eye(3), np.eye(6) * 0.01),
    "L1": Pose(np.array([0.0, 0, 40]), np.eye(3), np.eye(6) * 0.01),
}


def poses(frame: str, **rotation: object) -> dict[str, object]:
    """T11 60 mm above L1, given upside down."""
    up = {"object": [60.0, 0.0, 0.0], "patient": [0.0, 0.0, 60.0]}[frame]
    same = {"position_sd_mm": 1.0, "rotation_sd_deg": 2.0, **(rotation or {"angles_deg": [10.0, 0.0, 0.0]})}
    listed = [
        {"vertebra": "L1", "position_mm": [0.0, 0.0, 0.0], **same},
        {"vertebra": "T11", "position_mm": up, **same},
    ]
    return {"kind": "poses", "frame": frame, "poses": listed}


def test_angles_are_in_patient_axes_whatever_the_frame_of_the_positions() -> None:
    for frame in ("object", "patient"):
        setup, flags = library_setup(spine_setup(initial=poses(frame)), (), LEVELS, "PRE", TRIADS, {})
        assert flags == ()
        assert (setup.initial.kind, setup.initial.levels) == (InitialKind.POSES, ("T11", "L1"))
        np.testing.assert_allclose(setup.patient_axes, AXES, atol=1e-15)
        expected = AXES @ rotation_from_tilts(10.0, 0.0, 0.0)
        np.testing.assert_allclose(setup.initial.rotation, [expected, expected], atol=1e-12)
        apart = setup.initial.position_mm[0] - setup.initial.position_mm[1]
        np.testing.assert_allclose(apart, [60, 0, 0], atol=1e-9)


def test_the_axes_have_the_deviation_of_the_document() -> None:
    for given, sd in (({}, 3.0), ({"direction_sd_deg": 1.5}, 1.5)):
        document = spine_setup(
            patient_axes={"kind": "directions", "cephalad": "+x", "left": "+y", **given},
            initial=poses("object"),
        )
        setup, _ = library_setup(document, (), LEVELS, "PRE", TRIADS, {})
        np.testing.assert_allclose(setup.axes_covariance_deg2, sd**2 * np.eye(3), atol=1e-12)


def test_what_was_given_in_patient_axes_turns_with_them() -> None:
    def by_axes(frame: str, **rotation: object) -> tuple[bool, bool]:
        document = spine_setup(initial=poses(frame, **rotation))
        initial = library_setup(document, (), LEVELS, "PRE", TRIADS, {})[0].initial
        change = np.zeros((2, 6, 3)) if initial.by_axes is None else initial.by_axes
        return bool(change[:, :3].any()), bool(change[:, 3:].any())

    assert by_axes("patient") == by_axes("patient", rotation=np.eye(3).tolist()) == (True, True)
    assert by_axes("object") == (False, True)
    assert by_axes("object", rotation=AXES.tolist()) == (False, False)


def test_axes_that_the_initial_poses_disagree_with_are_flagged() -> None:
    names = [f"T{i}" for i in range(6, 13)]
    turned = AXES @ rotation_from_vector(np.radians([0.0, 0.0, 20.0]))
    listed = [
        {"vertebra": name, "position_mm": [-25.0 * i, 0.0, 0.0], "rotation": turned.tolist()}
        for i, name in enumerate(names)
    ]
    document = spine_setup(initial={"kind": "poses", "frame": "object", "poses": listed})
    triads = {"T12": Pose(np.array([-150.0, 0, 45]), np.eye(3), np.eye(6) * 0.01)}
    _, flags = library_setup(document, (), SurgeryLevels("T12"), "PRE", triads, {})
    assert [flag.code for flag in flags] == ["patient-axes-doubtful"]
    assert "turned by 20 degrees" in flags[0].detail


def test_extra_levels_are_those_of_the_surgery() -> None:
    levels = SurgeryLevels("L1", ["T13"])
    setup, _ = library_setup(spine_setup(initial=poses("object")), (), levels, "PRE", TRIADS, {})
    assert setup.extra_levels == ("T13",)


def test_deviations_of_poses_in_object_space() -> None:
    setup, _ = library_setup(spine_setup(initial=poses("object")), (), LEVELS, "PRE", TRIADS, {})
    variance = (setup.initial.errors**2).sum(axis=2)
    np.testing.assert_allclose(variance, [[1, 1, 1, 4, 4, 4]] * 2)


def test_a_rotation_matrix_is_in_the_axes_of_the_frame() -> None:
    R = rotation_from_vector(np.array([0.1, -0.2, 0.3]))
    for frame, given in (("object", AXES @ R), ("patient", R)):
        document = spine_setup(initial=poses(frame, rotation=given.tolist()))
        setup, _ = library_setup(document, (), LEVELS, "PRE", TRIADS, {})
        np.testing.assert_allclose(setup.initial.rotation[0], AXES @ R, atol=1e-12)


def test_a_generic_spine_is_fitted_to_the_triads() -> None:
    document = spine_setup(initial={"kind": "generic", "cranial": "T10", "caudal": "L2"})
    setup, _ = library_setup(document, (), LEVELS, "PRE", TRIADS, {})
    assert setup.initial.kind is InitialKind.GENERIC
    assert setup.initial.levels == ("T10", "T11", "T12", "L1", "L2")


@pytest.mark.parametrize(
    ("cephalad", "left", "words"),
    [
        ("-x", "+y", "cephalad contradicts"),
        ("+y", "+x", "cephalad contradicts"),
        ("+x", "-y", "left contradicts"),
    ],
)
@pytest.mark.parametrize("kind", ["generic", "poses"])
def test_axes_that_the_triads_contradict_are_refused(cephalad: str, left: str, words: str, kind: str) -> None:
    initial = {"kind": "generic"} if kind == "generic" else poses("patient")
    axes = {"kind": "directions", "cephalad": cephalad, "left": left}
    with pytest.raises(PatientAxesContradictedError, match=words):
        library_setup(spine_setup(initial=initial, patient_axes=axes), (), LEVELS, "PRE", TRIADS, {})


def test_reference_baseline_and_clamped_markers() -> None:
    again = [NewRebaseline(vertebra="L1", before="PRE", after="POST")]
    setup, _ = library_setup(spine_setup(reference_vertebra="T11"), again, LEVELS, "START", TRIADS, {})
    assert (setup.reference, setup.baseline) == ("T11", "START")
    assert setup.rebaselines == (Rebaseline("L1", "PRE", "POST"),)
    other, _ = library_setup(spine_setup(), (), LEVELS, "START", TRIADS, {})
    assert other.reference == "L1"


def test_only_triads_of_the_levels_count() -> None:
    assert marked_poses(spine_setup(), TRIADS) == TRIADS
    assert list(marked_poses(spine_setup(levels=["L1"]), TRIADS)) == ["L1"]


@pytest.mark.parametrize("scale", [1.0, 1.2])
def test_radiographs_place_the_spine_and_a_wrong_scale_is_refused(scale: float) -> None:
    from spinewatch.spine.radiograph_fit import RadiographScaleError  # noqa: PLC0415
    from spinewatch.spine.radiograph_landmarks import RadiographView  # noqa: PLC0415

    view = RadiographView((scale, scale), "right")

    def pixels(point: np.ndarray) -> dict[str, list[float]]:
        """A point (anterior, left, cephalad), mm, in both views of 1 mm a pixel."""
        x, y, z = point
        return {"pa": [y, -z], "lateral": [x, -z]}

    def body(z: float) -> dict[str, object]:
        def corners(view: str, names: str) -> dict[str, list[float]]:
            made = {}
            for name in names.split():
                end, side = name.split("_")
                up = 12.0 if end == "superior" else -12.0
                across = 20.0 if side in {"left", "anterior"} else -20.0
                at = np.array([across, across, z + up])
                made[name] = pixels(at)[view]
            return made

        return {
            "pa": corners("pa", "superior_left superior_right inferior_left inferior_right"),
            "lateral": corners(
                "lateral", "superior_anterior superior_posterior inferior_anterior inferior_posterior"
            ),
        }

    known = np.array([[0.0, 0, 0], [10, 60, 20], [-40, -50, 80], [30, 10, 120]])
    common = [
        {"name": str(n), **pixels(point), "object_mm": (AXES @ point).tolist()}
        for n, point in enumerate(known)
    ]
    initial = {
        "kind": "radiographs", "pa": "a", "lateral": "b", "landmark_sd_px": 0.5, "common": common,
        "vertebrae": [{"vertebra": "L1", **body(0.0)}, {"vertebra": "T11", **body(60.0)}],
    }  # fmt: skip
    document = spine_setup(initial=initial)
    if scale != 1.0:
        with pytest.raises(RadiographScaleError):
            library_setup(document, (), LEVELS, "PRE", TRIADS, {"a": view, "b": view})
        return
    setup, flags = library_setup(document, (), LEVELS, "PRE", TRIADS, {"a": view, "b": view})
    assert setup.initial.levels == ("T11", "L1")
    np.testing.assert_allclose(setup.initial.position_mm, [[60, 0, 0], [0, 0, 0]], atol=1e-6)
    np.testing.assert_allclose(setup.initial.rotation, [AXES, AXES], atol=1e-6)
    assert all(flag.code.startswith("radiograph") for flag in flags)
    assert "radiograph-landmark-left-out" not in {flag.code for flag in flags}
    nowhere = {"name": "P of T9", **pixels(known[0]), "triad": "T9"}
    document = spine_setup(initial={**initial, "common": [*common, nowhere]})
    hidden = {label: pose for label, pose in TRIADS.items() if label != "T9"}
    _, flags = library_setup(document, (), LEVELS, "PRE", hidden, {"a": view, "b": view})
    (flag,) = (flag for flag in flags if flag.code == "radiograph-landmark-left-out")
    assert "P of T9" in flag.detail


COBB = {
    "T7": (0.0, 150.0, 20.0),
    "T9": (12.5, 100.0, 8.0),
    "T11": (12.5, 50.0, -8.0),
    "L1": (0.0, 0.0, -20.0),
}
"""Position to the left and upwards, mm, and coronal tilt of a curve of 40 degrees."""


def curve(factor: float) -> dict[str, object]:
    listed = [
        {"vertebra": name, "position_mm": [0.0, y, z], "angles_deg": [factor * tilt, factor * 4.0, 0.0]}
        for name, (y, z, tilt) in COBB.items()
    ]
    return {"kind": "poses", "frame": "patient", "poses": listed}


def test_angles_in_radians_are_refused_and_wrong_signs_flagged() -> None:
    def flags_of(factor: float) -> list[str]:
        document = spine_setup(initial=curve(factor))
        _, flags = library_setup(document, (), LEVELS, "PRE", TRIADS, {})
        return [flag.code for flag in flags]

    assert flags_of(1.0) == []
    assert flags_of(-1.0) == ["initial-tilts-doubtful"]
    with pytest.raises(InitialTiltsError, match="not in radians"):
        flags_of(np.pi / 180)


def test_poses_without_deviations_have_those_of_radiographs() -> None:
    listed = [dict(pose) for pose in curve(1.0)["poses"]]  # type: ignore[attr-defined]
    for zero in ({}, {"position_sd_mm": 0.0, "rotation_sd_deg": 0.0}):
        document = spine_setup(
            initial={"kind": "poses", "frame": "object", "poses": [{**p, **zero} for p in listed]}
        )
        poses = document.initial.poses  # type: ignore[union-attr]
        assert [(pose.position_sd_mm, pose.rotation_sd_deg) for pose in poses] == [(2.0, 3.0)] * 4


def test_mirrored_poses_and_tilts_of_zero_are_flagged() -> None:
    side = {"T7": -14.0, "T9": 12.5, "T11": 12.5, "L1": -14.0}
    seen = {
        name: Pose(np.array([up, side[name], 45.0]), np.eye(3), np.eye(6) * 0.01)
        for name, (_, up, _) in COBB.items()
    }

    def codes(left: float, tilt: float) -> list[str]:
        listed = [
            {
                "vertebra": name,
                "position_mm": [0.0, left * side[name], up],
                "angles_deg": [tilt * t, 4.0, 0.0],
            }
            for name, (_, up, t) in COBB.items()
        ]
        document = spine_setup(initial={"kind": "poses", "frame": "patient", "poses": listed})
        _, flags = library_setup(document, (), LEVELS, "PRE", seen, {})
        return [flag.code for flag in flags]

    assert codes(1.0, 2.0) == []
    assert codes(-1.0, -2.0) == ["initial-poses-reversed"]
    assert codes(1.0, 0.0) == ["initial-tilts-doubtful"]


@pytest.mark.parametrize(
    ("left", "cephalad_mm", "named"),
    [(1.0, 0.0, []), (-1.0, 0.0, ["initial-poses-reversed"]), (1.0, 26.0, ["initial-levels-shifted"])],
)
def test_one_cause_is_named_of_triads_that_do_not_fit(
    left: float, cephalad_mm: float, named: list[str]
) -> None:
    numbers = np.arange(8)
    side = 40 * np.sin(numbers / 2.2)
    tilt = np.degrees(np.arctan2(-np.gradient(side), -26.0))
    names = ("T6", "T7", "T8", "T9", "T10", "T11", "T12", "L1")
    marked = {
        names[k]: Pose(
            np.array([-26.0 * k + cephalad_mm, side[k], 45.0]),
            AXES @ rotation_from_tilts(tilt[k], 0.0, 0.0) @ AXES.T,
            np.eye(6) * 0.01,
        )
        for k in range(1, 8, 2)
    }
    listed = [
        {
            "vertebra": name,
            "position_mm": [-26.0 * k, left * side[k], 0.0],
            "angles_deg": [left * tilt[k], 0.0, 0.0],
        }
        for k, name in enumerate(names)
    ]
    document = spine_setup(initial={"kind": "poses", "frame": "object", "poses": listed})
    _, flags = library_setup(document, (), LEVELS, "PRE", marked, {})
    assert [flag.code for flag in flags] == named


def test_vertebrae_named_a_level_off_are_flagged_in_object_axes_and_not_where_the_triads_place_them() -> None:
    levels = SurgeryLevels("L1")
    names = ("T9", "T10", "T11", "T12", "L1", "L2")
    triads = {
        name: Pose(np.array([-26.0 * k, 0, 45]), np.eye(3), np.eye(6) * 0.01)
        for k, name in enumerate(names)
        if name in {"T10", "T12", "L1"}
    }
    for shift, expected in ((0, []), (1, ["initial-levels-shifted"])):
        found = {}
        for frame in ("object", "patient"):
            listed = [
                {
                    "vertebra": name,
                    "position_mm": [-26.0 * (k - shift), 0, 0]
                    if frame == "object"
                    else [0, 0, -26.0 * (k - shift)],
                    "angles_deg": [0.0, 0.0, 0.0],
                }
                for k, name in enumerate(names)
            ]
            document = spine_setup(initial={"kind": "poses", "frame": frame, "poses": listed})
            _, flags = library_setup(document, (), levels, "PRE", triads, {})
            found[frame] = [flag.code for flag in flags if flag.code.startswith("initial-levels")]
        assert found == {"object": expected, "patient": []}
