"""A stage clock adds up the time of the blocks of each stage."""

from time import perf_counter, sleep

from tissue.core.stage_clock import StageClock


def test_a_stage_sums_its_blocks_and_the_others_stay_at_zero():
    clock = StageClock()
    started = perf_counter()
    for _ in range(2):
        with clock.RX:
            sleep(0.002)
    assert 0.004 <= clock.RX.seconds <= perf_counter() - started
    assert clock.CD.seconds == clock.GC.seconds == 0.0


def test_a_block_that_raises_counts_too():
    clock = StageClock()
    try:
        with clock.GC:
            sleep(0.002)
            raise ValueError
    except ValueError:
        pass
    assert clock.GC.seconds >= 0.002
