"""Progress of a part of the work."""

from spinewatch.progress import part, silent


def test_a_part_reports_fractions_of_the_whole() -> None:
    seen: list[tuple[str, float]] = []
    inner = part(part(lambda step, fraction: seen.append((step, fraction)), 0.5, 1.0), 0.0, 0.5)
    for fraction in (0.0, 0.5, 1.0):
        inner("adjust", fraction)
    assert seen == [("adjust", 0.5), ("adjust", 0.625), ("adjust", 0.75)]


def test_silent_reports_nothing() -> None:
    silent("adjust", 0.5)
