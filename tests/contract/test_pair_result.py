from contract.pair_result import PairResult


def test_a_pair_may_have_neither_features_nor_an_explanation() -> None:
    assert PairResult.model_validate_json("{}") == PairResult(features=None, explanation=None)
