"""A state that is loaded gives the same bits from there on, as if nothing had happened since."""

import hashlib
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest

from tests.support import bodies, strokes
from tissue import (
    BladeShape,
    BladeSweep,
    Geom,
    Material,
    SolverSettings,
    StateError,
    Tissue,
    TissueState,
)
from tissue.core.memento import Memento
from tissue.core.memory_blocks import (
    ADDRESS,
    HAS_REST,
    SPAN_LENGTH,
    measure_memory,
    memory_of,
    words_at,
)
from tissue.state import identity
from tissue.state.tissue_state import RULES

MESH = bodies.jittered(4, 0)
STROKE = list(strokes.sweeps(strokes.THROUGH["slanted"](MESH)))
MIDDLE = len(STROKE) // 2
N_AFTER = 50
INSTANTS = (0, 1, *range(40, len(STROKE) - 2, 80), len(STROKE) - 2)
"""Frames before which a state is saved: the blade comes, touches, cuts, and has left."""
BLADE = BladeShape()
SPRINGS = Material(law="springs", poisson_ratio=0.25)


def nothing(tissue: Tissue) -> None:
    """Hold nothing."""


class Case(NamedTuple):
    """A body, and what acts on it."""

    solver: SolverSettings = SolverSettings(audit=True)
    material: Material = Material()
    floor: float | None = None
    blade: BladeShape | None = BLADE
    drive: Callable[[Tissue], None] = nothing

    def make(self) -> Tissue:
        tissue = Tissue(
            MESH,
            self.material,
            fixed=bodies.sides(MESH),
            floor=self.floor,
            blade=self.blade,
            solver=self.solver,
        )
        self.drive(tissue)
        return tissue


def hold(tissue: Tissue) -> None:
    """Push it, pull it by an attachment, and tie it by fibres that the blade meets."""
    tissue.push([MESH.positions.mean(axis=0)], (0.0, 0.0, 0.05))
    high = MESH.positions[:, 2].max()
    nodes = np.flatnonzero(MESH.positions[:, 2] > high - 1e-6)[:6]
    grip = tissue.attach(nodes, stiffness=50.0, damping=0.1)
    grip.move(MESH.positions[nodes].mean(axis=0) + np.array([0.0, 0.0, 1e-3]))
    above = MESH.positions[nodes].mean(axis=0) + np.array([0.0, 0.0, 0.02])
    tissue.tie(nodes, above, stiffness=10.0, area=1e-6, toughness=100.0)


def touch(tissue: Tissue) -> None:
    """Press a ball on it from above."""
    top = MESH.positions.max(axis=0)
    middle = np.array([*MESH.positions.mean(axis=0)[:2], top[2] + 0.0101])
    tissue.collide_with([Geom("ball", "sphere", (0.01,), 0.3)], [middle]).move(
        [middle - [0.0, 0.0, 5e-4]]
    )


def shift(tissue: Tissue) -> None:
    """Move its supports."""
    tissue.move_supports(np.flatnonzero(bodies.sides(MESH)), (0.0, 0.0, 5e-3))


CASES = {
    "global": Case(),
    "global in stages": Case(SolverSettings(relaxation="global"), SPRINGS),
    "single precision": Case(SolverSettings(precision="single")),
    "two threads": Case(SolverSettings(threads=2)),
    "verlet": Case(SolverSettings(relaxation="verlet", audit=True)),
    "hierarchical": Case(SolverSettings(relaxation="hierarchical"), SPRINGS),
    "floor": Case(floor=float(MESH.positions[:, 2].min())),
    "springs": Case(material=SPRINGS),
    "stiffening": Case(material=Material(law="exponential", stiffening=5.0)),
    "prony": Case(material=Material(prony=((0.3, 0.02), (0.2, 0.1)))),
    "paper": Case(SolverSettings(scheme="paper", relaxation="hierarchical"), SPRINGS, blade=None),
    "line": Case(blade=None),
    "held": Case(drive=hold),
    "touched": Case(drive=touch),
    "moved": Case(drive=shift),
}

LINES = {
    "line, stiffening": Case(material=Material(law="yeoh", yeoh_second=1.0), blade=None),
    "line, verlet": Case(SolverSettings(relaxation="verlet"), blade=None),
    "line, hierarchical": Case(SolverSettings(relaxation="hierarchical"), SPRINGS, blade=None),
    "line, single precision": Case(SolverSettings(precision="single"), blade=None),
    "line, moved": Case(blade=None, drive=shift),
    "line, held": Case(blade=None, drive=hold),
    "line, touched": Case(blade=None, drive=touch),
    "line, settled": Case(blade=None, drive=Tissue.settle),
}
"""More of a line that cuts."""


