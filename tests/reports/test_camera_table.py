from typing import Any

from reports.camera_table import camera_table

CAMERA: dict[str, Any] = {
    "position_mm": [-211.0, 0.0, 720.25],
    "rotation_deg": [0.4, -16.1, 0.2],
    "focal_length_mm": 8.7,
    "principal_point_mm": [0.05, -0.02],
    "radial": [0.0021, 0.0],
    "decentering": [0.0, 0.0],
    "pixel_size_mm": [0.01, 0.00845],
}
QUALITY: dict[str, Any] = {"sd": {"Z0": 0.1234, "K1": None}, "image_rms_px": 0.0217, "points": 12}


def test_each_parameter_has_its_value_and_standard_deviation() -> None:
    table = camera_table({"left": CAMERA}, {"left": QUALITY})
    rows = dict(table.rows)
    assert table.cameras == ("left",)
    assert rows["Z0 (mm)"] == (("720.25", "0.12"),)
    assert rows["f (mm)"] == (("8.7", "fixed"),)
    assert rows["K1 (mm⁻²)"] == (("0.0021", "undetermined"),)
    assert rows["aspect"] == (("0.845", "fixed"),)
    assert rows["image RMS (px)"] == (("0.022", ""),)
    assert rows["points"] == (("12", ""),)


def test_cameras_are_columns_in_the_given_order() -> None:
    table = camera_table({"b": CAMERA, "a": CAMERA}, {"a": QUALITY, "b": {**QUALITY, "points": 3}})
    assert table.cameras == ("b", "a")
    assert dict(table.rows)["points"] == (("3", ""), ("12", ""))
    assert all(len(cells) == 2 for _, cells in table.rows)
