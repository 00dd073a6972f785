from pathlib import Path

import httpx
import pytest

from commands.shared.api_client import ApiClient
from commands.shared.files import InputError
from commands.shared.sample_surgery import measure_surgery


@pytest.mark.parametrize(
    ("text", "words"), [("{", "is not JSON"), ('{"id": "D1"}', "lacks reference_vertebra")]
)
def test_a_description_that_cannot_be_used_is_named(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "surgery.json").write_text(text)
    transport = httpx.MockTransport(lambda _: httpx.Response(500))
    with ApiClient("http://service", transport) as api, pytest.raises(InputError, match=words):
        measure_surgery(api, tmp_path)
