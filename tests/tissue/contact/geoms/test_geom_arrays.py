"""Contacts with geoms keep all that they are where their arrays grow."""

import numpy as np
import pytest

from tissue import Geom
from tissue.contact.geoms.geom_arrays import grown_geom_contacts, new_geom_contacts, new_geoms


@pytest.mark.parametrize("first", [0, 4])
def test_growing_keeps_every_row_of_the_list_in_use(first):
    contacts = new_geom_contacts(new_geoms([Geom("ball", "sphere", (1.0,))]), 4, n_nodes=6)
    contacts.first, contacts.n_contacts = first, 3
    arrays = {
        name: value for name, value in vars(contacts).items() if isinstance(value, np.ndarray)
    }
    of_rows = {name: array for name, array in arrays.items() if len(array) == 8}
    assert {"point", "force", "impulse", "slop", "touches"} <= set(of_rows)
    for k, array in enumerate(of_rows.values()):
        array[:] = np.arange(array.size).reshape(array.shape) + 100 * k
    grown = grown_geom_contacts(contacts, 10, n_nodes=9)
    assert (grown.first, grown.n_contacts) == (0, 3)
    for name, array in of_rows.items():
        assert (getattr(grown, name)[:3] == array[first : first + 3]).all(), name
