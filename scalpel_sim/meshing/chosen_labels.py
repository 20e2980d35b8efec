"""Which labels of a volume become tissue: `--keep-labels 3,5` and `--label 3,5=liver`."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from scalpel_sim.errors import UsageError
from tissue import IntArray


class ChosenLabels(NamedTuple):
    """Labels of a volume, some of them joined, others left out."""

    joined: dict[int, int]
    """The label that each becomes."""
    names: dict[int, str]


def chosen_labels(
    labels: IntArray, names: Mapping[int, str], kept: str | None, joined: Sequence[str]
) -> ChosenLabels:
    """Return the labels that were asked for.

    Args:
        labels: Of the voxels.
        names: Names that the file has.
        kept: `3,5`: only these. None: all but 0.
        joined: `3,5=liver`, each: these become the first of them, with that name.

    Raises:
        UsageError: a label is not in the file, or the text says nothing.
    """
    there = [n for n in np.unique(labels).tolist() if n > 0]
    wanted = there if kept is None else _numbers(kept, "--keep-labels", there)
    becomes = {label: label for label in wanted}
    named = {label: names[label] for label in wanted if label in names}
    for text in joined:
        numbers, equals, name = text.partition("=")
        if not equals or not name.strip():
            raise UsageError(f"--label is '{text}'; it is numbers and a name, as in 3,5=liver")
        group = _numbers(numbers, "--label", wanted)
        becomes.update(dict.fromkeys(group, group[0]))
        for label in group:
            named.pop(label, None)
        named[group[0]] = name.strip()
    return ChosenLabels(becomes, named)


def _numbers(text: str, option: str, there: Sequence[int]) -> list[int]:
    """Return numbers between commas.

    Raises:
        UsageError: there are none, or one is no label that is there.
    """
    try:
        numbers = [int(part) for part in text.split(",")]
    except ValueError:
        raise UsageError(f"{option} is '{text}'; it takes whole numbers, as in 3,5") from None
    if missing := [n for n in numbers if n not in there]:
        listed = ", ".join(map(str, there[:20])) + (", ..." if len(there) > 20 else "")
        raise UsageError(
            f"{option} names label {missing[0]}, which is not there; there are {listed}"
        )
    return numbers
