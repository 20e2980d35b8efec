"""Tables whose keys depend on one of them: on a shape, or on a kind."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import msgspec

from scalpel_sim.errors import UsageError


class KeysOfKind(NamedTuple):
    """The keys of a table of one kind."""

    needed: Sequence[str] = ()
    possible: Sequence[str] = ()
    """Those that it may have besides."""


def check_keys(
    table: msgspec.Struct, where: str, kind_key: str, kinds: Mapping[str, KeysOfKind]
) -> None:
    """Check that the keys of a table are those of its kind. Keys of no kind belong to all.

    Args:
        table: The table; a key that is not given is None.
        where: Its name as a file writes it.
        kind_key: The key that says of which kind it is.
        kinds: The keys of each kind.

    Raises:
        UsageError: one is missing, or belongs to another kind.
    """
    kind = getattr(table, kind_key)
    own = kinds[kind]
    for key in own.needed:
        if getattr(table, key) is None:
            raise UsageError(f'{where} of {kind_key} "{kind}" has no {key}')
    for owner, keys in kinds.items():
        for key in (*keys.needed, *keys.possible):
            if key not in (*own.needed, *own.possible) and getattr(table, key) is not None:
                keys_of_own = ", ".join((*own.needed, *own.possible)) or f"none beside {kind_key}"
                raise UsageError(
                    f'{where} of {kind_key} "{kind}" has the key {key}, which belongs to '
                    f'{kind_key} "{owner}"; it has {keys_of_own}'
                )
