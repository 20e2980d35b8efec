"""Laws that stiffen, one of them from outside (docs/extend.md), against the formulas of papers."""

import re
from collections.abc import Iterator
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.support import bodies
from tests.tissue.solids import lame, solid_of
from tissue import LAWS, Material, Moduli
from tissue.laws.energy_density import exponential, polynomial
from tissue.laws.kernels import LARGEST_EXPONENT, exponential_less_one

CUBE = bodies.jittered_grid(2, 1, size=1.0)
MU, LAM = lame(0.49995)

FORMULAS = {
    # -(dW/dI1) / mu of the papers, at I1 - 3
    "exponential": (exponential(MU, LAM, 1.5), lambda i: 0.5 * np.exp(1.5 * i)),
    "yeoh": (
        polynomial(MU, LAM, 0.3, 0.1),
        lambda i: 0.5 * (1.0 + 2.0 * 0.3 * i + 3.0 * 0.1 * i**2),
    ),
}


def pull(solid, stretch, narrowing):
    """Return the force that holds the far end of a cube, and the force on its sides [N]."""
    x = CUBE.positions * [stretch, narrowing, narrowing]
    forces, at = solid.forces(x), CUBE.positions
    return -forces[at[:, 0] > 1.0 - 1e-9, 0].sum(), -forces[at[:, 1] > 1.0 - 1e-9, 1].sum()


@pytest.mark.kernel
@pytest.mark.parametrize("law", FORMULAS)
@pytest.mark.parametrize("stretch", [0.7, 1.3, 2.0])
def test_a_bar_pulled_to_twice_its_length_follows_the_formula_of_the_paper(stretch, law):
    """Incompressible: stress 2 dW/dI1 (l - 1 / l^2). Here Poisson's ratio is 0.49995."""
    density, slope = FORMULAS[law]
    solid = solid_of(CUBE, density)
    narrowing = brentq(lambda s: pull(solid, stretch, s)[1], 0.5, 1.5)
    expected = 2.0 * MU * slope(stretch**2 + 2.0 / stretch - 3.0) * (stretch - stretch**-2)
    assert pull(solid, stretch, narrowing)[0] == pytest.approx(expected, rel=0.01)


@pytest.mark.kernel
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_the_exponential_is_exact_from_the_smallest_to_the_largest_argument(dtype):
    """Within two roundings: each of the five squarings doubles the error of the one before."""
    x = np.array([0.0, 1e-12, 1e-6, 1e-3, 0.1, 1.0, 3.0, LARGEST_EXPONENT], dtype)
    series = getattr(exponential_less_one, "py_func", exponential_less_one)
    np.testing.assert_allclose(series(x), np.expm1(x), rtol=64.0 * np.finfo(dtype).eps)


PAGE = Path(__file__).parents[3] / "docs" / "extend.md"
LINKS = 8.0


@pytest.fixture(scope="module")
def page() -> Iterator[dict[str, Any]]:
    """Run the block that adds the law and cuts a body; return its names, and remove the law."""
    with redirect_stdout(StringIO()) as printed:
        names = run("A law", {})
    yield names | {"printed": printed.getvalue()}
    LAWS.pop(names["ArrudaBoyce"].name)


def run(section: str, names: dict[str, Any]) -> dict[str, Any]:
    """Run the code of a section of the page with these names, and return them."""
    text = PAGE.read_text(encoding="utf-8").split(f"\n## {section}\n")[1].split("\n## ")[0]
    code = re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)[0]
    exec(compile(code, str(PAGE), "exec"), names)
    return names


def series(i1: float) -> float:
    """Return dW/dI1 over m of three terms of the series of Arruda and Boyce."""
    return 1 / 2 + i1 / (10 * LINKS) + 11 * i1**2 / (350 * LINKS**2)


@pytest.mark.parametrize("stretch", [0.7, 1.3, 2.0])
def test_a_bar_of_a_law_of_your_own_follows_the_formula_of_its_paper(page, stretch):
    """Incompressible: stress 2 dW/dI1 (l - 1 / l^2). Here Poisson's ratio is 0.49995."""
    law = page["ArrudaBoyce"](LINKS)
    solid = solid_of(CUBE, law.density(Moduli(MU, LAM, LAM - MU)))

    narrowing = brentq(lambda s: pull(solid, stretch, s)[1], 0.5, 1.5)
    slope = 0.5 * MU * series(stretch**2 + 2.0 / stretch) / series(3.0)
    expected = 2.0 * slope * (stretch - stretch**-2)
    assert pull(solid, stretch, narrowing)[0] == pytest.approx(expected, rel=0.01)


def test_a_body_of_a_law_of_your_own_is_cut_in_two(page):
    area, pieces = re.findall(r"\d+", page["printed"].replace("mm2", ""))
    assert float(area) == pytest.approx(800.0, rel=0.1)
    assert int(pieces) == 2


def test_a_law_of_your_own_is_known_by_its_name_and_keys(page):
    material = Material.of_keys({"law": "arruda_boyce", "links": LINKS})
    assert material == Material(law=page["ArrudaBoyce"](LINKS))
    assert material.as_keys()["links"] == LINKS
    with pytest.raises(ValueError, match=r"links is 8.0 with law yeoh, .* choose law arruda_boyce"):
        Material.of_keys({"law": "yeoh", "yeoh_second": 1.0, "links": LINKS})
