from importlib.metadata import version

import pytest

from commands.shared.anomalies import ANOMALIES, Anomaly, page
from tests.paths import PROJECT


@pytest.mark.parametrize("anomaly", ANOMALIES, ids=lambda anomaly: anomaly.identifier)
def test_each_was_examined_with_the_installed_version_and_has_a_test(anomaly: Anomaly) -> None:
    assert version(anomaly.package) == anomaly.version  # a new version: examine it, then change the list
    assert (PROJECT / anomaly.test).is_file()


def test_each_has_a_name_of_its_own() -> None:
    assert len({anomaly.identifier for anomaly in ANOMALIES}) == len(ANOMALIES)


def test_the_page_is_the_list() -> None:
    assert (PROJECT / "docs" / "anomalies.md").read_text(encoding="utf-8") == page()
