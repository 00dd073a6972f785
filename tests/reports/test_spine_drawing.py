from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contract.pose import pose_fields
from contract.spine import StageSpine, VertebraState
from reports.spine_drawing import Drawing, DrawingParameters, Line, Side, draw
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.configuration import Origin
from spinewatch.triads.pose import Pose
from tests.contract.spine_results import stage_spine

UPRIGHT = {"T7": (0.0, 0.0, 50.0), "T8": (0.0, 0.0, 25.0), "T9": (0.0, 0.0, 0.0)}


def spine(
    positions: dict[str, tuple[float, float, float]],
    tilts_deg: dict[str, tuple[float, float, float]] | None = None,
) -> StageSpine:
    """A spine with the given centroids and rotation vectors, degrees."""
    states = []
    for level, position in positions.items():
        R = rotation_from_vector(np.radians((tilts_deg or {}).get(level, (0.0, 0.0, 0.0))))
        states.append(
            VertebraState(
                **pose_fields(Pose(np.array(position), R, np.eye(6)), None),
                vertebra=level,
                origin=Origin.MEASURED,
                marked=True,
                coronal_tilt_deg=0.0,
                coronal_tilt_sd_deg=0.0,
                sagittal_tilt_deg=0.0,
                sagittal_tilt_sd_deg=0.0,
                axial_rotation_deg=0.0,
                axial_rotation_sd_deg=0.0,
            )
        )
    return stage_spine(0).model_copy(update={"vertebrae": states})


def drawn(side: Side, *spines: StageSpine) -> Drawing:
    found = draw(spines, side)
    assert found is not None
    return found


def centre(drawing: Drawing, level: str, layer: int = 0) -> tuple[float, float]:
    return next(body.centre for body in drawing.layers[layer].bodies if body.level == level)


def angle_deg(line: Line) -> float:
    """Angle of a line against the horizontal, positive with the right end down."""
    (x0, y0), (x1, y1) = line.start, line.end
    return float(np.degrees(np.arctan((y1 - y0) / (x1 - x0))))


@pytest.mark.parametrize(
    ("side", "towards", "expected"),
    [
        (Side.CORONAL, (0.0, -10.0, 0.0), (1, 0)),  # the patient's right is at the right
        (Side.CORONAL, (0.0, 0.0, 10.0), (0, -1)),  # the head is up
        (Side.SAGITTAL, (10.0, 0.0, 0.0), (1, 0)),  # anterior is at the right
        (Side.SAGITTAL, (0.0, 0.0, 10.0), (0, -1)),
        (Side.TOP, (0.0, -10.0, 0.0), (1, 0)),
        (Side.TOP, (10.0, 0.0, 0.0), (0, -1)),  # anterior is up
    ],
)
def test_each_view_has_its_sides_where_it_names_them(
    side: Side, towards: tuple[float, float, float], expected: tuple[int, int]
) -> None:
    found = drawn(side, spine({"T7": towards, "T9": (0.0, 0.0, 0.0)}))
    (x0, y0), (x1, y1) = centre(found, "T9"), centre(found, "T7")
    assert (np.sign(round(x1 - x0, 6)), np.sign(round(y1 - y0, 6))) == expected
    edges = {Side.CORONAL: "LR", Side.SAGITTAL: "PA", Side.TOP: "LR"}[side]
    assert "".join(found.edges[:2]) == edges


def test_the_scale_bar_has_the_scale_of_the_bodies() -> None:
    found = drawn(Side.CORONAL, spine(UPRIGHT))
    (_, upper), (_, lower) = centre(found, "T7"), centre(found, "T9")
    assert (lower - upper) / 50.0 == pytest.approx(found.bar / found.bar_mm)


def test_a_body_is_as_high_as_its_distance_to_its_neighbours_allows() -> None:
    found = drawn(Side.SAGITTAL, spine(UPRIGHT))
    corners = np.array(found.layers[0].bodies[1].outline)
    height, depth = np.ptp(corners[:, 1]), np.ptp(corners[:, 0])
    parameters = DrawingParameters()
    mm = found.bar / found.bar_mm
    assert height / mm == pytest.approx(parameters.body_height * 25.0)
    assert depth / height == pytest.approx(parameters.body_depth)


def test_the_outline_turns_with_the_vertebra() -> None:
    turned = spine(UPRIGHT, {"T8": (20.0, 0.0, 0.0)})
    found = drawn(Side.CORONAL, turned)
    left, right = sorted(found.layers[0].bodies[1].outline[:2])
    # +20 degrees about the anterior axis raise the left side, which is at the left of this view.
    assert angle_deg(Line(left, right)) == pytest.approx(20.0)


