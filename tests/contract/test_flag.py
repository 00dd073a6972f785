import spinewatch.flags
from contract.flag import Flag


def test_flags_keep_code_detail_and_order() -> None:
    given = (
        spinewatch.flags.Flag("triad-count-low", "first"),
        spinewatch.flags.Flag("labels-uncertain", "second"),
    )
    assert [(flag.code, flag.detail) for flag in Flag.of(given)] == [
        ("triad-count-low", "first"),
        ("labels-uncertain", "second"),
    ]
