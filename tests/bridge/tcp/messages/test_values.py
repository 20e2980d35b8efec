import struct

import numpy as np
import pytest

from bridge.tcp.messages.values import (
    pack_quantity,
    pack_values,
    unpack_quantity,
    unpack_values,
    values_bytes,
)
from bridge.tcp.wire import MessageError


def test_a_quantity_arrives_and_another_is_refused_with_the_known_ones():
    assert unpack_quantity(pack_quantity("strain")) == "strain"
    for payload in (b"", b"heat", b"\xff" * 1000, b"strain\0"):
        with pytest.raises(MessageError, match="there are displacement, strain, stress"):
            unpack_quantity(payload)


def test_values_arrive_bit_for_bit_and_within_the_bound():
    values = np.array([0.0, -0.0, 1e-300, 5.0])
    payload = pack_values(values)
    assert unpack_values(payload).tobytes() == values.tobytes()
    assert len(payload) == values_bytes(n_nodes=4)


@pytest.mark.parametrize("count", [-1, 3, 5, 2**62])
def test_a_wrong_count_of_values_is_refused(count):
    with pytest.raises(MessageError, match="do not fit"):
        unpack_values(struct.pack("<q", count) + bytes(32))


def test_values_that_are_short_or_not_finite_are_refused():
    with pytest.raises(MessageError, match="wanted 8 at least"):
        unpack_values(b"")
    with pytest.raises(MessageError, match="not finite"):
        unpack_values(pack_values(np.array([1.0, np.inf])))