def step(tissue: Tissue, sweeps: list[BladeSweep]) -> str:
    """Do some frames; return a hash of all that can be seen of the body and of each frame."""
    digest = hashlib.sha256()
    for sweep in sweeps:
        result = tissue.step(sweep, strokes.DT)
        digest.update(np.concatenate([*result.wrench, result.force_on_tissue]).tobytes())
        seen = (result.cut_area, result.work_of_blade, result.work_of_cutting, result.n_substeps)
        digest.update(repr((seen, result.energies)).encode())
        digest.update(b"".join(np.ascontiguousarray(each).tobytes() for each in result.contacts))
    for array in (*tissue.snapshot(), *tissue.surface(), tissue.support_forces()):
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(repr([each.wrench.numbers for each in tissue.attachments]).encode())
    return digest.hexdigest()


AFTER = STROKE[MIDDLE : MIDDLE + N_AFTER]


def in_mid_cut(case: Case) -> Tissue:
    tissue = case.make()
    result = [tissue.step(sweep, strokes.DT) for sweep in STROKE[:MIDDLE]][-1]
    assert result.cut_area > 0.0
    return tissue


@pytest.fixture(scope="module", params=CASES)
def saved(request):
    """Return a body that has gone on from a state, the state, and the hash of what followed."""
    case = CASES[request.param]
    tissue = in_mid_cut(case)
    state, n = tissue.save_state(), tissue.n_tetrahedra
    expected = step(tissue, AFTER)
    assert tissue.n_tetrahedra > n  # the mesh has changed since
    return case, tissue, state, expected


@pytest.mark.parametrize("case", [*CASES.values(), *LINES.values()], ids=[*CASES, *LINES])
def test_from_each_instant_to_each_earlier_one_the_same_frames_follow(case):
    """Those of the body that was never put back: before contact, in it, mid-cut, at the end."""
    tissue, states, frames = case.make(), {}, {}
    for i in range(len(STROKE)):
        if i in INSTANTS:
            states[i] = tissue.save_state()
        if i in INSTANTS or i - 1 in INSTANTS:
            frames[i] = step(tissue, STROKE[i : i + 1])
        else:
            tissue.step(STROKE[i], strokes.DT)
    for later in reversed(INSTANTS):
        for earlier in (each for each in INSTANTS if each <= later):
            for instant, n_frames in ((later, 1), (earlier, 2)):
                tissue.load_state(states[instant])
                for i in range(instant, instant + n_frames):
                    assert step(tissue, STROKE[i : i + 1]) == frames[i], (later, earlier, i)


def test_a_tissue_made_alike_goes_on_from_the_bytes_of_a_state(saved):
    case, _, state, expected = saved
    other = case.make()
    other.load_state(TissueState.from_bytes(state.to_bytes()))
    assert step(other, AFTER) == expected


def test_saving_changes_nothing():
    saving, other = (in_mid_cut(Case()) for _ in range(2))
    for sweep in AFTER:
        saving.save_state()
        assert step(saving, [sweep]) == step(other, [sweep])


def test_a_change_of_the_mesh_applies_to_a_body_put_back_to_before_another():
    """A state before one cut is loaded after it; then another cut is made, as in a whole body."""
    low, high = MESH.positions.min(axis=0) - 0.01, MESH.positions.max(axis=0) + 0.01

    def cut(tissue, axis):
        middle = MESH.positions.mean(axis=0)
        edges = np.stack([np.stack([low, low]), np.stack([high, high])])
        edges[:, :, axis] = middle[axis] + 1e-3  # the plane of the cut
        across = (axis + 1) % 3
        edges[:, 0, across], edges[:, 1, across] = low[across], high[across]
        forward = np.zeros(3)
        forward[(axis + 2) % 3] = 1.0
        tissue.incise(edges, forward)

    whole, put_back = Case().make(), Case().make()
    state = put_back.save_state()
    cut(put_back, 0)
    assert put_back.n_pieces() == 2
    put_back.load_state(state)
    assert put_back.n_pieces() == 1
    cut(put_back, 1)
    cut(whole, 1)
    assert whole.n_pieces() == 2
    assert step(put_back, AFTER[:5]) == step(whole, AFTER[:5])


def test_a_state_is_loaded_from_before_arrays_have_grown():
    tissue = in_mid_cut(Case())
    state, body = tissue.save_state(), tissue._body
    expected = step(tissue, AFTER)
    tissue.load_state(state)
    body.n_nodes, n_nodes = len(body.rest), body.n_nodes  # they appear full
    tissue._stages.make_room()
    tissue._body.n_nodes = n_nodes
    assert len(tissue._body.rest) > len(body.rest)
    assert step(tissue, AFTER) == expected
    tissue.load_state(state)
    assert step(tissue, AFTER) == expected


