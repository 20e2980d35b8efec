"""Mesh study: sag and frequencies of a bar against theory, for each law and for finer meshes.

A square bar, 8 times as long as thick, of n cells
through its thickness (Kuhn's six tetrahedra each, or the twelve of a lattice), is clamped at one
end and sags under its own weight. All strains are small, and everything follows from the stiffness
matrix of `tissue.elasticity.stiffness_matrix`, which `tests/system/mechanics/test_mechanics.py`
compares with the forces that the engine computes.
"""

import math
import re
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import eigsh, splu

from benchmarks.timing import TurnWatch
from scalpel_sim.validate.beam import limit
from scalpel_sim.validate.speed.measurements import BenchmarkResult
from scalpel_sim.validate.speed.watch import SILENT
from scalpel_sim.validate.torsion import TORSION_CONSTANT
from tissue import FloatArray, Material, TetrahedralMesh, block, lattice_block
from tissue.elasticity.stiffness_matrix import masses, stiffness_matrix

_PAGE = Path(__file__).parents[2] / "docs" / "mesh_study.md"
"""Page whose table is replaced."""

SLENDERNESS = 8
"""Length over thickness."""

N_MODES = 14
"""Number of modes computed: bending comes in pairs, and the first stretching mode is about the
ninth."""

N_BEAM_ELEMENTS = 400
"""Number of elements of the beam that stands for theory; its frequencies are then right to
1e-5."""

RATIOS = {0.0: "tab:gray", 0.3: "tab:green", 0.45: "tab:blue", 0.49: "tab:purple"}
"""Poisson's ratios of the study, and their colours in the plots."""

ON_LATTICE = (0.0, 0.45)
"""Poisson's ratios that are studied on a lattice as well."""

MODES = ("bending 1", "bending 2", "torsion 1", "stretching 1")


def mesh_study(
    *,
    watch: TurnWatch = SILENT,
    finest: Literal[2, 4, 6, 8] = 8,
    out: Path = Path("docs"),
) -> BenchmarkResult:
    """Compare a clamped bar with theory, for each law and finer meshes: mesh_study.md and .png.

    Args:
        watch: Receives the progress.
        finest: Most cells through the thickness of the bar.
        out: Folder of the page, whose table is replaced, and of the picture.
    """
    counts = [n for n in (1, 2, 4, 6, 8) if n <= finest]
    studied = models()
    watch.begin(len(studied))
    studies = []
    for model in studied:
        studies.append(study(model, counts))
        watch.tick(model.name)
    out.mkdir(parents=True, exist_ok=True)
    page = _PAGE.read_text(encoding="utf-8")
    (out / "mesh_study.md").write_text(page_with(studies, page), encoding="utf-8")
    draw(studies, out / "mesh_study.png")
    lines = [f"{rows[0].model}: sag {[f'{row.sag:.3f}' for row in rows]}" for rows in studies]
    lines.append(f"written: {out / 'mesh_study.md'}, {out / 'mesh_study.png'}")
    return BenchmarkResult([], [], lambda console: console.print("\n".join(lines)))


class Model(NamedTuple):
    """A law that is studied."""

    name: str
    material: Material
    averaged: bool = True
    """Whether dilatation is averaged over nodes, as in the engine."""
    element: str = "plain"
    """Strain of tetrahedra (`SolverSettings.element`)."""
    shape: Callable[..., TetrahedralMesh] = block
    """Division of cells into tetrahedra."""


def models() -> list[Model]:
    """Return the laws that are studied."""
    plain = Material(10e3, 1000.0, law="springs", poisson_ratio=0.25)
    found = [Model("springs, nu 0.25 required", plain)]
    for nu in RATIOS:
        material = Material(10e3, 1000.0, law="neo_hookean", poisson_ratio=nu)
        if nu > 0.0:
            found.append(Model(f"neo-Hookean, nu {nu}, plain", material, averaged=False))
        found.append(Model(f"neo-Hookean, nu {nu}", material))
        if nu in ON_LATTICE:
            found.append(Model(f"neo-Hookean, nu {nu}, lattice", material, shape=lattice_block))
    return found


class Mode(NamedTuple):
    """A natural mode of the bar."""

    kind: str
    """bending, torsion or stretching."""
    frequency: float
    """Natural frequency [Hz]."""
    motion: FloatArray
    """Displacements of the nodes, scaled so that the largest component is 1; shape (n_nodes, 3)."""


