"""Named tuples to MessagePack and back, bit for bit; what is no such message is refused by name."""

from typing import NamedTuple

import msgspec
import numpy as np
import pytest

from bridge.tcp.messages.encoding import Count, Many, Message, Record
from bridge.tcp.wire import MessageError
from tests.bridge.bits import bits
from tests.bridge.changed_messages import changed, raw
from tissue import BoolArray, FloatArray, IntArray


class Inner(NamedTuple):
    number: float
    array: FloatArray


class Outer(NamedTuple):
    rows: FloatArray
    numbers: IntArray
    flags: BoolArray
    count: int
    inner: Inner | None
    many: tuple[Inner, ...] = ()
    text: str = "default"


INNER = Record(Inner, array=(2,))
MESSAGE: Message[Outer] = Message(
    Record(
        Outer,
        rows=("n", 3),
        numbers=("n",),
        flags=("m",),
        count=Count,
        inner=INNER,
        many=Many(INNER, 2),
    ),
    "the example",
)
PART = Inner(-0.0, np.array([np.nan, -np.inf]))
VALUE = Outer(
    np.array([[0.1, -0.0, 5e-324], [1e300, np.nan, 1.0 / 3.0]]),
    np.array([-(2**63), 2**63 - 1]),
    np.array([True, False, True]),
    7,
    PART,
    (PART, PART),
    "µ",
)


@pytest.mark.parametrize("value", [VALUE, VALUE._replace(inner=None, many=())])
def test_a_named_tuple_arrives_bit_for_bit(value):
    assert bits(MESSAGE.unpack(MESSAGE.pack(value))) == bits(value)


def test_arrays_of_length_zero_and_strided_ones_arrive():
    sent = VALUE._replace(rows=np.zeros((0, 3)), numbers=np.zeros(0, np.int64))
    assert bits(MESSAGE.unpack(MESSAGE.pack(sent))) == bits(sent)
    strided = VALUE._replace(rows=np.arange(12.0).reshape(2, 6)[:, ::2])
    found = MESSAGE.unpack(MESSAGE.pack(strided))
    assert found.rows.tolist() == strided.rows.tolist()


def test_received_arrays_are_writable():
    found = MESSAGE.unpack(MESSAGE.pack(VALUE))
    assert all(array.flags.writeable for array in found[:3])


def test_numbers_of_numpy_are_numbers_and_other_types_of_arrays_are_converted():
    sent = VALUE._replace(count=np.int64(7), inner=Inner(np.float64(0.5), np.array([1, 2])))
    assert MESSAGE.unpack(MESSAGE.pack(sent)).inner.array.tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"rows": raw(*range(5))}, "rows has 40 bytes; wanted 24"),
        ({"rows": raw(*range(9))}, "numbers has 16 bytes; wanted 24"),
        ({"numbers": b"\0" * 15}, "numbers has 15 bytes; wanted 16"),
        ({"flags": b"\0\1\2"}, "a flag of flags is neither 0 nor 1"),
        ({"inner__array": raw(1.0)}, "array has 8 bytes; wanted 16"),
        ({"many": [{"number": 0.0, "array": raw(0.0, 0.0)}] * 3}, "length <= 2.*many"),
        ({"count": -1}, r">= 0 .*count"),
        ({"count": 1.5}, "Expected `int`"),
        ({"text": b"\xff"}, "Expected `str`"),
        ({"colour": "red"}, "unknown field `colour`"),
        ({"inner": {"number": 0.0}}, "missing required field `array`"),
    ],
)
def test_a_message_with_one_wrong_part_is_refused_by_name(change, why):
    packed = MESSAGE.pack(VALUE)
    assert MESSAGE.unpack(packed)
    with pytest.raises(MessageError, match=f"the example cannot be read: .*{why}"):
        MESSAGE.unpack(changed(packed, **change))


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"\xc1",
        b"\xdf\xff\xff\xff\xff",
        b"\x81\xa1\xff\xc0",
        b"\x81\xa4text\xa1\xff",
        b"\x81\xa4rows\xc6\xff\xff\xff\xff",
        b"\x81\xa4many\xdd\xff\xff\xff\xff",
        b"\x81\xa4rows" + b"\x91" * 100_000,
    ],
)
def test_bytes_that_promise_more_or_end_early_are_refused(payload):
    with pytest.raises(MessageError, match="the example cannot be read"):
        MESSAGE.unpack(payload)


def test_what_follows_a_message_is_refused():
    with pytest.raises(MessageError, match="trailing"):
        MESSAGE.unpack(MESSAGE.pack(VALUE) + b"\0")


def test_fields_with_defaults_may_be_missing():
    content = msgspec.msgpack.decode(MESSAGE.pack(VALUE))
    for name in ("inner", "text"):
        del content[name]
    found = MESSAGE.unpack(msgspec.msgpack.encode(content))
    assert found.inner is None and found.text == "default"
