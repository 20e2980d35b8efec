"""`Elasticity`: the arrays from which the forces inside a body are computed, kept true to cuts."""

import math

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import SameTypes
from tissue.elasticity.collapse import no_collapse, renew_collapsing
from tissue.elasticity.finite_elements import averages_shear, grown_solid, is_graded, no_solid
from tissue.elasticity.frequency.changes import (
    forget_added_mass,
    return_all_mass,
    update_frequencies,
)
from tissue.elasticity.frequency.strained import StepLimit, strained_frequency
from tissue.elasticity.graded import graded_solid, write_moduli
from tissue.elasticity.internal_forces import Elastic
from tissue.elasticity.mass_scaling import (
    LARGEST_ADDED_MASS,
    add_momentum,
    no_mass_scaling,
    write_masses,
)
from tissue.elasticity.relaxed_stress import inherit_at_nodes, inherit_relaxed
from tissue.elasticity.rest_shapes import build_tetrahedra
from tissue.elasticity.springs import build_rows, no_springs
from tissue.elasticity.stars import build_stars, room_for_stars
from tissue.elasticity.viscous_stress import grown_viscosity, no_viscosity
from tissue.laws.energy_density import averaged_shear, volume_term
from tissue.material import Material
from tissue.mesh.angular_momentum import return_spin
from tissue.mesh.body import Body
from tissue.mesh.changes import ChangedMesh
from tissue.mesh.material_table import OF_LAW, OF_STIFFENING, MaterialArrays
from tissue.mesh.star import LARGEST_STAR, Visits

ROOM_FOR_SPRINGS = 1 << 16
"""Free springs that the body begins with, beyond its own; the pool doubles when they are used."""

_FORGET_ADDED_MASS, _BUILD_ROWS = SameTypes(forget_added_mass), SameTypes(build_rows)
_RETURN_SPIN, _ADD_MOMENTUM = SameTypes(return_spin), SameTypes(add_momentum)


