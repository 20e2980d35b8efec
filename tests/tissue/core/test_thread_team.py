"""Threads share a loop: each of its items is run once, by one of them."""

import threading
import time

import numpy as np
import pytest

from tissue.core.jit import is_compiling, kernel
from tissue.core.thread_team import (
    LOOP_CHUNKS,
    claim_first,
    claim_last,
    end_chunk,
    items_of,
    new_team,
    open_loop,
    pause,
    wait_for_others,
)

pytestmark = pytest.mark.kernel


def opened(n, size):
    """Return a team with an open loop, and how many chunks that has."""
    team = new_team()
    return team, open_loop(team, 0, 0.0, n, size)


@pytest.mark.parametrize(("n", "size"), [(1, 4), (8, 4), (10, 4), (10_000, 4)])
def test_the_chunks_are_all_items_in_order(n, size):
    team, n_chunks = opened(n, size)
    items = [i for chunk in range(n_chunks) for i in range(*items_of(team, chunk))]
    assert items == list(range(n))
    assert n_chunks <= LOOP_CHUNKS


def test_one_thread_claims_from_the_begin_and_the_others_from_the_end():
    team, n_chunks = opened(10, 2)
    assert n_chunks == 5
    assert [claim_first(team), claim_last(team), claim_first(team), claim_last(team)] == [
        0,
        4,
        1,
        3,
    ]
    assert claim_last(team) == 2
    assert claim_first(team) == claim_last(team) == -1


def test_a_loop_without_items_has_no_chunks():
    team, n_chunks = opened(0, 4)
    assert n_chunks == 0
    assert claim_first(team) == -1
    wait_for_others(team, 0)


def test_the_first_thread_may_run_a_loop_that_no_one_else_comes_to():
    team, n_chunks = opened(9, 2)
    assert [claim_first(team) for _ in range(n_chunks)] == list(range(n_chunks))
    wait_for_others(team, 0)


@kernel
def _lead(team, runs, first, n_loops):
    """Run loops over `runs`, from number `first` on; return how many chunks others ran."""
    by_others = 0
    for loop in range(first, first + n_loops):
        left = open_loop(team, loop, 0.0, len(runs), 3)
        chunk = claim_first(team)
        while chunk >= 0:
            begin, end = items_of(team, chunk)
            for i in range(begin, end):
                if runs[i] == loop:  # all items of the loop before were run
                    runs[i] += 1
            left -= 1
            chunk = claim_first(team)
        wait_for_others(team, left)
        by_others += left
    return by_others


@kernel
def _help(team, runs):
    """Take part in these loops, until the team is one of one thread."""
    while team.is_shared == 1:
        chunk = claim_last(team)
        if chunk >= 0:
            begin, end = items_of(team, chunk)
            for i in range(begin, end):
                if runs[i] == team.loop:
                    runs[i] += 1
            end_chunk(team)
        else:
            pause()


@pytest.mark.skipif(not is_compiling(), reason="no atomic operations without the compiler")
@pytest.mark.parametrize("n_others", [1, 3])
def test_threads_run_each_item_of_each_loop_once(n_others):
    n_loops, by_others, team, runs = 0, 0, new_team(), np.zeros(100, np.int64)
    _help(team, runs)
    _lead(team, runs, 0, 0)
    team.is_shared = 1  # both are compiled
    others = [threading.Thread(target=_help, args=(team, runs)) for _ in range(n_others)]
    for other in others:
        other.start()
    until = time.monotonic() + 20.0
    while by_others < 1000 and time.monotonic() < until:
        by_others += _lead(team, runs, n_loops, 1000)
        n_loops += 1000
    team.is_shared = 0
    for other in others:
        other.join()
    assert by_others >= 1000
    assert np.array_equal(runs, np.full(100, n_loops))