def test_what_was_made_after_a_state_does_not_act_once_it_is_loaded():
    tissue = Case().make()
    state = tissue.save_state()
    grip = tissue.attach([MESH.positions.mean(axis=0)], stiffness=10.0)
    load = tissue.push([MESH.positions.mean(axis=0)], (0.0, 0.0, 1.0))
    tissue.load_state(state)
    assert tissue.attachments == () and grip.n_points == 0
    with pytest.raises(ValueError, match="does not act"):
        tissue.release(load)


def test_what_was_released_after_a_state_acts_again_once_it_is_loaded():
    tissue = Case().make()
    grip = tissue.attach([MESH.positions.mean(axis=0)], stiffness=10.0)
    state = tissue.save_state()
    tissue.release(grip)
    assert grip.n_points == 0
    tissue.load_state(state)
    assert tissue.attachments == (grip,) and grip.n_points == 1


def test_attachments_of_a_state_from_elsewhere_are_those_of_the_same_number():
    """Of two the first was released before the state was saved."""
    at = [MESH.positions.mean(axis=0)]
    one, other = Case().make(), Case().make()
    first, _ = (one.attach(at, stiffness=k) for k in (10.0, 20.0))
    here = [other.attach(at, stiffness=k) for k in (10.0, 20.0)]
    one.release(first)
    other.load_state(TissueState.from_bytes(one.save_state().to_bytes()))
    assert other.attachments == (here[1],)
    assert [each.n_points for each in here] == [0, 1]


OTHERS = {
    "of other settings: material.toughness is 20.0 there and 30.0 here": Case(
        material=Material(toughness=30.0)
    ),
    "of other settings: floor is None there": Case(floor=float(MESH.positions[:, 2].min())),
    "of other settings: solver.relaxation is 'global' there and 'verlet' here": Case(
        SolverSettings(relaxation="verlet", audit=True)
    ),
}


@pytest.mark.parametrize("says", OTHERS)
def test_a_state_of_other_settings_is_refused(says):
    with pytest.raises(StateError, match=says):
        OTHERS[says].make().load_state(Case().make().save_state())


def test_the_number_of_threads_may_differ():
    one, two = (Case(SolverSettings(threads=n)).make() for n in (1, 2))
    two.load_state(one.save_state())
    assert step(two, STROKE[:5]) == step(one, STROKE[:5])


def test_a_state_of_another_body_is_refused():
    larger = Tissue(bodies.jittered(5, 0))
    with pytest.raises(StateError, match=rf"had {larger.n_nodes} nodes .* and this one"):
        Case().make().load_state(larger.save_state())


def test_a_state_of_another_version_is_refused(monkeypatch):
    tissue = Case().make()
    with monkeypatch.context() as patch:
        patch.setattr(identity, "STATE_FORMAT", identity.STATE_FORMAT + 1)
        newer = Case().make().save_state().to_bytes()
    with pytest.raises(StateError, match=r"saved by version .* load it with the version"):
        tissue.load_state(TissueState.from_bytes(newer))


def test_bytes_that_are_damaged_or_of_which_the_end_is_missing_are_refused():
    data = Case().make().save_state().to_bytes()
    damaged = bytearray(data)
    damaged[len(data) // 2] ^= 1
    for wrong in (bytes(damaged), *(data[: int(share * len(data))] for share in (0.0, 0.3, 0.999))):
        with pytest.raises(StateError, match="missing or damaged"):
            TissueState.from_bytes(wrong)


def test_a_state_that_is_refused_leaves_the_body_as_it_was():
    tissue, other = in_mid_cut(Case()), in_mid_cut(Case())
    with pytest.raises(StateError):
        tissue.load_state(in_mid_cut(Case(SolverSettings())).save_state())
    assert step(tissue, AFTER[:5]) == step(other, AFTER[:5])


def test_memory_that_is_not_saved_holds_what_it_was_made_with(saved):
    """So that rows in use can be taken back by writing that value again."""
    _, tissue, _, _ = saved
    memory = memory_of(Memento(tissue, RULES).structs, RULES.structs)
    in_use, rest = np.zeros((2, len(memory.spans)), np.int64)
    measure_memory(memory.spans, in_use, rest)
    for span, n, value in zip(memory.spans, in_use, rest, strict=True):
        if span[HAS_REST]:
            behind = words_at(span[ADDRESS], span[SPAN_LENGTH])[n:]
            assert (behind == value).all()


def test_structs_of_a_tissue_share_no_memory(saved):
    """A state from elsewhere gives each struct arrays of its own."""
    _, tissue, _, _ = saved
    spans = []
    for struct in Memento(tissue, RULES).structs:
        arrays = [getattr(struct, name) for name in type(struct).__annotations__]
        arrays = [each for each in arrays if isinstance(each, np.ndarray) and each.nbytes]
        if arrays:
            spans += [(each.ctypes.data, each.nbytes, id(struct)) for each in arrays]
    spans.sort()
    for (address, n_bytes, of), (following, _, other) in pairwise(spans):
        assert of == other or address + n_bytes <= following