class Elasticity:
    """Springs and elements of a body, and a bound on its frequencies.

    Args:
        material: What the body is made of; of several materials the one whose law they have.
        body: The body, with its materials; its masses are written.
        visits: For searches.
        mass_scaling: Angular frequency [1/s] above which nodes get mass where tetrahedra carry the
            shear; None for no added mass. Where the uncut body has a higher one, that: only what a
            cut makes faster gets mass.
        is_single: Whether forces of tetrahedra are computed in single precision.
        averages_shear: Whether a share of the shear of tetrahedra is averaged around nodes.
        resists_collapse: Whether tetrahedra are kept from turning inside out where springs alone
            are elastic.
    """

    def __init__(
        self,
        material: Material,
        body: Body,
        visits: Visits,
        *,
        mass_scaling: float | None = None,
        is_single: bool = False,
        averages_shear: bool = False,
        resists_collapse: bool = True,
    ) -> None:
        self._relaxes = len(body.materials.series[0]) > 0
        self._update_frequencies = SameTypes(update_frequencies)
        self._renew_collapsing = SameTypes(renew_collapsing)
        self.is_single = is_single
        """Whether forces of tetrahedra are computed in single precision."""
        self._around = np.zeros(LARGEST_STAR, dtype=np.int64)
        n_nodes, n_tetrahedra = len(body.rest), len(body.tetrahedra)
        law = material.law.density(material.moduli)
        if law is not None and averages_shear:
            law = averaged_shear(law)
        room = (n_nodes, n_tetrahedra) if law else (0, 0)
        self._has_springs = material.law.has_springs
        room_for_springs = (n_nodes, 20 * n_nodes + ROOM_FOR_SPRINGS)
        if not self._has_springs:
            room_for_springs = (0, 0)
        self._may_collapse = law is None and resists_collapse
        law_or_none = law or volume_term(0.0)
        slots = room_for_stars(*room)
        retardation_time = float(body.materials.retardation_time.max())
        is_graded_body = law is not None and body.materials.is_even == 0
        solid = no_solid(
            law_or_none,
            *room,
            slots,
            series=_series_of(body.materials, is_graded=is_graded_body),
            is_single=is_single,
            is_graded=is_graded_body,
            retardation_time=retardation_time,
        )
        is_viscous = retardation_time > 0.0 and not self._has_springs
        self.arrays = Elastic.new(
            {"nodes": n_nodes},
            springs=no_springs(*room_for_springs),
            solid=solid,
            viscosity=no_viscosity(solid, is_viscous=is_viscous),
            collapsing=(
                no_collapse(n_nodes, n_tetrahedra, is_needed=True)
                if self._may_collapse
                else no_collapse(0, 0, is_needed=False)
            ),
            has_springs=int(self._has_springs),
            has_tetrahedra=int(law is not None),
            scaling=no_mass_scaling(),
        )
        self._has_solid = law is not None
        n_nodes, n_tetrahedra = body.n_nodes, body.n_tetrahedra
        self._write(body, visits, np.arange(n_tetrahedra), np.arange(n_nodes))
        self._mass_scaling = None if self._has_springs else mass_scaling
        self._limit_frequencies(body)

    def _limit_frequencies(self, body: Body) -> None:
        """Set the limit above which nodes get mass, where they do; none has any yet."""
        if self._mass_scaling is not None:
            scaling = self.arrays.scaling
            scaling.allowed = max(self._mass_scaling**2, self.arrays.highest_of_tetrahedra)
            scaling.allowed_between_cuts = scaling.allowed_where_strained = scaling.allowed
            scaling.most = LARGEST_ADDED_MASS * float(body.masses[: body.n_nodes].sum())

    def take_materials(self, body: Body, visits: Visits) -> None:
        """Write all anew after a change of the materials: masses, moduli and bounds."""
        materials, arrays, solid = body.materials, self.arrays, self.arrays.solid
        if self._has_solid:
            if materials.is_even == 0:
                solid = graded_solid(solid)
            law = {name: float(getattr(materials, name)[0]) for name in (*OF_LAW, *OF_STIFFENING)}
            shares, times = _series_of(materials, is_graded=is_graded(solid))
            solid = solid.replaced(
                law=solid.law if is_graded(solid) else solid.law.replaced(**law),
                retardation_time=float(materials.retardation_time.max()),
                relaxing_shares=shares.ravel(),
                relaxation_times=times.ravel(),
                relaxation_weights=np.zeros(shares.size),
                # A state that was saved before keeps those of then: how much of them is in use is
                # counted in the struct, which is another one from now on.
                around=solid.around.copy(),
                corner=solid.corner.copy(),
            )
        self.arrays = arrays = arrays.replaced(solid=solid, scaling=no_mass_scaling())
        arrays.highest = arrays.highest_of_tetrahedra = arrays.highest_of_dampers = 0.0
        n_nodes = body.n_nodes
        body.added_masses[:n_nodes] = 0.0
        solid.weight[:] = 0.0  # they depend on the masses of before
        self._write(body, visits, np.arange(body.n_tetrahedra), np.arange(n_nodes))
        self._limit_frequencies(body)

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Update masses, springs, elements and bounds after a pass of a cut."""
        body, visits, change, nodes = changed
        if self._relaxes:
            inherit_relaxed(self.arrays.solid, change.children, change.n_children)
        self._write(body, visits, change.dirty[: change.n_dirty], nodes)
        _RETURN_SPIN.call(body, change, nodes, len(nodes))

    def before_cut(self, body: Body) -> None:
        """Note the momentum of added mass before the mesh changes; see `after_cut`."""
        self._count_momentum(body, -1.0)

    def after_cut(self, body: Body) -> None:
        """Count what the momentum of added mass has changed by as the impulse of mass scaling."""
        self._count_momentum(body, 1.0)

    def _count_momentum(self, body: Body, factor: float) -> None:
        scaling = self.arrays.scaling
        if scaling.added != 0.0:  # in most cuts no node has any
            every = self.arrays.solid.every
            _ADD_MOMENTUM.call(body, every, body.n_nodes, factor, scaling.impulse)

    def return_mass(self, body: Body) -> None:
        """Take back mass that nodes got between cuts and do not need at rest."""
        if self.arrays.scaling.allowed < math.inf:
            return_all_mass(self.arrays, body, self.arrays.solid.every)
            self.arrays.scaling.steps = 0

    @property
    def relaxes(self) -> bool:
        """Whether the stress of held tissue relaxes."""
        return self._relaxes

    @property
    def frequency_squared(self) -> float:
        """Bound on the square of every angular frequency so far [1/s2]: it never falls."""
        return self.arrays.highest

    def strained_frequency_squared(self, body: Body, visits: Visits, limit: StepLimit) -> float:
        """Return a bound on w^2 of the tetrahedra as they are deformed now [1/s2].

        It takes a tenth of the time of a Runge-Kutta step. To test only a part of the tetrahedra in
        each frame is not enough: a lip that snaps back from the blade doubles its length in 2 ms.

        Args:
            body: Positions of the nodes.
            visits: For searches.
            limit: It need not be nearer to the truth than the number of steps requires.
        """
        if not self._has_solid:
            return 0.0
        return strained_frequency(self.arrays, body, body.positions, visits, limit, False)

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        arrays, solid, viscosity = self.arrays, self.arrays.solid, self.arrays.viscosity
        if self._has_solid:
            pool = max(len(solid.corner), room_for_stars(n_nodes, n_tetrahedra))
            solid = grown_solid(solid, n_nodes, n_tetrahedra, pool)
            viscosity = grown_viscosity(viscosity, solid)
        collapsing = arrays.collapsing
        if self._may_collapse:
            collapsing = collapsing.grown({"nodes": n_nodes, "tetrahedra": n_tetrahedra})
        springs = arrays.springs
        if self._has_springs:
            springs = springs.grown({"nodes": n_nodes, "pool": len(springs.neighbour)})
        larger = arrays.grown({"nodes": n_nodes})
        self.arrays = larger.replaced(
            collapsing=collapsing, springs=springs, solid=solid, viscosity=viscosity
        )

    def _write(self, body: Body, visits: Visits, tetrahedra: IntArray, nodes: IntArray) -> None:
        n = len(nodes)
        _FORGET_ADDED_MASS.call(self.arrays.scaling, body, nodes, n)
        if self._has_springs:
            self._write_springs(body, visits, nodes)
        if self._has_solid:
            build_tetrahedra(self.arrays.solid, body, tetrahedra, len(tetrahedra))
            self._write_stars(body, visits, nodes)
            write_moduli(self.arrays.solid, body, nodes, n)
            if self._relaxes and averages_shear(self.arrays.solid):
                inherit_at_nodes(self.arrays.solid, nodes, n)
        if not self._has_springs:
            write_masses(body, self.arrays.solid, nodes, n)
        self._update_frequencies.call(self.arrays, body, visits, nodes, n)
        collapsing, highest = self.arrays.collapsing, self.arrays.highest
        self._renew_collapsing.call(collapsing, body, tetrahedra, len(tetrahedra), highest)

    def _write_springs(self, body: Body, visits: Visits, nodes: IntArray) -> None:
        left = nodes
        while True:
            springs = self.arrays.springs
            rows = (body, visits, springs, left, len(left), self._around)
            left = left[_BUILD_ROWS.call(*rows) :]
            if not len(left):
                return
            larger = springs.grown(
                {"nodes": len(springs.first), "pool": 2 * len(springs.neighbour)}
            )
            self.arrays = self.arrays.replaced(springs=larger)

    def _write_stars(self, body: Body, visits: Visits, nodes: IntArray) -> None:
        left = nodes
        while True:
            solid = self.arrays.solid
            left = left[build_stars(solid, body, visits, left, len(left), self._around) :]
            if not len(left):
                return
            larger = grown_solid(
                solid, len(solid.first), len(body.tetrahedra), 2 * len(solid.corner)
            )
            self.arrays = self.arrays.replaced(solid=larger)


def _series_of(materials: MaterialArrays, *, is_graded: bool) -> tuple[FloatArray, FloatArray]:
    """Return the Prony series of all materials, or that of the first where all have the same."""
    shares, times = materials.series
    return (shares, times) if is_graded else (shares[:, :1], times[:, :1])