def test_cobb_lines_have_the_angle_of_the_end_vertebrae() -> None:
    curve = stage_spine(0).curves[0].model_copy(update={"upper": "T7", "apex": "T8", "lower": "T9"})
    tilted = spine(UPRIGHT, {"T7": (-20.0, 0.0, 0.0), "T9": (15.0, 0.0, 0.0)})
    found = drawn(Side.CORONAL, tilted.model_copy(update={"curves": [curve]}))
    upper, lower = found.layers[0].cobb
    assert angle_deg(upper) == pytest.approx(-20.0)
    assert angle_deg(lower) == pytest.approx(15.0)
    assert not drawn(Side.SAGITTAL, tilted.model_copy(update={"curves": [curve]})).layers[0].cobb


def test_the_view_from_above_shows_axial_rotation_by_a_line_to_the_front() -> None:
    found = drawn(Side.TOP, spine({"T7": (0.0, 0.0, 0.0)}, {"T7": (0.0, 0.0, 30.0)}))
    (x0, y0), (x1, y1) = found.layers[0].bodies[0].centre, found.layers[0].bodies[0].front
    # The anterior side turns left: the tip is 30 degrees to the left of straight up.
    assert np.degrees(np.arctan2(x0 - x1, y0 - y1)) == pytest.approx(30.0)


def test_the_view_from_above_outlines_only_end_vertebrae_and_apices() -> None:
    found = drawn(Side.TOP, stage_spine(0))
    assert [body.level for body in found.layers[0].bodies if body.outlined] == ["T7", "T9", "L1"]
    without = drawn(Side.TOP, stage_spine(0).model_copy(update={"curves": []}))
    assert [body.level for body in without.layers[0].bodies if body.outlined] == ["T7", "L1"]


def test_two_stages_are_drawn_at_one_scale_and_labelled_by_the_later_one() -> None:
    moved = spine({level: (x, y - 5.0, z) for level, (x, y, z) in UPRIGHT.items()})
    found = drawn(Side.CORONAL, spine(UPRIGHT), moved)
    assert [layer.role for layer in found.layers] == ["before", "after"]
    (x0, _), (x1, _) = centre(found, "T8", 0), centre(found, "T8", 1)
    assert x1 - x0 == pytest.approx(5.0 * found.bar / found.bar_mm)
    assert [label.text for label in found.labels] == ["T7", "T8", "T9"]
    assert {label.at[1] - 3.5 for label in found.labels} == {
        body.centre[1] for body in found.layers[1].bodies
    }


def test_what_has_no_pose_is_not_drawn_and_interrupts_the_line() -> None:
    found = drawn(Side.CORONAL, stage_spine(0))
    assert [body.level for body in found.layers[0].bodies] == ["T7", "T8", "T9", "T10", "T11", "T12", "L1"]
    assert len(found.layers[0].lines) == 6
    whole = stage_spine(0)
    gone = whole.vertebrae[4].model_copy(update={"position_mm": None, "rotation": None})
    gap = whole.model_copy(update={"vertebrae": [*whole.vertebrae[:4], gone, *whole.vertebrae[5:]]})
    assert len(drawn(Side.CORONAL, gap).layers[0].lines) == 4
    nothing = whole.model_copy(update={"vertebrae": [whole.vertebrae[0]]})
    assert draw([nothing], Side.CORONAL) is None


def test_a_single_vertebra_has_the_default_size() -> None:
    parameters = replace(DrawingParameters(), default_spacing_mm=40.0, body_height=0.5)
    found = draw([spine({"T7": (1.0, 2.0, 3.0)})], Side.CORONAL, parameters)
    assert found is not None
    corners = np.array(found.layers[0].bodies[0].outline)
    assert np.ptp(corners[:, 1]) / (found.bar / found.bar_mm) == pytest.approx(20.0)


@settings(max_examples=60)
@given(
    st.sampled_from(list(Side)),
    st.lists(st.tuples(*[st.floats(-300, 300)] * 3), min_size=1, max_size=17),
    st.tuples(*[st.floats(-90, 90)] * 3),
)
def test_everything_is_inside_the_drawing(
    side: Side, positions: list[tuple[float, float, float]], turn: tuple[float, float, float]
) -> None:
    names = [f"T{number}" for number in range(1, 13)] + [f"L{number}" for number in range(1, 6)]
    levels = dict(zip(names, positions, strict=False))
    found = drawn(side, spine(levels, dict.fromkeys(levels, turn)))
    points = np.array(
        [point for body in found.layers[0].bodies for point in (*body.outline, body.centre, body.front)]
        + [end for line in found.layers[0].cobb for end in (line.start, line.end)]
    )
    assert (points >= 0).all()
    assert (points <= [found.width, found.height]).all()
