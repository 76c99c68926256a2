"""Names of files that are sent, in any script."""

from urllib.parse import unquote

import pytest
from starlette.responses import Response

from backend.api.messages.disposition import disposition


@pytest.mark.parametrize("name", ["report-龙门轴.html", 'a "b".npz', "X.pdf", "é;ü\r\nZ: 1.pdf"])
def test_a_file_with_any_name_can_be_sent(name: str) -> None:
    sent = Response(b"", headers=disposition("inline", name)).headers["content-disposition"]
    # RFC 8187: the charset, no language, and nothing but percent-encoded octets.
    kind, _, encoded = sent.partition("; filename*=UTF-8''")
    assert (kind, unquote(encoded)) == ("inline", name)
    assert encoded.isascii()
    assert not set(encoded) & set('"; \r\n')
