from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.planning.field_view import visible_in_both
from spinewatch.simulation.rigs import table_3_3_rig


def test_the_points_of_table_3_4_are_visible_in_both_images() -> None:
    used = {str(i) for i in (3, 4, 5, 6, 9, 10, 11, 12, 15, 16, 17, 18)}
    visible = visible_in_both(table_3_3_rig(), pegboard_1995())
    assert used <= set(visible)
    assert set(visible_in_both(table_3_3_rig(), pegboard_1995(), margin_px=60)) < set(visible)
