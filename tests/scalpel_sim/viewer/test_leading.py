import asyncio
import json
import time
import urllib.request
from collections import deque

import pytest
from tornado.httpclient import HTTPClientError

from scalpel_sim import Viewer
from scalpel_sim.hands.commands import LONGEST_SILENCE, Engage, Move, Release
from scalpel_sim.viewer.leading import MESSAGES_PER_SECOND, MOST_AT_ONCE, Leadership
from scalpel_sim.viewer.messages import PageControls
from tests.scalpel_sim.hands.driven_runs import Clock
from tests.scalpel_sim.hands.driven_view import page_of, token_in
from tests.scalpel_sim.little_arm import FRAME, little_arm

TOKEN = "a-token-that-nobody-guesses"
HOST = "127.0.0.1:7000"

ENGAGE = '{"type":"engage"}'
RELEASE = '{"type":"release"}'
LEAD = '{"type":"lead"}'
STILL_THERE = '{"type":"still there"}'
MOVE = '{"type":"move","by":[0.001,0,0],"stamp":5}'

PATIENCE = 10.0
"""Longest time that a test waits for a command on a busy machine [s]."""


class Page:
    """A page that keeps what it was told."""

    def __init__(self) -> None:
        self.told: list[dict] = []

    def say(self, text: str) -> None:
        self.told.append(json.loads(text))

    @property
    def leads(self) -> bool:
        return self.told[-1]["leads"]


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def obeyed():
    return []


@pytest.fixture
def leading(clock, obeyed):
    return Leadership(TOKEN, obeyed.append, clock)


@pytest.fixture
def pages(leading):
    first, second = Page(), Page()
    leading.add(first)
    leading.add(second)
    return first, second


def test_the_first_page_leads_and_the_second_one_watches(leading, pages, obeyed):
    first, second = pages
    assert first.leads and not second.leads
    leading.receive(second, ENGAGE)
    assert obeyed == [] and leading.n_dropped == 1
    leading.receive(first, ENGAGE)
    leading.receive(first, MOVE)
    assert obeyed == [Engage(), Move([0.001, 0.0, 0.0], 5.0)]


def test_another_page_takes_over_once_the_first_has_let_go(leading, pages, obeyed):
    first, second = pages
    leading.receive(first, ENGAGE)
    leading.receive(second, LEAD)
    assert first.leads
    leading.receive(first, RELEASE)
    leading.receive(second, LEAD)
    assert second.leads and not first.leads
    assert obeyed[-1] == Release()


def test_a_page_that_is_silent_while_it_holds_the_blade_may_be_relieved(leading, pages, clock):
    first, second = pages
    leading.receive(first, ENGAGE)
    clock.now += 0.9 * LONGEST_SILENCE
    leading.receive(first, STILL_THERE)
    clock.now += 0.9 * LONGEST_SILENCE
    leading.receive(second, LEAD)
    assert first.leads
    clock.now += 0.2 * LONGEST_SILENCE
    leading.receive(second, LEAD)
    assert second.leads


def test_the_hand_lets_go_when_the_page_that_leads_is_closed(leading, pages, obeyed):
    first, second = pages
    leading.receive(first, ENGAGE)
    leading.remove(first)
    assert obeyed == [Engage(), Release()]
    assert not second.leads
    leading.receive(second, LEAD)
    assert second.leads


def test_garbage_is_dropped_and_counted(leading, pages, obeyed):
    for message in ("", "drawn?", b"\xff", '{"type":"jump"}', "[" * 5000):
        leading.receive(pages[0], message)
    leading.receive(Page(), ENGAGE)
    assert obeyed == [] and leading.n_dropped == 6


def test_a_page_that_floods_is_heard_at_a_bounded_rate(leading, pages, obeyed, clock):
    for _ in range(100_000):
        clock.now += 1e-5
        leading.receive(pages[0], STILL_THERE)
    assert len(obeyed) <= MOST_AT_ONCE + MESSAGES_PER_SECOND
    assert leading.n_dropped == 100_000 - len(obeyed)


@pytest.mark.parametrize(
    ("origin", "token", "may"),
    [
        (f"http://{HOST}", TOKEN, True),
        (f"http://{HOST}", "", False),
        (f"http://{HOST}", TOKEN[:-1], False),
        (f"https://{HOST}", TOKEN, False),
        ("http://127.0.0.1:7001", TOKEN, False),
        ("http://evil.example", TOKEN, False),
        ("null", TOKEN, False),
        ("http://é", "é", False),
        (None, TOKEN, False),
    ],
)
def test_only_a_page_of_this_server_with_its_token_may_lead(leading, origin, token, may):
    assert leading.may_lead(HOST, origin, token) == may


@pytest.fixture
def driven_viewer():
    commands = deque()
    with Viewer(
        little_arm()[0], frame=FRAME, controls=PageControls(commands, is_led=True)
    ) as viewer:
        viewer.commands = commands
        yield viewer


def heard(viewer, origin, token) -> list:
    """Return what the run hears of a page that engages the hand and is closed."""

    async def engage():
        page = await page_of(viewer.url, origin, token)
        await page.write_message(ENGAGE)
        page.close()
        while await page.read_message() is not None:
            pass

    asyncio.run(engage())
    end = time.monotonic() + 1.0
    while len(viewer.commands) < 2 and time.monotonic() < end:
        time.sleep(0.02)
    return list(viewer.commands)


def own_origin(viewer) -> str:
    return viewer.url.rstrip("/")


def test_a_page_with_the_token_leads_until_it_is_closed(driven_viewer):
    found = heard(driven_viewer, own_origin(driven_viewer), token_in(driven_viewer.url))
    assert found == [Engage(), Release()]


def test_a_page_without_the_token_is_not_heard(driven_viewer):
    assert heard(driven_viewer, own_origin(driven_viewer), "") == []
    assert heard(driven_viewer, own_origin(driven_viewer), TOKEN) == []


def test_a_page_of_another_origin_opens_no_socket(driven_viewer):
    with pytest.raises(HTTPClientError) as refused:
        heard(driven_viewer, "http://evil.example", token_in(driven_viewer.url))
    assert refused.value.code == 403


def test_the_hand_lets_go_when_the_viewer_is_killed(driven_viewer):
    driven_viewer._process.kill()
    end = time.monotonic() + PATIENCE
    while not driven_viewer.commands:
        assert time.monotonic() < end
        time.sleep(0.02)
    assert list(driven_viewer.commands) == [Release()]


def test_a_page_that_only_shows_has_no_token():
    with Viewer(little_arm()[0]) as viewer, urllib.request.urlopen(viewer.url) as answer:
        assert "TOKEN =" not in answer.read().decode()
