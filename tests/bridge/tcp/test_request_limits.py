"""A request that would take too long is refused, with what is allowed, before anything moves."""

import contextlib
import re
import time

import numpy as np
import pytest

from bridge import LinkError
from bridge.driven import FrameAttachment, FramePose, GeomPoses
from tests.bridge.bits import bits
from tests.bridge.tcp.bare_sockets import DT, link_once_free
from tissue import BladeSweep, Geom

NODE_SIZE = 5.609e-3
FARTHEST = 100.0 * NODE_SIZE


@pytest.fixture
def link(server):
    with contextlib.closing(link_once_free(server.address)) as link:
        yield link


def expect_refusal(link, message, *step):
    """Expect that a step is refused at once, and that nothing has moved."""
    before, begun = bits(link.snapshot()), time.monotonic()
    with pytest.raises(LinkError, match=message):
        link.step(*step)
    assert time.monotonic() - begun < 1.0
    assert bits(link.snapshot()) == before


ALONG = r"the tip of the blade moves by 500 m in one step; at most 0\.561 m are allowed"
LONG = "an edge of 0.53 m moves by 0.5 m in one step; .* times travel at most 0.0315 m2, 1000"


@pytest.mark.parametrize(
    ("y", "before", "after", "match"),
    [
        (-500.0, 0.0, 0.0, ALONG),
        (0.01, 2.0, 0.0, "the heel of the blade moves by 2 m"),
        (0.01, 0.0, 0.5, LONG),
        (0.01, 20.0, 20.0, "the length is at most 5.61 m"),
    ],
)
def test_a_blade_that_moves_or_turns_too_far_is_refused(link, upright, y, before, after, match):
    """From a place y, with its edge lengthened by so much [m], to where it touches the block."""
    start, end = upright(0.009, y), upright(0.009, 0.01)
    start = start._replace(heel=start.heel + np.array([0.0, 0.0, before]))
    end = end._replace(heel=end.heel + np.array([0.0, 0.0, after]))
    expect_refusal(link, match, BladeSweep(start, end), DT)


def test_a_blade_that_moves_as_far_as_is_allowed_is_served(link, upright):
    sweep = BladeSweep(upright(0.009, 0.01 - 0.99 * FARTHEST), upright(0.009, 0.01))
    assert link.step(sweep, DT).cut_area > 0.0


def test_a_frame_that_is_driven_too_far_is_refused(link):
    link.attach(FrameAttachment("top", 100.0))
    at = np.array([0.01, 0.01, 0.02])
    near = [FramePose(at, np.eye(3))]
    link.step(None, DT, near)
    far = at + np.array([900.0, 0.0, 0.0])
    match = "frame 0 moves by 900 m in one step; at most"
    expect_refusal(link, match, None, DT, [FramePose(far, np.eye(3))])
    assert link.step(None, DT, near).n_tetrahedra == 72


def test_a_geom_that_moves_so_far_that_it_takes_seconds_to_follow_is_refused(link):
    ball = Geom("ball", "sphere", (4e-3,))
    far, near = (GeomPoses(np.array([[0.02, 0.03, z]]), np.eye(3)[None]) for z in (7.0, 0.05))
    link.collide_with([ball], far)
    match = "geom 'ball' moves so far in one step, .* more than 500 increments"
    expect_refusal(link, match, None, DT, (), near)
    assert link.step(None, DT, (), far).n_tetrahedra == 72


def test_a_step_of_more_integrator_steps_than_are_allowed_is_refused(monkeypatch):
    from bridge.tcp import request_limits
    from tests.bridge.tcp.test_places import server_in_a_thread

    monkeypatch.setattr(request_limits, "MOST_WORK", 0.0)
    monkeypatch.setattr(request_limits, "MOST_STEPS_REQUESTED", 100)
    with (
        server_in_a_thread() as server,
        contextlib.closing(link_once_free(server.address)) as link,
    ):
        with pytest.raises(LinkError, match="steps of the integrator; at most") as refused:
            link.step(None, 1.0)
        longest = float(re.search(r"at most ([0-9.e-]+) s are allowed", str(refused.value))[1])
        assert 0.05 < longest < 0.5
        assert link.step(None, 0.99 * longest).n_substeps <= 100


def test_a_body_of_many_tetrahedra_may_take_a_thousand_steps_at_least():
    from bridge.tcp.request_limits import MOST_STEPS_REQUESTED, RequestLimits
    from bridge.tcp.wire import MessageError
    from tests.bridge.tcp.serve_block import block_tissue

    tissue = block_tissue()
    longest = MOST_STEPS_REQUESTED * tissue.cut_report().initial.time_step
    limits = RequestLimits(tissue)
    limits.check_step(None, 0.99 * longest, 10**9)
    with pytest.raises(MessageError):
        limits.check_step(None, 1.01 * longest, 10**9)