class Bar:
    """A clamped bar of n cells through its thickness."""

    def __init__(self, n: int, model: Model, thickness: float = 0.01) -> None:
        self.material = model.material
        self.thickness = thickness
        self.length = SLENDERNESS * thickness
        self.mesh = model.shape((SLENDERNESS * n, n, n), (self.length, thickness, thickness))
        x = self.mesh.positions[:, 0]
        self.is_end = x > self.length * (1.0 - 1e-9)
        self.is_free = np.repeat(x > 1e-9 * self.length, 3)
        self.masses = masses(self.mesh, self.material.density)
        matrix = stiffness_matrix(
            self.mesh, self.material, averaged=model.averaged, element=model.element
        )
        self.stiffness = matrix[self.is_free][:, self.is_free].tocsc()

    @cached_property
    def _factors(self) -> splu:
        return splu(self.stiffness)

    def deflection(self, forces: FloatArray) -> float:
        """Return how far the free end sinks under small forces on the nodes [m]."""
        motion = np.zeros(self.is_free.size)
        motion[self.is_free] = self._factors.solve(forces.ravel()[self.is_free])
        return -float(motion.reshape(-1, 3)[self.is_end, 2].mean())

    def sag_ratio(self) -> float:
        """Return the sag under the bar's own weight over Timoshenko's."""
        weight = np.zeros((len(self.masses), 3))
        weight[:, 2] = -self.masses * 1e-3  # an acceleration so small that strains are small
        per_length = 1e-3 * self.material.density * self.thickness**2
        bent = per_length * self.length**4 / (8.0 * self.bending_stiffness)
        sheared = per_length * self.length**2 / (2.0 * self.shear_stiffness)
        return self.deflection(weight) / (bent + sheared)

    def end_load_ratio(self) -> float:
        """Return the deflection under a force at the end over Timoshenko's."""
        forces = np.zeros((len(self.masses), 3))
        forces[self.is_end, 2] = -1e-6 / self.is_end.sum()
        bent = 1e-6 * self.length**3 / (3.0 * self.bending_stiffness)
        return self.deflection(forces) / (bent + 1e-6 * self.length / self.shear_stiffness)

    @cached_property
    def modes(self) -> list[Mode]:
        """The lowest modes, in order of frequency."""
        root = diags_array(1.0 / np.sqrt(np.repeat(self.masses, 3)[self.is_free]))
        squares, vectors = _lowest(root @ self.stiffness @ root, N_MODES)
        found = []
        for square, vector in zip(squares, vectors.T, strict=True):
            flat = np.zeros(self.is_free.size)
            flat[self.is_free] = root @ vector
            motion = flat.reshape(-1, 3) / np.abs(flat).max()
            found.append(Mode(self._kind(motion), math.sqrt(square) / (2.0 * math.pi), motion))
        return found

    def frequencies(self) -> dict[str, float]:
        """Return the frequencies of `MODES` [Hz]."""

        def of_kind(kind: str) -> list[float]:
            return [mode.frequency for mode in self.modes if mode.kind == kind]

        # Bending in y and in z are a pair, which a mesh with diagonals splits.
        first, second = np.reshape(of_kind("bending")[:4], (2, 2)).mean(axis=1)
        values = (first, second, of_kind("torsion")[0], of_kind("stretching")[0])
        return dict(zip(MODES, map(float, values), strict=True))

    def _kind(self, motion: FloatArray) -> str:
        """Return the simple motion with the largest share of the momentum squared of a mode."""
        x, y, z = self.mesh.positions.T
        arm = np.stack([y - y.mean(), z - z.mean()])
        polar = np.hypot(*arm)
        twist = (motion[:, 2] * arm[0] - motion[:, 1] * arm[1]) / np.maximum(polar, 1e-12)
        section = np.unique(np.round(x / self.length, 9), return_inverse=True)[1].ravel()
        weight = np.bincount(section, weights=self.masses)

        def rigid_share(values: FloatArray) -> float:
            mean = np.bincount(section, weights=self.masses * values) / weight
            return float((weight * mean**2).sum())

        shares = {
            "stretching": rigid_share(motion[:, 0]),
            "torsion": rigid_share(twist),
            "bending": rigid_share(motion[:, 1]) + rigid_share(motion[:, 2]),
        }
        return max(shares, key=lambda kind: shares[kind])

    @property
    def shear_stiffness(self) -> float:
        """Timoshenko's k G A [N], with Cowper's coefficient for a rectangle."""
        nu = self.material.poisson_ratio
        cowper = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu)
        return cowper * self.material.mu * self.thickness**2

    @property
    def bending_stiffness(self) -> float:
        """E I [N m2]."""
        return self.material.young_modulus * self.thickness**4 / 12.0

    def theory(self) -> dict[str, float]:
        """Return the frequencies of `MODES` by theory [Hz]: Timoshenko, Saint-Venant, rod."""
        bending = self._timoshenko()
        density = self.material.density
        polar = 6.0 * TORSION_CONSTANT  # J over the polar moment a^4 / 6
        speeds = (self.material.mu * polar / density, self.material.young_modulus / density)
        torsion, stretching = (math.sqrt(square) / (4.0 * self.length) for square in speeds)
        return dict(zip(MODES, (*bending, torsion, stretching), strict=True))

    def euler_bernoulli(self) -> float:
        """Return the first bending frequency of a beam without shear [Hz]."""
        per_length = self.material.density * self.thickness**2
        root = math.sqrt(self.bending_stiffness / (per_length * self.length**4))
        return 1.8751041**2 * root / (2.0 * math.pi)

    def _timoshenko(self) -> tuple[float, float]:
        """Return the first two bending frequencies [Hz] of a beam of many linear elements."""
        n, h = N_BEAM_ELEMENTS, self.length / N_BEAM_ELEMENTS
        turn = np.array([0.0, -1.0, 0.0, 1.0]) / h
        shear = np.array([-1.0 / h, -0.5, 1.0 / h, -0.5])  # one point: a line does not lock
        element = h * self.bending_stiffness * np.outer(turn, turn)
        element += h * self.shear_stiffness * np.outer(shear, shear)
        dofs = 2 * np.arange(n)[:, None] + np.arange(4)
        where = (np.repeat(dofs, 4, axis=1).ravel(), np.tile(dofs, (1, 4)).ravel())
        stiffness = csr_array((np.tile(element.ravel(), n), where))
        per_length = self.material.density * self.thickness**2
        lumped = 0.5 * h * per_length * np.array([1.0, self.thickness**2 / 12.0] * 2)
        mass = np.bincount(dofs.ravel(), weights=np.tile(lumped, n))
        root = diags_array(1.0 / np.sqrt(mass[2:]))
        squares = _lowest(root @ stiffness[2:, 2:] @ root, 2)[0]
        first, second = np.sqrt(squares) / (2.0 * math.pi)
        return float(first), float(second)


