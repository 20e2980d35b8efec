"""Relaxation in one call gives the bits of relaxation stage by stage, whatever needs room."""

import pytest

from tests.support import bodies, strokes
from tests.system.state.test_determinism import fingerprint
from tissue import BladeShape, Material, SolverSettings, Tissue
from tissue.forces.contact_frequencies import frequency_of_contacts
from tissue.integrators.bielser_1998.stepper import relax_in_stages
from tissue.integrators.step_size import begin_increment, next_part, room_for_contact
from tissue.mesh.tetrahedron_grid import no_grid

MESH = bodies.jittered(4, 0)
SOLID = Material(law="neo_hookean", poisson_ratio=0.45)
STIFFENING = Material(law="exponential", stiffening=5.0, prony=((0.3, 0.05),))
SPRINGS = Material(law="springs", poisson_ratio=0.25)


def body(material=SOLID, relaxation="global", blade=None):
    """Return a jittered block that is held at its sides, with contact as forces."""
    return Tissue(
        MESH,
        material,
        fixed=bodies.sides(MESH),
        blade=blade,
        solver=SolverSettings(relaxation=relaxation),
    )


class InStages:
    """The integrator of all nodes, which relaxes stage by stage."""

    def __init__(self, stepper):
        self._stepper = stepper

    def __getattr__(self, name):
        return getattr(self._stepper, name)

    def relax(self, system, arrays, increment, has_blade):
        return relax_in_stages(self, system, arrays.blade, increment, has_blade)

    def advance(self, system, increment):
        stepper, contact, elastic = self._stepper, system.contact, system.elasticity.arrays
        choice = stepper.choice
        room = room_for_contact(choice, system.context, increment.span)
        bounds = elastic.frequency_squared, elastic.highest, room
        contact.prepare(system.body, *bounds, increment.span)
        of_contact = system.context, contact.search, contact.limits
        choice.of_contact = frequency_of_contacts(*of_contact)
        begin_increment(choice, system.context, *increment[1:])
        while next_part(choice, system.context):
            part = increment._replace(begin=choice.begin, end=choice.part_end)
            stepper.take_steps(system, part, choice.n_steps)
        return choice.done


@pytest.mark.parametrize(
    ("material", "relaxation"),
    [(SOLID, "global"), (SOLID, "verlet"), (STIFFENING, "global"), (SPRINGS, "global")],
)
def test_one_call_gives_the_bits_of_the_stages(material, relaxation):
    stroke = strokes.slanted(MESH)
    whole, staged = (body(material, relaxation, BladeShape()) for _ in range(2))
    staged._stages.integrator = InStages(staged._stages.global_stepper)
    expected = fingerprint(staged, strokes.make(staged, stroke))
    assert fingerprint(whole, strokes.make(whole, stroke)) == expected


@pytest.mark.parametrize("blade", [None, BladeShape()], ids=["line", "scalpel"])
def test_a_grid_that_is_built_anew_in_every_step_changes_nothing(blade):
    stroke = strokes.slanted(MESH)
    usual, other = body(blade=blade), body(blade=blade)
    expected = fingerprint(usual, strokes.make(usual, stroke))
    results = []
    for sweep in strokes.sweeps(stroke):
        other._model.interaction.grid = no_grid()
        results.append(other.step(sweep, strokes.DT))
    assert fingerprint(other, results) == expected


def test_side_contacts_that_run_out_of_room_change_nothing(monkeypatch):
    stroke = strokes.slanted(MESH)
    ample = body(blade=BladeShape())
    expected = fingerprint(ample, strokes.make(ample, stroke))
    monkeypatch.setattr("tissue.blade.faces_contact._FACES_AT_FIRST", 1)
    tight = body(blade=BladeShape())
    assert len(tight._model.interaction.state.sides.face) == 1
    assert fingerprint(tight, strokes.make(tight, stroke)) == expected
