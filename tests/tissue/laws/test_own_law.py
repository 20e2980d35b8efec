"""The law of docs/extend.md, which is added from outside."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from scipy.optimize import brentq

from tests.support import bodies
from tests.tissue.solids import lame, solid_of
from tissue import LAWS, Material, Moduli

PAGE = Path(__file__).parents[3] / "docs" / "extend.md"
CUBE = bodies.jittered_grid(2, 1, size=1.0)
MU, LAM = lame(0.49995)
LINKS = 8.0


@pytest.fixture
def page() -> Iterator[dict[str, Any]]:
    """Run the block that adds the law and cuts a body; return its names, and remove the law."""
    yield (names := run("A law", {}))
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


@pytest.mark.kernel
@pytest.mark.parametrize("stretch", [0.7, 1.3, 2.0])
def test_a_bar_of_a_law_of_your_own_follows_the_formula_of_its_paper(page, stretch):
    """Incompressible: stress 2 dW/dI1 (l - 1 / l^2). Here Poisson's ratio is 0.49995."""
    law = page["ArrudaBoyce"](LINKS)
    solid = solid_of(CUBE, law.density(Moduli(MU, LAM, LAM - MU)))

    def pull(narrowing: float) -> tuple[float, float]:
        forces = solid.forces(CUBE.positions * [stretch, narrowing, narrowing])
        ends = [CUBE.positions[:, axis] > 1.0 - 1e-9 for axis in (0, 1)]
        return tuple(-forces[end, axis].sum() for axis, end in enumerate(ends))

    narrowing = brentq(lambda s: pull(s)[1], 0.5, 1.5)
    slope = 0.5 * MU * series(stretch**2 + 2.0 / stretch) / series(3.0)
    expected = 2.0 * slope * (stretch - stretch**-2)
    assert pull(narrowing)[0] == pytest.approx(expected, rel=0.01)


def test_a_body_of_a_law_of_your_own_is_cut_in_two(capsys, page):
    area, pieces = re.findall(r"\d+", capsys.readouterr().out.replace("mm2", ""))
    assert float(area) == pytest.approx(800.0, rel=0.1)
    assert int(pieces) == 2


def test_a_law_of_your_own_is_known_by_its_name_and_keys(page):
    material = Material.of_keys({"law": "arruda_boyce", "links": LINKS})
    assert material == Material(law=page["ArrudaBoyce"](LINKS))
    assert material.as_keys()["links"] == LINKS
    with pytest.raises(ValueError, match=r"links is 8.0 with law yeoh, .* choose law arruda_boyce"):
        Material.of_keys({"law": "yeoh", "yeoh_second": 1.0, "links": LINKS})
