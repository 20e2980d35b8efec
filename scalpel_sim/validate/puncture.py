"""Puncture and withdrawal: rise, peak, drop, plateau; then friction alone."""

from typing import NamedTuple

from scalpel_sim.validate.block import (
    COARSE,
    FINE,
    THICKNESS,
    Record,
    block_tissue,
    lead,
    rubber,
)
from scalpel_sim.validate.findings import (
    Curve,
    Findings,
    Known,
    Line,
    Plot,
    Scene,
    Source,
    within,
)
from scalpel_sim.validate.puncturing import in_and_out
from tissue import BladeShape, Energies

NARROW = 0.001
"""Length of an edge all of which breaks in at once [m]: less than an element's."""
WIDE = 0.02
"""Length of an edge whose faces rub on what it has cut [m]."""
_DEEP, _SPEED = 0.012, 0.05
"""[m], [m/s]."""
_TOUGHNESS = 20.0
"""[J/m2]."""
_FRICTION = 0.2
_NEAR = 0.10
"""How far the peak may be off: the specification's bound."""
DROPS = 0.7
"""How much of the peak the force has 10 ms later at most, where skin is three times as tough as
what is below."""
UNZIPS = Known(
    0.3,
    0.9,
    "an edge wider than an element breaks in from its ends, where the skin is bent most, and not "
    "all at once: the peak is then that of the part that holds, and on a finer mesh lower",
)


class Puncture(NamedTuple):
    """The way in, in figures."""

    record: Record
    peak: float
    """[N]."""
    plateau: float
    """[N], on the second half of the way in."""
    after_peak: float
    """Force 10 steps after the peak [N]."""
    area_before: float
    """Cut until 2 steps before the peak [m2]."""


class Withdrawal(NamedTuple):
    """The way out, from where the blade is loose to where it is nearly out, in figures."""

    back: float
    """Mean force that holds the blade [N]."""
    area: float
    """Cut on the way [m2]."""
    besides: float
    """Work of the blade besides friction, and besides what tissue took up and gave back, over the
    work of friction."""


def stroke(length: float, skin: float, cells: tuple[int, int, int] = FINE) -> Record:
    """Go in and out again, where the skin has `skin` times the toughness of the rest.

    Args:
        length: Of the edge [m].
        skin: Toughness of the skin over that of the rest.
        cells: Of the block.
    """
    material = rubber(
        toughness=_TOUGHNESS, skin_toughness=skin * _TOUGHNESS, blade_friction=_FRICTION
    )
    tissue = block_tissue(material, cells, held="left,right,bottom", blade=BladeShape(), audit=True)
    return lead(tissue, in_and_out(length, _DEEP, _SPEED))


def way_in(record: Record) -> Puncture:
    """Return the figures of the way in."""
    n = len(record.work) // 2
    force = record.force[:, 2]
    peak = int(force[:n].argmax())
    cutting = record.accounts[max(peak - 2, 0), Energies._fields.index("cutting")]
    return Puncture(
        record,
        peak=float(force[peak]),
        plateau=float(force[n // 2 : n].mean()),
        after_peak=float(force[peak + 10]),
        area_before=float(cutting / _TOUGHNESS),
    )


def way_out(record: Record) -> Withdrawal:
    """Return the figures of the way out."""
    n = len(record.work) // 2
    first, last = n + round(0.2 * n), n + round(0.7 * n)
    went = Energies(*(record.accounts[last] - record.accounts[first]))
    stored = went.elastic + went.kinetic + went.held + went.damping
    return Withdrawal(
        back=float(-record.force[first:last, 2].mean()),
        area=float(record.area[-1] - record.area[n - 1]),
        besides=(went.work_of_blade - stored - went.friction) / went.friction,
    )


def judge_in(name: str, found: Puncture, asked: float, known: Known | None = None) -> list[Line]:
    """Return the lines of the way in, where the peak should be `asked` [N]."""
    lines = [
        Line(f"{name}: peak / (toughness of the skin × edge)", found.peak / asked, *within(_NEAR),
             known=known)
    ]  # fmt: skip
    if known is None:
        lines += [
            Line(f"{name}: area cut before the peak", found.area_before * 1e6, 0.0, 0.0, "mm²"),
            Line(f"{name}: plateau / peak", found.plateau / found.peak, 0.0, 0.95),
        ]
    return lines


def judge_out(name: str, found: Withdrawal, plateau: float) -> list[Line]:
    """Return the lines of the way out; `plateau` is the force on the way in [N]."""
    return [
        Line(f"{name}: force that holds it back on its way out", found.back, 1e-6, plateau, "N"),
        Line(f"{name}: area cut on its way out", found.area * 1e6, 0.0, 0.0, "mm²"),
        Line(f"{name}: work besides friction / friction, on its way out", found.besides, -0.1, 0.1),
    ]


def measure(quick: bool) -> Findings:
    """Puncture skins of several toughnesses with a narrow edge, and one with a wide edge."""
    lines: list[Line] = []
    curves = []
    for skin in (3.0,) if quick else (1.5, 2.0, 3.0):
        name = f"edge of {NARROW * 1e3:g} mm, skin × {skin:g}"
        found = way_in(stroke(NARROW, skin))
        lines += judge_in(name, found, skin * _TOUGHNESS * NARROW)
        if skin == 3.0:
            drop = found.after_peak / found.peak
            lines.append(Line(f"{name}: force 10 ms after the peak / peak", drop, 0.0, DROPS))
        curves.append(_curve(name, found.record, NARROW))
    name = f"edge of {WIDE * 1e3:g} mm, skin × 1.5"
    record = stroke(WIDE, 1.5, COARSE if quick else FINE)
    found = way_in(record)
    if not quick:
        lines += judge_in(name, found, 1.5 * _TOUGHNESS * WIDE, known=UNZIPS)
    lines += judge_out(name, way_out(record), found.plateau)
    curves.append(_curve(name, record, WIDE))
    plot = Plot(
        "Puncture and withdrawal",
        "depth of the edge [mm]",
        "force upwards / (toughness × edge)",
        curves,
    )
    return Findings(lines, [plot])


def _curve(name: str, record: Record, length: float) -> Curve:
    depth = (THICKNESS - record.tip[:, 2]) * 1e3
    return Curve(name, depth, record.force[:, 2] / (_TOUGHNESS * length))


SCENE = Scene(
    name="puncture",
    title="Puncture and withdrawal",
    about=(
        "A level edge goes 12 mm into the block from above and out again. The tissue dents "
        "while the force rises; where it reaches the toughness of the skin × the edge, the skin "
        "breaks and the force drops to that of the tissue below and the friction of the faces. On "
        "the way out the force changes its sign, nothing is cut, and the work is that of friction."
    ),
    measure=measure,
    sources=[
        Source(
            "Jiang et al. 2014, J. Biomech. 47:3344",
            "three phases of needle insertion in tissues and a phantom: deformation, insertion, "
            "extraction",
        ),
        Source(
            "Khadem et al. 2016, doi:10.1109/LRA.2016.2528301",
            "puncture, cutting and friction as distinct events of a needle in porcine tissue",
        ),
    ],
)
