"""The laws of tetrahedra: energy per volume, and its constants from the moduli at small strain."""

from tissue.core.structs import Arrays

OWN_SHARE = 0.2
"""Share of the volume term besides springs that acts on each tetrahedron by itself. Where one
tetrahedron folds while its neighbours swell, averaged volumes do not change, and springs resist
little: at 0 some 4 % were inverted in a block at half its height, with this share none; springs
alone fold at 0.8 of the height. Bending locks a little: a bar of four cells deflects 0.68 of
theory, not 0.73."""


SHARE_OF_NODES = 0.7
"""Share of the shear that is averaged around nodes. The shear of each tetrahedron by itself is too
stiff where strain varies within it, in twisting and bending, and that of averages too soft; both
errors fall with the square of the size of the elements. At 0.7 they cancel: the share is that of
the errors, 0.18 against 0.08 in the torsion of a bar of six cells of a block, 0.12 against 0.06 of
five of a lattice. With 1 there are motions that averages hardly see."""


class EnergyDensity(Arrays):
    """Energy per volume at rest: stable neo-Hookean (Smith, de Goes and Kim 2018), or stiffening.

    W = mu/2 (|F|^2 - 3) - mu/2 log(|F|^2 + 1) + lam/2 (J - a)^2
    W = mu/2 w(|F|^2 - 1 - 2 J) + lam/2 (J - a)^2     (`tissue.laws.kernels`)

    It is defined for J <= 0 as well: an inverted tetrahedron recovers. J of the last term is that
    of each tetrahedron, or the average over the tetrahedra around each node (Bonet and Burton
    1998), which does not lock where tissue is nearly incompressible, or a part of the term takes
    each.
    """

    mu: float
    """Shear modulus of the law [Pa], 0 where springs carry the shear."""
    lam_of_tetrahedra: float
    """The part of lam that acts on J of each tetrahedron [Pa]."""
    lam_of_nodes: float
    """The part of lam that acts on J averaged over the tetrahedra around each node [Pa]."""
    shear_of_nodes: float
    """Share of the shear term that takes F averaged over the tetrahedra around each node; that of
    each tetrahedron is left the rest."""
    a: float
    """J at which the last term is 0: 1 + 3 mu / (4 lam), so that the body at rest is at rest."""
    shear_modulus: float
    """Shear modulus at small strain [Pa]."""
    excess: float
    """Amount by which the parts of lam exceed Lame's constant, for the shear term has less [Pa]."""
    exponent: float
    """b of the exponential law; 0 under another law."""
    second: float
    """Ratio c2 of Yeoh's law; 0 under another law."""
    third: float
    """Ratio c3 of Yeoh's law; 0 under another law."""


def neo_hookean(mu: float, lam: float, *, averaged: bool = True) -> EnergyDensity:
    """Return the law with the small-strain moduli `mu` and `lam` (Lame's) [Pa].

    Args:
        mu: Shear modulus.
        lam: Lame's first constant.
        averaged: Whether volume is kept on average around each node, or in each tetrahedron.
    """
    modulus = lam + 5.0 / 6.0 * mu
    a = 1.0 + mu / modulus  # 3/4 of the law's own mu, which is 4/3 of the small-strain one
    own, of_nodes = (0.0, modulus) if averaged else (modulus, 0.0)
    return EnergyDensity(
        mu=4.0 / 3.0 * mu,
        lam_of_tetrahedra=own,
        lam_of_nodes=of_nodes,
        a=a,
        shear_modulus=mu,
        excess=5.0 / 6.0 * mu,
        **_NOT_STIFFENING,
    )


def exponential(mu: float, lam: float, b: float) -> EnergyDensity:
    """Return the exponential law with the small-strain moduli `mu` and `lam` (Lame's) [Pa]."""
    return _stiffening(mu, lam, {"exponent": b, "second": 0.0, "third": 0.0})


def polynomial(mu: float, lam: float, c2: float, c3: float = 0.0) -> EnergyDensity:
    """Return the law w = q + c2 q^2 + c3 q^3 with the small-strain moduli `mu` and `lam` [Pa].

    Args:
        mu: Shear modulus.
        lam: Lame's first constant.
        c2: Ratio of the second to the first coefficient, not negative.
        c3: Ratio of the third to the first coefficient, not negative.
    """
    return _stiffening(mu, lam, {"exponent": 0.0, "second": c2, "third": c3})


def _stiffening(mu: float, lam: float, numbers: dict[str, float]) -> EnergyDensity:
    """Return a law of `tissue.laws.kernels` with these numbers.

    The part of the volume term that the shear term cancels at small strain acts on each
    tetrahedron, as the shear does.
    """
    return EnergyDensity(
        mu=mu,
        lam_of_tetrahedra=mu,
        lam_of_nodes=lam,
        a=1.0,
        shear_modulus=mu,
        excess=mu,
        shear_of_nodes=0.0,
        **numbers,
    )


def volume_term(modulus: float, *, averaged: bool = True) -> EnergyDensity:
    """Return the law that only resists changes of volume, by that modulus [Pa]: besides springs.

    Args:
        modulus: What springs leave to it, lam - mu.
        averaged: Whether all but `OWN_SHARE` of it acts on averaged volumes; if not, none of it.
    """
    own = OWN_SHARE * modulus if averaged else modulus
    return EnergyDensity(
        mu=0.0,
        lam_of_tetrahedra=own,
        lam_of_nodes=modulus - own,
        a=1.0,
        shear_modulus=0.0,
        excess=0.0,
        **_NOT_STIFFENING,
    )


def averaged_shear(law: EnergyDensity, share: float = SHARE_OF_NODES) -> EnergyDensity:
    """Return the law with that share of its shear, and of its own volume term, averaged."""
    moved = share * law.lam_of_tetrahedra
    return law.replaced(
        shear_of_nodes=share,
        lam_of_tetrahedra=law.lam_of_tetrahedra - moved,
        lam_of_nodes=law.lam_of_nodes + moved,
    )


_NOT_STIFFENING = {"shear_of_nodes": 0.0, "exponent": 0.0, "second": 0.0, "third": 0.0}
