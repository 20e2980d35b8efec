import subprocess
import sys

import pytest

from scalpel_sim import SCENES
from scalpel_sim.scene.materials import material_called
from scalpel_sim.scene.scene import changed
from tissue import Exponential, NeoHookean, Yeoh

GRID2 = SCENES["grid2"]


def test_the_floor_of_the_scene_is_a_height_and_that_of_snapping_a_share():
    scene = changed(GRID2, floor=-0.05, snap=0.1)
    assert scene.world.floor == -0.05
    assert (scene.cut.snap, scene.cut.floor) == (0.1, 0.1)


def test_properties_change_the_material_that_is_given_beside_them():
    liver = material_called("liver")
    scene = changed(GRID2, material=liver, young_modulus=6e3)
    assert scene.material.young_modulus == 6e3
    assert scene.material.poisson_ratio == liver.poisson_ratio


def test_another_law_drops_the_parameters_of_the_law_before():
    liver = changed(SCENES["organ"], material=material_called("liver"))
    assert changed(liver, law="neo_hookean").material.law == NeoHookean()
    assert changed(liver, law="exponential").material.law == Exponential(15.0)
    yeoh = changed(liver, law="yeoh", yeoh_second=2.0).material
    assert yeoh.law == Yeoh(c2=2.0)


def test_what_is_not_given_stays_and_none_is_a_value():
    assert changed(GRID2) == GRID2
    assert changed(changed(GRID2, floor=-0.05), floor=None) == GRID2


@pytest.mark.parametrize("module", ["scalpel_sim.scene.read", "scalpel_sim.cli.app"])
def test_a_list_of_scenes_and_the_help_load_no_compiler_and_no_plots(module):
    program = (
        f"import sys, {module}; "
        "print([name for name in ('numba', 'matplotlib', 'scipy') if name in sys.modules])"
    )
    path = [path for path in sys.path if path]
    code = f"import sys; sys.path[:0] = {path!r}; {program}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
