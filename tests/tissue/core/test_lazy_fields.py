"""A tuple whose fields are made when they are asked for acts as a plain one."""

import copy
import gc
import pickle
import sys
from typing import NamedTuple

import numpy as np
import pytest

from tests.bridge.bits import bits
from tissue import BladeSegment, Wrench
from tissue.core.attributes import attributes_of, set_attributes
from tissue.core.lazy_fields import lazy_fields

NUMBERS = tuple(float(i) for i in range(9))


class Pair(NamedTuple):
    low: list
    high: int

    def width(self):
        return self.high - self.low[0]


@lazy_fields(low=lambda pair: pair.made.append(1) or pair.made)
class LazyPair(Pair):
    pass


def lazy_pair(high):
    pair = tuple.__new__(LazyPair, (None, high))
    pair.made = []
    return pair


def test_a_field_is_made_when_it_is_asked_for_and_once():
    pair = lazy_pair(3)
    assert pair.high == 3 and pair.made == []
    assert pair.low is pair.low and pair.made == [1]
    assert pair.width() == 2 and pair.made == [1]


@pytest.mark.parametrize("name", Pair._fields)
def test_no_field_can_be_set(name):
    with pytest.raises(AttributeError, match="can't set attribute"):
        setattr(lazy_pair(3), name, 0)


def test_all_that_looks_at_a_tuple_sees_all_fields():
    plain = Pair([1], 3)
    assert lazy_pair(3) == plain and plain == lazy_pair(3) and lazy_pair(3) == lazy_pair(3)
    assert lazy_pair(3) != Pair([1], 4) and lazy_pair(3) < lazy_pair(4)
    assert [*lazy_pair(3)] == [[1], 3] and tuple(lazy_pair(3)) == plain
    assert lazy_pair(3)[0] == [1] and lazy_pair(3)[:1] == ([1],) and len(lazy_pair(3)) == 2
    rest = (5,)
    assert lazy_pair(3) + rest == ([1], 3, 5) and rest + lazy_pair(3) == (5, [1], 3)
    assert lazy_pair(3) * 2 == 2 * lazy_pair(3) == 2 * tuple(plain)
    assert [1] in lazy_pair(3)
    assert lazy_pair(3).index([1]) == 0 and lazy_pair(3).count(3) == 1
    assert repr(lazy_pair(3)) == repr(plain) and lazy_pair(3)._asdict() == plain._asdict()
    low, high = lazy_pair(3)
    assert (low, high) == plain
    with pytest.raises(TypeError, match="unhashable"):
        hash(lazy_pair(3))


def test_copies_are_plain():
    for one in (
        copy.copy(lazy_pair(3)),
        copy.deepcopy(lazy_pair(3)),
        lazy_pair(2)._replace(high=3),
    ):
        assert type(one) is Pair and one == Pair([1], 3)


@pytest.mark.parametrize("kind", [BladeSegment, Wrench])
def test_three_vectors_of_numbers_are_those_of_arrays(kind):
    lazy, plain = kind.of_numbers(NUMBERS), kind(*np.array(NUMBERS).reshape(3, 3))
    assert isinstance(lazy, kind) and lazy.numbers == plain.numbers == NUMBERS
    assert bits(lazy) == bits(plain)
    assert bits(pickle.loads(pickle.dumps(kind.of_numbers(NUMBERS)))) == bits(plain)
    np.testing.assert_array_equal(np.array(kind.of_numbers(NUMBERS)), np.array(plain))
    np.testing.assert_array_equal(np.concatenate(kind.of_numbers(NUMBERS)), NUMBERS)


@pytest.mark.parametrize("kind", [BladeSegment, Wrench])
def test_the_numbers_follow_an_array_that_is_changed(kind):
    vectors = kind.of_numbers(NUMBERS)
    vectors[1][2] = -1.0
    assert vectors.numbers == (*NUMBERS[:5], -1.0, *NUMBERS[6:])


def test_the_numbers_of_a_vector_that_is_none_are_refused():
    with pytest.raises(ValueError, match="not enough values"):
        _ = BladeSegment(np.zeros(2), np.zeros(3), np.zeros(3)).numbers


def test_a_wrench_about_another_point_does_the_same_work_on_any_motion():
    random = np.random.default_rng(3)
    force, torque, point, other, velocity, turning = random.normal(size=(6, 3))
    there = Wrench(force, torque, point).about(other)
    power = force @ (velocity + np.cross(turning, point)) + torque @ turning
    assert there.point == pytest.approx(other)
    assert there.force @ (velocity + np.cross(turning, other)) + there.torque @ turning == (
        pytest.approx(power)
    )


class Owner:
    """An object with defaults, a computed attribute and attributes that come and go."""

    count = 0
    other: object = None
    name: str

    def __init__(self):
        self.items = [1, 2]
        self._twice = 2 * len(self.items)

    @property
    def size(self):
        return len(self.items)

    @size.setter
    def size(self, size):
        self.set_size = size

    def begin(self):
        self.count, self.begun = 0, True


def has_dictionary(owner):
    return any(isinstance(each, dict) for each in gc.get_referents(owner))


@pytest.mark.parametrize(
    "change",
    [
        lambda owner: None,
        lambda owner: owner.begin(),
        lambda owner: setattr(owner, "size", 3),
        lambda owner: setattr(owner, "other", None),
        lambda owner: setattr(owner, "other", owner.items),
        lambda owner: setattr(owner, "name", "a"),
    ],
)
def test_they_are_those_in_the_dictionary(change):
    owner = Owner()
    change(owner)
    found = attributes_of(owner)
    assert not has_dictionary(owner) or sys.version_info[:2] > (3, 12)
    assert found == vars(owner)


def test_a_name_that_is_not_in_the_code_of_the_class_is_found():
    owner = Owner()
    setattr(owner, "from " + "elsewhere", 1)
    assert attributes_of(owner) == {"items": [1, 2], "_twice": 4, "from elsewhere": 1}


@pytest.mark.parametrize("has_dict", [False, True])
def test_an_object_gets_those_it_had(has_dict):
    owner = Owner()
    if has_dict:
        vars(owner)["kept"] = 5
    before = attributes_of(owner)
    owner.begin()
    owner.items, owner.size, owner.other = [], 3, True
    del owner._twice
    set_attributes(owner, before, frozenset({"begun"}))
    assert vars(owner) == before | {"begun": True}
    assert owner.items is before["items"]
