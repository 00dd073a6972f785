from contract.problem import FieldError, Problem


def test_the_example_is_a_problem() -> None:
    (example,) = Problem.model_json_schema()["examples"]
    assert Problem.model_validate(example).model_dump(exclude_none=True) == example


def test_errors_name_their_fields() -> None:
    error = FieldError(loc=["body", "vertebrae", 1], msg="not a vertebra", type="pattern")
    assert error.model_dump()["loc"] == ["body", "vertebrae", 1]


def test_only_the_null_members_of_the_problem_itself_are_left_out() -> None:
    class Detailed(Problem):
        limits: dict[str, float | None]

    members = Detailed(type="t", title="T", status=503, detail="d", limits={"least": None}).members()
    assert members == {"type": "t", "title": "T", "status": 503, "detail": "d", "limits": {"least": None}}
