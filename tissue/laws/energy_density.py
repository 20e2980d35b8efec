"""The laws of tetrahedra: energy per volume, and its constants from the moduli at small strain."""

from tissue.core.structs import Arrays

NEO_HOOKEAN, EXPONENTIAL, POLYNOMIAL = 0.0, 1.0, 2.0
"""Forms of the shear term, between which `tissue.laws.kernels` branches. A number in a struct of
arrays that does not change is a float."""

OWN_SHARE = 0.2
"""Share of the volume term beside springs that acts on each tetrahedron by itself. Where one
tetrahedron folds while its neighbours swell, averaged volumes do not change, and springs resist
little: at 0 some 4 % were inverted in a block at half its height, with this share none; springs
alone fold at 0.8 of the height. Bending locks a little: a bar of four cells deflects 0.68 of
theory, not 0.73."""


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
    a: float
    """J at which the last term is 0: 1 + 3 mu / (4 lam), so that the body at rest is at rest."""
    shear_modulus: float
    """Shear modulus at small strain [Pa]."""
    excess: float
    """What the parts of lam have more than Lame's constant, for the shear term has less [Pa]."""
    form: float
    """Form of the shear term."""
    first: float
    """First number of the form: b of the exponential, c2 of the polynomial."""
    second: float
    """Second number of the form: c3 of the polynomial."""


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
        form=NEO_HOOKEAN,
        first=0.0,
        second=0.0,
    )


def exponential(mu: float, lam: float, b: float) -> EnergyDensity:
    """Return the exponential law with the small-strain moduli `mu` and `lam` (Lame's) [Pa]."""
    return _stiffening(mu, lam, EXPONENTIAL, b, 0.0)


def polynomial(mu: float, lam: float, c2: float, c3: float = 0.0) -> EnergyDensity:
    """Return the law w = q + c2 q^2 + c3 q^3 with the small-strain moduli `mu` and `lam` [Pa].

    Args:
        mu: Shear modulus.
        lam: Lame's first constant.
        c2: Ratio of the second to the first coefficient, not negative.
        c3: Ratio of the third to the first coefficient, not negative.
    """
    return _stiffening(mu, lam, POLYNOMIAL, c2, c3)


def _stiffening(mu: float, lam: float, form: float, first: float, second: float) -> EnergyDensity:
    """Return a law that stiffens, of a form with these numbers.

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
        form=form,
        first=first,
        second=second,
    )


def volume_term(modulus: float, *, averaged: bool = True) -> EnergyDensity:
    """Return the law that only resists changes of volume, by that modulus [Pa]: beside springs.

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
        form=NEO_HOOKEAN,
        first=0.0,
        second=0.0,
    )
