"""Values to MessagePack and back: a named tuple is a map of its fields, an array its raw bytes.

The fields of a message are read from the named tuple that it carries. Only what a type annotation
does not say is added: shapes of arrays, and bounds of numbers.
"""

import math
import sys
from collections.abc import Callable
from typing import Annotated, Any, Generic, TypeVar, get_args, get_type_hints

import msgspec
import numpy as np
import numpy.typing as npt

from bridge.tcp.wire import LARGEST_REPLY, MessageError
from tissue.support import dtype_of

_T = TypeVar("_T")

Count = Annotated[int, msgspec.Meta(ge=0, le=LARGEST_REPLY)]
"""A number of things: no reply could hold more."""
FiniteFloat = Annotated[float, msgspec.Meta(ge=-sys.float_info.max, le=sys.float_info.max)]
"""A float that is neither infinite nor NaN."""

MAP_BYTES = 1 << 10
"""Largest length of a message without its arrays and lists [byte]: keys and single numbers."""


class Message(Generic[_T]):
    """The content of one kind of message.

    Args:
        part: What the content is: `Record`, `Array`, `Many`, or a type that MessagePack has.
        what: Name of the content, for errors.
        check: Function that raises MessageError for values that no sender means.
    """

    def __init__(self, part: Any, what: str, check: Callable[[_T], None] | None = None) -> None:
        self._part = _part_of(part)
        self._decoder = msgspec.msgpack.Decoder(self._part.type)
        self._what, self._check = what, check

    def pack(self, value: _T) -> bytes:
        """Return the content with a value."""
        return _encoder.encode(self._part.plain(value))

    def unpack(self, payload: bytes) -> _T:
        """Return the value in a content. Its arrays are copies, which can be written to.

        Raises:
            MessageError: it cannot be read, a field is missing, unknown or out of range, or an
                array has another length.
        """
        try:
            plain = self._decoder.decode(payload)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise MessageError(f"{self._what} cannot be read: {error}") from error
        try:
            value: _T = self._part.value(plain, {})
            if self._check is not None:
                self._check(value)
        except MessageError as error:
            raise MessageError(f"{self._what} cannot be read: {error}") from error
        return value


class Part:
    """A part of a content, between a value and what MessagePack has: here the value itself.

    Args:
        kind: Types that MessagePack has, as `msgspec` checks them.
    """

    def __init__(self, kind: Any) -> None:
        self.type = kind

    def plain(self, value: Any) -> Any:
        """Return what MessagePack has for a value."""
        return value

    def value(self, plain: Any, lengths: dict[str, int]) -> Any:
        """Return the value of what MessagePack has.

        Args:
            plain: What was decoded.
            lengths: Lengths of arrays by their letter, in the same named tuple.

        Raises:
            MessageError: an array has another length.
        """
        return plain


class Array(Part):
    """An array of a known type and shape.

    Args:
        scalar: Type of its elements: float64, int64 or bool.
        shape: Its shape. The first length may be a letter: any length, but the same in all arrays
            of a named tuple that have this letter.
        what: Name of the array, for errors.
    """

    def __init__(self, scalar: Any, shape: tuple[Any, ...], what: str) -> None:
        super().__init__(bytearray)
        self._stored = np.dtype(scalar).newbyteorder("<")
        self._scalar, self._first, self._rest = np.dtype(scalar), shape[0], shape[1:]
        self._row_bytes = self._stored.itemsize * math.prod(self._rest)
        self._what = what

    def plain(self, value: Any) -> Any:
        """Return a view of the bytes of an array, which the encoder copies."""
        return np.ascontiguousarray(value, self._stored).reshape(-1).view(np.uint8).data

    def value(self, plain: bytearray, lengths: dict[str, int]) -> npt.NDArray[Any]:
        """Return the array of which these are the bytes."""
        n = self._first
        if isinstance(n, str):
            n = lengths.setdefault(n, len(plain) // self._row_bytes)
        if len(plain) != n * self._row_bytes:
            raise MessageError(f"{self._what} has {len(plain)} bytes; wanted {n * self._row_bytes}")
        if self._scalar == np.bool_ and max(plain, default=0) > 1:
            raise MessageError(f"a flag of {self._what} is neither 0 nor 1")
        array: npt.NDArray[Any] = np.ndarray((n, *self._rest), self._stored, plain)
        return array.astype(self._scalar, copy=False)


class Many(Part):
    """A tuple of named tuples.

    Args:
        record: Each of them.
        limit: Largest number of them.
    """

    def __init__(self, record: "Record", limit: int) -> None:
        super().__init__(Annotated[list[record.type], msgspec.Meta(max_length=limit)])  # type: ignore[name-defined]
        self._record = record

    def plain(self, value: Any) -> Any:
        """Return a list of maps."""
        return [self._record.plain(each) for each in value]

    def value(self, plain: Any, lengths: dict[str, int]) -> Any:
        """Return the tuple."""
        return tuple(self._record.value(each, lengths) for each in plain)


class Record(Part):
    """A named tuple, as a map of its fields.

    Args:
        kind: The named tuple. A field that may be None, or has another default, may be missing.
        fields: Of each array its shape, as in `Array`; of what is made of named tuples `Record` or
            `Many`; of others a type with bounds, or nothing where their own is enough.
    """

    def __init__(self, kind: Any, **fields: Any) -> None:
        self._kind = kind
        hints = get_type_hints(kind)
        self._parts = {name: _field_part(name, hints[name], fields) for name in kind._fields}
        given: list[Any] = []
        for name, part in self._parts.items():
            is_optional = type(None) in get_args(hints[name])
            found = part.type | None if is_optional else part.type
            default = (
                {name: kind._field_defaults.get(name)} if is_optional else kind._field_defaults
            )
            given.append((name, found, default[name]) if name in default else (name, found))
        super().__init__(
            msgspec.defstruct(kind.__name__, given, kw_only=True, forbid_unknown_fields=True)
        )

    def plain(self, value: Any) -> Any:
        """Return a map of the fields."""
        # Field by field: a named tuple may make some of them when they are first read.
        return {
            name: None if each is None else part.plain(each)
            for (name, part), each in zip(self._parts.items(), value, strict=True)
        }

    def value(self, plain: Any, lengths: dict[str, int]) -> Any:
        """Return the named tuple."""
        own: dict[str, int] = {}
        found = [(part, getattr(plain, name)) for name, part in self._parts.items()]
        return self._kind._make(
            None if each is None else part.value(each, own) for part, each in found
        )


def _field_part(name: str, hint: Any, fields: dict[str, Any]) -> Part:
    """Return the part of a field of a named tuple.

    Args:
        name: Name of the field.
        hint: Type by its annotation.
        fields: What is given of the fields, by name.
    """
    alone = [each for each in get_args(hint) if each is not type(None)]
    kind = alone[0] if type(None) in get_args(hint) else hint
    given = fields.get(name, kind)
    if isinstance(given, tuple):
        return Array(dtype_of(kind), given, name)
    return _part_of(given)


def _part_of(given: Any) -> Part:
    """Return a part, which is a plain one where a type is given."""
    return given if isinstance(given, Part) else Part(given)


def _of_scalar(value: Any) -> Any:
    """Return a number of NumPy as one of Python."""
    return value.item()


_encoder = msgspec.msgpack.Encoder(enc_hook=_of_scalar)


def expect_finite(*arrays: npt.NDArray[np.float64]) -> None:
    """Refuse arrays with a number that is not finite.

    Raises:
        MessageError: there is one.
    """
    if not all(np.isfinite(array).all() for array in arrays):
        raise MessageError("a number is not finite")
