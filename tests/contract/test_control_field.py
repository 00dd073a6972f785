from contract.control_field import ControlFieldPlan
from spinewatch.calibration.control_field import pegboard_1995


def test_points_are_those_of_the_field() -> None:
    field = pegboard_1995()
    plan = ControlFieldPlan.of(field, "id,x_mm,y_mm,z_mm\n", ("3", "4"))
    assert [point.id for point in plan.points] == list(field.ids)
    assert plan.points[2].position_mm == field.points_mm[2].tolist()
    assert (plan.name, plan.visible) == (field.name, ["3", "4"])
