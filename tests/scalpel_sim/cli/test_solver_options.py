"""Options of the solver on the command line: what they make of a scene."""

import pytest

from scalpel_sim.cli.options import ArmOptions, SolverOptions, TissueOptions
from scalpel_sim.cli.run_setup import RunOptions, prepared_run
from scalpel_sim.cli.scene_options import chosen_scene
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.runs.options import ClientOptions, OutputOptions, PrintOptions
from tissue import SolverSettings


def options(out, **solver):
    """Return the options of a run with these of the solver."""
    tissue = TissueOptions(solver=SolverOptions(**solver))
    printing = PrintOptions(quiet=True)
    return RunOptions(tissue, ArmOptions(), ClientOptions(), OutputOptions(out=out), printing)


@pytest.mark.parametrize(
    ("asked", "expected"), [(None, SolverSettings().mass_scaling), (0.0, None), (3e3, 3e3)]
)
def test_mass_scaling_of_zero_is_none_and_without_the_option_it_is_the_default(asked, expected):
    scene = chosen_scene("grid2", TissueOptions(solver=SolverOptions(mass_scaling=asked)))
    assert make_tissue(scene).solver.mass_scaling == expected


@pytest.mark.parametrize(
    ("asked", "expected"),
    [({}, "verlet"), ({"relaxation": "hierarchical"}, "hierarchical"), ({"threads": 2}, "verlet")],
    ids=str,
)
def test_a_command_may_have_another_relaxation_where_none_is_asked_for(tmp_path, asked, expected):
    """As `view` has, on any number of threads."""
    run = prepared_run("grid2", options(tmp_path, **asked), relaxation="verlet")
    with run as prepared:
        assert prepared.settings["relaxation"] == expected


@pytest.mark.parametrize(("relaxation", "is_audited"), [("verlet", True), ("hierarchical", False)])
def test_a_run_keeps_an_account_where_one_can_be_kept(tmp_path, relaxation, is_audited):
    asked = options(tmp_path, relaxation=relaxation)
    with prepared_run("grid2", asked, audits=True) as prepared:
        assert prepared.settings["audit"] == is_audited
