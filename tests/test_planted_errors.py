"""The list of planted errors: what it names is there."""

import pytest

from tests.planted_errors import ROOT, planted, read_mutants

MUTANTS = {mutant.name: mutant for mutant in read_mutants()}


@pytest.mark.parametrize("name", MUTANTS)
def test_a_planted_error_replaces_a_text_that_is_in_its_file_once(name):
    mutant = MUTANTS[name]
    source = (ROOT / mutant.file).read_text("utf-8")
    assert planted(mutant, source) != source


def test_no_two_planted_errors_have_one_name():
    assert len(MUTANTS) == len(read_mutants())


def test_an_error_whose_text_is_gone_is_refused():
    mutant = next(iter(MUTANTS.values()))
    with pytest.raises(ValueError, match="0 times"):
        planted(mutant, "")
