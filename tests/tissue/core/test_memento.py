"""A tree of objects is put back: what each refers to, what is shared, and what arrays hold."""

import numpy as np

from tissue.core.memento import Memento, StateRules
from tissue.core.memento_reading import put_to, written
from tissue.core.memory_blocks import RowsInUse, StructRules
from tissue.core.structs import Arrays, FloatCell, IntCell


class Counted(Arrays):
    """Numbers, of which the first are in use, and a part of them."""

    n: IntCell
    total: FloatCell
    numbers: np.ndarray
    first_two: np.ndarray
    marks: np.ndarray


def counted(room=1000):
    numbers = np.zeros(room)
    marks = np.zeros(3, np.bool_)
    return Counted(n=0, total=0.0, numbers=numbers, first_two=numbers[:2], marks=marks)


class Owner:
    """An object with one of each."""

    def __init__(self, room=1000):
        self.struct = counted(room)
        self.names = ["a", "b"]
        self.table = {"x": 1.5}
        self.same = self.names
        self.array = np.arange(3.0)
        self.kept = len


RULES = StateRules(
    packages=frozenset({Owner.__module__.partition(".")[0]}),
    structs=StructRules(
        in_use=lambda structs: [RowsInUse(each, "numbers", (each, "n")) for each in structs]
    ),
)


def change(owner):
    """Change all of it."""
    for i in range(700):
        owner.struct.numbers[i] = i + 1.0
    owner.struct.n, owner.struct.total = 700, 3.5
    owner.struct.marks[:] = True
    owner.names.append("c")
    owner.table.clear()
    owner.same = ["another"]
    owner.array[:] = -1.0
    owner.new = True


def is_as_made(owner):
    struct = owner.struct
    return (
        (struct.n, struct.total) == (0, 0.0)
        and not struct.numbers.any()
        and not struct.marks.any()
        and owner.names == ["a", "b"]
        and owner.same is owner.names
        and owner.table == {"x": 1.5}
        and owner.array.tolist() == [0.0, 1.0, 2.0]
        and owner.kept is len
    )


def test_the_same_owners_get_the_same_objects_and_values_again():
    owner = Owner()
    struct, memento = owner.struct, Memento(owner, RULES)
    change(owner)
    memento.restore()
    assert is_as_made(owner) and owner.struct is struct and not hasattr(owner, "new")


def test_a_struct_that_was_replaced_by_a_larger_one_is_back():
    owner = Owner()
    struct, memento = owner.struct, Memento(owner, RULES)
    owner.struct = counted(2000)
    memento.restore()
    assert owner.struct is struct


def test_what_is_in_use_is_put_back_and_the_rest_is_as_it_was_made():
    owner = Owner()
    change(owner)
    memento = Memento(owner, RULES)
    owner.struct.numbers[:] = 7.0
    owner.struct.n = 1000
    memento.restore()
    numbers = owner.struct.numbers
    assert numbers[:700].tolist() == [i + 1.0 for i in range(700)] and not numbers[700:].any()


def test_another_tree_is_put_to_what_was_written_with_arrays_of_other_sizes():
    tree, arrays = written(Memento(Owner(), RULES))
    other = Owner(room=500)
    other.struct.numbers[:] = 9.0
    other.names.append("c")
    put_to(other, tree, arrays, RULES)
    assert is_as_made(other) and len(other.struct.numbers) == 1000
    other.struct.numbers[1] = 2.0
    assert other.struct.first_two[1] == 2.0  # a part of the same memory, as it was
