"""The attributes of an object are those in its dictionary, which need not be made for that."""

import gc
import sys

import pytest

from tissue.core.attributes import attributes_of, set_attributes


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
