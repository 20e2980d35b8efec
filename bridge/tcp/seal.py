"""Seals on messages: who has no key can neither make one, nor change, repeat, drop or reorder any.

Both sides draw a nonce, and from the key that they share and both nonces each direction gets a key
of its own. So a recorded conversation is worth nothing in another one, and a message is worth
nothing when it is sent back. A seal is HMAC-SHA256 (RFC 2104), cut to half its length as in RFC
4868, over the number of messages before it in its direction, its kind, its sequence, its payload.

Nothing is encrypted: who can listen hears where the blade is.
"""

import hmac
import secrets
import struct
from typing import NamedTuple

from bridge.tcp.wire import VERSION, Frame, MessageError

NONCE_BYTES = 32
"""[byte]. Random, so that no two conversations have the same keys."""
SEAL_BYTES = 16
"""[byte], at the end of a payload."""

_PLACE = struct.Struct("<QHI")


class DirectionKeys(NamedTuple):
    """One key for each direction of one conversation."""

    to_server: bytes
    to_client: bytes


def new_nonce() -> bytes:
    """Return random bytes that nobody has seen before."""
    return secrets.token_bytes(NONCE_BYTES)


def direction_keys(key: bytes, client_nonce: bytes, server_nonce: bytes) -> DirectionKeys:
    """Return the keys of one conversation."""
    nonces = client_nonce + server_nonce
    return DirectionKeys(
        hmac.digest(key, b"scalpel-sim %d to server" % VERSION + nonces, "sha256"),
        hmac.digest(key, b"scalpel-sim %d to client" % VERSION + nonces, "sha256"),
    )


class Sealer:
    """Seals the messages of one direction, or breaks their seals, in the order of the stream."""

    def __init__(self, key: bytes) -> None:
        self._keyed = hmac.new(key, digestmod="sha256")  # copied: that saves half of the time
        self._n_before = 0

    @property
    def n_before(self) -> int:
        """How many messages it has sealed, or whose seals it has broken."""
        return self._n_before

    def sealed(self, kind: int, sequence: int, payload: bytes | memoryview) -> bytes:
        """Return a payload with its seal."""
        seal = self._seal(kind, sequence, payload)
        self._n_before += 1
        return bytes(payload) + seal

    def opened(self, frame: Frame) -> Frame:
        """Return a frame without its seal.

        Raises:
            MessageError: the seal is not what it must be.
        """
        split = max(len(frame.payload) - SEAL_BYTES, 0)
        payload, seal = frame.payload[:split], frame.payload[split:]
        if not hmac.compare_digest(seal, self._seal(frame.kind, frame.sequence, payload)):
            raise MessageError(
                "a message's seal is wrong: it comes from somebody without the key, or has been "
                "changed, repeated or left out on its way"
            )
        self._n_before += 1
        return frame._replace(payload=payload)

    def _seal(self, kind: int, sequence: int, payload: bytes | memoryview) -> bytes:
        code = self._keyed.copy()
        code.update(_PLACE.pack(self._n_before, kind, sequence))
        code.update(payload)
        return code.digest()[:SEAL_BYTES]