def _lowest(matrix: csr_array, n: int) -> tuple[FloatArray, FloatArray]:
    """Return the lowest eigenvalues of a matrix in order, and their vectors."""
    start = np.ones(matrix.shape[0])  # a fixed start; the default is random
    values, vectors = eigsh(matrix.tocsc(), k=n, sigma=0.0, v0=start)
    order = np.argsort(values)
    return values[order], vectors[:, order]


class Row(NamedTuple):
    """The results of one law on one mesh, each over its theoretical value."""

    model: str
    n: int
    n_tetrahedra: int
    sag: float
    frequencies: dict[str, float]


def study(model: Model, counts: Sequence[int]) -> list[Row]:
    """Return the rows of one law, from the coarsest mesh to the finest."""
    rows = []
    for n in counts:
        bar = Bar(n, model)
        theory = bar.theory()
        ratios = {mode: found / theory[mode] for mode, found in bar.frequencies().items()}
        rows.append(Row(model.name, n, len(bar.mesh.tetrahedra), bar.sag_ratio(), ratios))
    return rows


def page_with(studies: Sequence[Sequence[Row]], page: str) -> str:
    """Return a page of Markdown with the rows of its table replaced."""
    text_rows = []
    for rows in studies:
        for row in rows:
            ratios = [row.sag, *(row.frequencies[mode] for mode in MODES)]
            text_rows.append(_text_row(row.model, f"{row.n}", f"{row.n_tetrahedra:,}", ratios))
        coarse, fine = rows[-2:]
        pairs = [(coarse.sag, fine.sag)]
        pairs += [(coarse.frequencies[mode], fine.frequencies[mode]) for mode in MODES]
        limits = [limit(a, b, fine.n / coarse.n) for a, b in pairs]
        text_rows.append(_text_row(rows[0].model, "limit", "", limits))
    return re.sub(r"(?<=-\|\n)(\| .*\n)+", "\n".join(text_rows) + "\n", page)


def _text_row(model: str, n: str, n_tetrahedra: str, ratios: Sequence[float]) -> str:
    return f"| {model} | {n} | {n_tetrahedra} | " + " | ".join(f"{x:.3f}" for x in ratios) + " |"


def draw(studies: Sequence[Sequence[Row]], path: Path) -> None:
    """Draw sag and first bending frequency over the number of cells."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(11.0, 4.6), layout="constrained")
    for rows in studies:
        model = rows[0].model
        of_ratio = [colour for nu, colour in RATIOS.items() if f"nu {nu}" in model.split(",")[1]]
        style = {
            "ls": ":" if "plain" in model else "--" if "lattice" in model else "-",
            "marker": "o",
            "ms": 4,
            "label": model,
            "color": of_ratio[0] if "neo" in model else "tab:orange",
        }
        counts = [row.n for row in rows]
        axes[0].plot(counts, [row.sag for row in rows], **style)
        axes[1].plot(counts, [row.frequencies[MODES[0]] for row in rows], **style)
    titles = ("sag under its own weight / theory", "first bending frequency / theory")
    for axis, title in zip(axes, titles, strict=True):
        axis.axhline(1.0, color="black", lw=0.8)
        axis.set_xscale("log", base=2)
        axis.set_xticks([row.n for row in studies[0]])
        axis.set_xticklabels([str(row.n) for row in studies[0]])
        axis.set_xlabel("cells through the thickness")
        axis.set_title(title)
        axis.grid(alpha=0.3)
    axes[1].set_yscale("log")
    axes[1].set_yticks([1, 1.2, 1.5, 2, 3, 5])
    axes[1].set_yticklabels(["1", "1.2", "1.5", "2", "3", "5"])
    axes[1].minorticks_off()
    axes[1].legend(fontsize=8)
    figure.savefig(path, dpi=110)
    plt.close(figure)
