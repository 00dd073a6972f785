"""The head of an HTTP request, more strictly than h11 reads it: what two readers could read differently is refused."""

from __future__ import annotations

import re

import h11

from service.limits import MAX_HEAD_BYTES, MAX_HEADERS, MAX_TARGET_BYTES

_END = b"\r\n\r\n"
_LONE_BREAK = re.compile(rb"(?<!\r)\n|\r(?!\n|\Z)")
_FOLDED = re.compile(rb"\r\n[ \t]")
_FRAMING = re.compile(rb"^(content-length|transfer-encoding|host)[ \t]*:", re.IGNORECASE | re.MULTILINE)
_VERSION = re.compile(rb"[^\r\n]* HTTP/([0-9.]+)\r\n")
_FREE_CHUNKS = 256
_MIN_CHUNK_BYTES = 256
_STATUSES = frozenset({400, 414, 431, 501})


class StrictConnection(h11.Connection):
    """An HTTP/1.1 connection of a server whose errors are kept in ``refused``: a status and a sentence."""

    def __init__(self) -> None:
        super().__init__(h11.SERVER, MAX_HEAD_BYTES)
        self.refused: tuple[int, str] | None = None
        self._chunks, self._bytes = 0, 0

    def next_event(self) -> h11.Event | type[h11.NEED_DATA] | type[h11.PAUSED]:
        """Return the next event; raises ``h11.RemoteProtocolError`` for a request that is refused."""
        if self.their_state is h11.IDLE:
            refused = refused_head(self.trailing_data[0])
            if refused is not None:
                self._refuse(*refused)
        try:
            event = super().next_event()
        except h11.RemoteProtocolError as error:
            hint = error.error_status_hint
            status = hint if hint in _STATUSES else 400
            self.refused = (status, "this is not a valid request; see RFC 9112")
            raise
        if isinstance(event, h11.Request):
            self._chunks, self._bytes = 0, 0
        elif isinstance(event, h11.Data):
            self._chunks += event.chunk_start
            self._bytes += len(event.data)
            if self._chunks > _FREE_CHUNKS + self._bytes // _MIN_CHUNK_BYTES:
                self._refuse(
                    400, "the chunks of the body are too small; send larger ones, or a Content-Length"
                )
        return event

    def _refuse(self, status: int, detail: str) -> None:
        self.refused = (status, detail)
        raise h11.RemoteProtocolError(detail, error_status_hint=status)


def refused_head(received: bytes) -> tuple[int, str] | None:
    """Return status and sentence if the head that begins what was received is refused; it may be incomplete."""
    end = received.find(_END)
    head = received if end < 0 else received[: end + 2]
    return (
        _too_long(head)
        or _ambiguous_lines(head)
        or (None if end < 0 else _version(head) or _ambiguous_body(head))
    )


def _too_long(head: bytes) -> tuple[int, str] | None:
    if len(head.split(b"\r\n", 1)[0]) > MAX_TARGET_BYTES:
        return 414, f"the request line is longer than {MAX_TARGET_BYTES} bytes; shorten path and query"
    if len(head) > MAX_HEAD_BYTES or head.count(b"\r\n") > MAX_HEADERS + 1:
        return 431, f"more than {MAX_HEADERS} headers or {MAX_HEAD_BYTES} bytes of them; send fewer"
    return None


def _ambiguous_lines(head: bytes) -> tuple[int, str] | None:
    if _LONE_BREAK.search(head):
        return 400, "a line of the head does not end with CR LF; see RFC 9112"
    if _FOLDED.search(head):
        return 400, "a header is folded over two lines; write it in one"
    return None


def _version(head: bytes) -> tuple[int, str] | None:
    version = _VERSION.match(head)
    if version is not None and version[1] not in {b"1.0", b"1.1"}:
        return 505, "another version of HTTP than 1.1; use HTTP/1.1"
    return None


def _ambiguous_body(head: bytes) -> tuple[int, str] | None:
    framing = [name.lower() for name in _FRAMING.findall(head)]
    if len(set(framing)) < len(framing):
        return 400, "Host, Content-Length or Transfer-Encoding is given twice; send each once"
    old = head.split(b"\r\n", 1)[0].endswith(b"HTTP/1.0")
    if b"transfer-encoding" in framing and (old or b"content-length" in framing):
        return 400, "the length of the body is given in two ways; send Content-Length or Transfer-Encoding"
    return None
