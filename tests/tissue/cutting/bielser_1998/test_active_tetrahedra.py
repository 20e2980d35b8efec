"""The search along the blade's line, against the pseudocode of section 3 written out in NumPy."""

import itertools

import numpy as np
import pytest

from tests.support import bodies
from tests.tissue.kernels_of import cut_of
from tissue import block
from tissue.cutting.bielser_1998.active_tetrahedra import IN_NONE, Search, detect_along_line
from tissue.cutting.bielser_1998.mesh_records import records_of
from tissue.cutting.bielser_1998.scheme import record_tips
from tissue.cutting.bridging import remember_active
from tissue.mesh.body import CUT

pytestmark = [
    pytest.mark.kernel,
    # The hash of an edge overflows on purpose; with the JIT off NumPy warns of it.
    pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning"),
]

N_SAMPLES = 4
STEP = 0.25e-3
"""Motion in a step [m]: a fortieth of a cell."""
ON_LATTICE = 1e-3
"""Difference of the weights in a face: a step has some 2,000 points of the lattice, a crossing of
the face rarely fewer than 100 of them from its end."""


class Printed:
    """Section 3 to the letter: a list of active tetrahedra, inside tests, edges of the old ones."""

    def __init__(self, mesh, body):
        self.rest, self.tetrahedra = mesh.positions, mesh.tetrahedra
        self.links = body.links[: len(mesh.tetrahedra)]
        self.point, self.active = IN_NONE, set()
        self.cut_edges, self.tips = set(), {}
        self.n_local = self.n_global = 0

    def neighbours(self, t):
        return [link // 4 for link in self.links[t] if link >= 0]

    def weights(self, t, p):
        """Return the barycentric weights of a point in a tetrahedron."""
        corners = np.column_stack([self.rest[self.tetrahedra[t]], np.ones(4)])
        return np.linalg.solve(corners.T, np.append(p, 1.0))

    def inside(self, t, p):
        return self.weights(t, p).min() >= 0.0

    def find_point(self, p):
        """Run `determineNewActivePointTetrahedron`."""
        if self.point != IN_NONE:
            for t in (self.point, *self.neighbours(self.point)):
                if self.inside(t, p):
                    self.n_local += 1
                    return t
        self.n_global += 1
        return next((t for t in range(len(self.tetrahedra)) if self.inside(t, p)), IN_NONE)

    def meets(self, t, a, b):
        """Run the `IntersectionTest` of the line from a to b: clip it by the four faces."""
        at_a, at_b = self.weights(t, a), self.weights(t, b)
        if ((at_a < 0.0) & (at_b < 0.0)).any():
            return False
        with np.errstate(divide="ignore", invalid="ignore"):
            at = at_a / (at_a - at_b)
        enters, leaves = at[at_a < 0.0], at[at_b < 0.0]
        return enters.max(initial=0.0) <= leaves.min(initial=1.0)

    def step(self, before, now):
        """Advance the line by one step; both of shape (2, 3), the point first [m]."""
        old_point, self.point = self.point, self.find_point(now[0])
        if IN_NONE not in (old_point, self.point) and old_point != self.point:
            shared = sorted({*self.tetrahedra[old_point]} & {*self.tetrahedra[self.point]})
            if len(shared) == 3:
                self.tips[tuple(shared)] = self.through_face(shared, before[0], now[0])
        for t in self.active:
            for a, b in itertools.combinations(sorted(self.tetrahedra[t].tolist()), 2):
                if (a, b) not in self.cut_edges and self.is_swept(a, b, before, now):
                    self.cut_edges.add((a, b))
        listed = [self.point] if self.point != IN_NONE else []
        for t in listed:
            for n in self.neighbours(t):
                if n not in listed and self.meets(n, *now):
                    listed.append(n)
        self.active = set(listed)

    def through_face(self, nodes, p, q):
        """Return the weights of the corners of a face where the line pq meets its plane."""
        a, b, c = self.rest[nodes]
        _, u, v = np.linalg.solve(np.column_stack([p - q, b - a, c - a]), p - a)
        return [1.0 - u - v, u, v]

    def is_swept(self, a, b, before, now):
        """Run the `FaceIntersectionTest`: whether the edge meets the swept surface, a plane."""
        p, q = self.rest[a], self.rest[b]
        normal = np.cross(before[1] - before[0], now.mean(axis=0) - before.mean(axis=0))
        if (p - before[0]) @ normal * ((q - before[0]) @ normal) >= 0.0:
            return False
        share = (before[0] - p) @ normal / ((q - p) @ normal)
        at = p + share * (q - p)
        corners = [before[0], now[0], now[1], before[1]]
        turns = [
            np.cross(c - b, at - b) @ normal
            for b, c in zip(corners, np.roll(corners, -1, 0), strict=True)
        ]
        return min(turns) >= 0.0 or max(turns) <= 0.0


class Kernels:
    """The same by the kernels, without splitting."""

    def __init__(self, mesh):
        self.cut = cut_of(mesh, N_SAMPLES)
        self.body = self.cut.body
        self.records, self.search = records_of(self.body), Search.new({}, point=IN_NONE)
        self.cut.path.member[:] = True
        self.cut.path.linked[:-1] = True
        self.cut_edges = set()

    def step(self, before, now, holding=(0, IN_NONE, IN_NONE, IN_NONE)):
        """Advance the line; `holding`: the tetrahedron that each sample holds."""
        path, scratch = self.cut.path, self.cut.scratch
        path.t0[:], path.t1[:] = np.linspace(*before, N_SAMPLES), np.linspace(*now, N_SAMPLES)
        path.seed[:] = holding
        detect_along_line(self.cut, self.search)
        self.cut_edges |= {
            tuple(row) for row in scratch.crossing[: scratch.n_crossings, :2].tolist()
        }
        record_tips(self.cut, self.records, self.search)
        remember_active(self.cut)

    @property
    def active(self):
        return set(self.cut.scratch.active[: self.cut.scratch.n_active].tolist())


def lines(*points):
    """Return the places of a line whose point goes along a polyline, at `STEP` from each other."""
    heel = np.array([0.002, 0.001, 0.035])
    corners = np.array(points)
    tips = [corners[:1]]
    for p, q in itertools.pairwise(corners):
        n = int(np.ceil(np.linalg.norm(q - p) / STEP))
        tips.append(p + np.linspace(0.0, 1.0, n + 1)[1:, None] * (q - p))
    return [np.array([tip, tip + heel]) for tip in np.concatenate(tips)]


MESHES = {
    "grid": block((3, 3, 3), (0.03, 0.03, 0.03)),
    "jittered": bodies.jittered(3, 7, size=0.03),
}
IN, ALONG, OUT = [0.0137, 0.0061, 0.0288], [0.0137, 0.0061, 0.0117], [0.0152, 0.0233, 0.0131]
POINT_FIRST = lines(IN, ALONG, OUT, [0.0152, 0.0233, 0.0288])
"""In through the top, along, and out through the top: as section 6 demands."""


@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
def test_a_stroke_finds_what_the_pseudocode_of_the_paper_finds(mesh):
    kernels = Kernels(mesh)
    printed = Printed(mesh, kernels.body)
    for before, now in itertools.pairwise(POINT_FIRST):
        kernels.step(before, now)
        printed.step(before, now)
        assert kernels.search.point == printed.point
        assert kernels.active == printed.active
    assert kernels.cut_edges == printed.cut_edges
    assert len(printed.cut_edges) > 10
    assert (kernels.search.n_local, kernels.search.n_global) == (printed.n_local, printed.n_global)
    records = kernels.records
    assert len(printed.tips) > 5
    for nodes, weights in printed.tips.items():
        face = np.flatnonzero((records.faces == nodes).all(axis=1))[0]
        np.testing.assert_allclose(records.tip_weights[face], weights, rtol=0.0, atol=ON_LATTICE)


def test_the_whole_body_is_searched_at_the_first_contact_alone():
    """Section 3: "high hit rates" of the search next door, for small steps."""
    kernels = Kernels(MESHES["jittered"])
    for before, now in itertools.pairwise(POINT_FIRST):
        kernels.step(before, now)
    assert kernels.search.n_global == 1
    assert kernels.search.n_local == len(POINT_FIRST) - 2


def test_a_point_that_jumps_is_found_by_the_global_search():
    kernels = Kernels(MESHES["jittered"])
    kernels.step(POINT_FIRST[0], POINT_FIRST[1])
    kernels.step(POINT_FIRST[0], POINT_FIRST[-40])
    assert kernels.search.n_global == 2
    printed = Printed(MESHES["jittered"], kernels.body)
    assert printed.inside(kernels.search.point, POINT_FIRST[-40][0])


def test_a_line_that_enters_side_on_crosses_the_edges_of_the_skin():
    """The paper has no active tetrahedra then."""
    mesh = MESHES["grid"]
    kernels = Kernels(mesh)
    outside, inside = (np.array([[0.0137, y, 0.0117], [0.0137, y, 0.035]]) for y in (-1e-4, 1e-4))
    kernels.step(outside, inside)
    p = mesh.positions
    pairs = {
        pair for t in mesh.tetrahedra.tolist() for pair in itertools.combinations(sorted(t), 2)
    }
    expected = set()
    for a, b in pairs:
        if p[a, 1] == p[b, 1] == 0.0 and (p[a, 0] - 0.0137) * (p[b, 0] - 0.0137) < 0.0:
            share = (0.0137 - p[a, 0]) / (p[b, 0] - p[a, 0])
            if (1.0 - share) * p[a, 2] + share * p[b, 2] > 0.0117:
                expected.add((a, b))
    assert kernels.cut_edges == expected
    assert len(expected) == 4


def test_a_long_step_crosses_the_edges_that_short_ones_cross():
    """The old tetrahedra alone do not have them all."""
    kernels, once = Kernels(MESHES["jittered"]), Kernels(MESHES["jittered"])
    along = lines(ALONG, OUT)
    for before, now in itertools.pairwise(along):
        kernels.step(before, now)
    once.step(along[0], along[-1])
    assert once.cut_edges == kernels.cut_edges
    assert len(once.cut_edges) > 10


def test_a_line_goes_on_behind_an_old_cut_where_the_edge_holds_tissue():
    mesh = MESHES["grid"]
    kernels = Kernels(mesh)
    whole = Kernels(mesh)
    before, now = POINT_FIRST[60], POINT_FIRST[61]
    whole.step(before, now)
    links, middle = kernels.body.links, mesh.positions[mesh.tetrahedra].mean(axis=1)[:, 2]
    for t in range(len(mesh.tetrahedra)):
        for f in range(4):
            other = links[t, f] // 4
            if links[t, f] >= 0 and (middle[t] < 0.02) != (middle[other] < 0.02):
                links[t, f] = CUT
    kernels.step(before, now)
    assert kernels.active == {t for t in whole.active if middle[t] < 0.02} < whole.active
    above = next(iter(whole.active - kernels.active))
    kernels.step(before, now, holding=(0, IN_NONE, above, IN_NONE))
    assert kernels.active == whole.active
