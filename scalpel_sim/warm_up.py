"""Runs every kernel once, so that it is compiled; as a program, only those that move a body."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from scalpel_sim.output.force_parts import force_parts
from tissue import (
    BladeSegment,
    BladeShape,
    BladeSweep,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    block,
    cache_directory,
    fixed_nodes,
)

_SIDE = 0.02
"""Length of the sides of the block that is cut [m]."""
N_STEPS = 20
_DT = 1e-3


def kernels_are_compiled() -> bool:
    """Return whether the cache has binaries of exactly these sources."""
    return any(cache_directory().rglob("*.nbi"))


def warm_up() -> None:
    """Load the kernels, or compile them where this is the first run of these sources.

    A small block is settled, cut half through and measured, which calls every kernel of a run.
    """
    mesh = block((2, 2, 2), (_SIDE, _SIDE, _SIDE))
    if not kernels_are_compiled():
        with _compile_motion_in_parallel():
            places = [(edge.tip, edge.heel) for edge in map(_edge, (-0.1, 0.2, 0.6))]
            Tissue(mesh, blade=BladeShape()).incise(places, _edge(0.0).forward)
    tissue = Tissue(
        mesh,
        fixed=fixed_nodes(mesh, "left,right"),
        blade=BladeShape(),
        solver=SolverSettings(audit=True),
    )
    tissue.settle()
    before = _edge(-0.1)
    for fraction in np.linspace(-0.1, 0.6, N_STEPS):
        after = _edge(fraction)
        result = tissue.step(BladeSweep(before, after), _DT)
        before = after
    force_parts(result.contacts, before.forward)
    tissue.step(None, _DT)
    tissue.surface()
    tissue.snapshot()
    tissue.n_pieces()
    tissue.cut_report()
    move_two_pieces()


def move_two_pieces() -> None:
    """Advance two falling pieces, which may touch, by a step: forces, integration and contact."""
    mesh = block((2, 2, 2), (_SIDE, _SIDE, _SIDE))
    apart = np.vstack([mesh.positions, mesh.positions + 2.0 * _SIDE])
    both = np.vstack([mesh.tetrahedra, mesh.tetrahedra + len(mesh.positions)])
    Tissue(TetrahedralMesh(apart, both)).step(None, _DT)


@contextmanager
def _compile_motion_in_parallel() -> Iterator[None]:
    """Compile the kernels that move a body in another process: on two cores 50 s in place of 73.

    The cache passes on the binaries. If that fails, they are compiled in this process.
    """
    other = subprocess.Popen(
        [sys.executable, "-m", "scalpel_sim.warm_up"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
        other.wait()
    finally:
        other.kill()
        other.wait()


def _edge(fraction: float) -> BladeSegment:
    """Return an upright edge in the block's middle, `fraction` of the way from front to back."""
    x, y = _SIDE / 2.0, fraction * _SIDE
    return BladeSegment(
        tip=np.array([x, y, -_SIDE]),
        heel=np.array([x, y, 2.0 * _SIDE]),
        forward=np.array([0.0, 1.0, 0.0]),
    )


if __name__ == "__main__":
    move_two_pieces()
