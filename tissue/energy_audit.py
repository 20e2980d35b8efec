"""Where the work of the blade goes: `Audit` keeps the account of a body."""

from tissue.blade.anchors import Edge, anchors_energy
from tissue.blade.forces import Tool
from tissue.blade.impulse_totals import (
    RELEASED,
    WORK_OF_BLADE,
    WORK_OF_BREAKING,
    WORK_OF_CUTTING,
    WORK_OF_FRICTION,
)
from tissue.blade.side_contact import flanks_energy
from tissue.core.vec3 import Vec3
from tissue.elasticity.energy import body_energy, kinetic_energy, potential_energy
from tissue.elasticity.internal_forces import Elastic, elastic_energy
from tissue.integrators.audited import Audited
from tissue.mesh.body import Body
from tissue.types import Energies


class Audit:
    """The account of one body. It costs a pass over the body in each step, and two in each cut."""

    def __init__(self, gravity: Vec3) -> None:
        self._gravity = gravity
        self.audited = Audited()
        """Steps the body, and counts what damping and contact take."""
        self._topology = 0.0
        self._at_first = (0.0, 0.0, 0.0)

    def begin(self, body: Body, elastic: Elastic) -> None:
        """Begin the account with the body as it is."""
        self.audited.damping = self.audited.contact = self._topology = 0.0
        self._at_first = self._stored(body, elastic)

    def before_cut(self, body: Body, elastic: Elastic, tool: Tool, edge: Edge, when: float) -> None:
        """Take note of the energy before the mesh changes."""
        self._topology += self._all(body, elastic, tool, edge, when)

    def after_cut(self, body: Body, elastic: Elastic, tool: Tool, edge: Edge, when: float) -> None:
        """Count what the change took."""
        self._topology -= self._all(body, elastic, tool, edge, when)

    def energies(self, body: Body, elastic: Elastic, tool: Tool, edge: Edge) -> Energies:
        """Return the account at the end of a step."""
        totals = tool.anchors.totals
        elastic_now, kinetic, potential = self._stored(body, elastic)
        elastic_first, kinetic_first, potential_first = self._at_first
        held = anchors_energy(tool.anchors, body, edge, 1.0, tool.resistance)
        return Energies(
            work_of_blade=float(totals[WORK_OF_BLADE]),
            elastic=elastic_now - elastic_first,
            kinetic=kinetic - kinetic_first,
            potential=potential - potential_first,
            held=held + flanks_energy(tool.flanks),
            damping=self.audited.damping,
            cutting=float(totals[WORK_OF_CUTTING]),
            breaking=float(totals[WORK_OF_BREAKING]),
            friction=float(totals[WORK_OF_FRICTION]),
            contact=self.audited.contact,
            topology=self._topology,
            released=float(totals[RELEASED]),
        )

    def _stored(self, body: Body, elastic: Elastic) -> tuple[float, float, float]:
        potential = potential_energy(body, self._gravity)
        return elastic_energy(elastic, body), kinetic_energy(body), potential

    def _all(self, body: Body, elastic: Elastic, tool: Tool, edge: Edge, when: float) -> float:
        stored = body_energy(body, elastic, self._gravity)
        return stored + anchors_energy(tool.anchors, body, edge, when, tool.resistance)
