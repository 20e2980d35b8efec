import json
import math
from typing import get_args

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scalpel_sim.hands.commands import (
    FARTHEST_MOVE,
    FARTHEST_TURN,
    LONGEST_MESSAGE,
    Aim,
    Choose,
    Command,
    CutLines,
    DrawnLine,
    End,
    Engage,
    Jaws,
    Lead,
    LeadingCommand,
    Move,
    Release,
    StillThere,
    Turn,
    command_of,
)
from scalpel_sim.hands.run_controls import RUN_COMMANDS
from scalpel_sim.hands.teleoperation import HAND_COMMANDS

ALL = [
    Engage(),
    Release(),
    Move([1e-3, -2e-3, 0.0], 12.5),
    Aim([0.1, -0.2, 0.3], 12.5),
    Turn([0.0, 0.1, 0.0], 1e9),
    StillThere(),
    Choose(1),
    Jaws(True),
    Lead(),
    End(),
    CutLines([DrawnLine([[0.0, 0.01, 0.02]] * 100, [0.0, 0.0, 1.0], 6e-3, 0.03)]),
]

ANY_JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(),
    lambda children: st.lists(children) | st.dictionaries(st.text(), children),
    max_leaves=10,
)

ALMOST_A_MOVE = st.fixed_dictionaries(
    {
        "type": st.sampled_from(["move", "turn"]),
        "by": st.lists(st.floats(), max_size=4) | ANY_JSON,
        "stamp": st.floats() | ANY_JSON,
    }
)


@pytest.mark.parametrize("command", ALL, ids=lambda command: type(command).__name__)
def test_a_command_is_read_as_it_was_written(command):
    assert command_of(msgspec.json.encode(command)) == command


def test_each_command_has_a_handler():
    assert RUN_COMMANDS.keys() == set(get_args(Command))
    assert HAND_COMMANDS.keys() == set(get_args(LeadingCommand))


def is_small(command: Command) -> bool:
    """Whether a command asks for no more than a hand may."""
    if isinstance(command, Move | Turn):
        most = FARTHEST_MOVE if isinstance(command, Move) else FARTHEST_TURN
        return math.hypot(*command.by) <= most and math.isfinite(command.stamp)
    return True


@given(st.text() | st.binary() | ANY_JSON.map(json.dumps) | ALMOST_A_MOVE.map(json.dumps))
def test_garbage_is_no_command_and_no_exception(message):
    command = command_of(message)
    assert command is None or is_small(command)


@given(st.lists(st.floats(allow_nan=False, width=32), min_size=3, max_size=3))
def test_a_move_is_obeyed_just_if_it_is_finite_and_small(by):
    command = command_of(json.dumps({"type": "move", "by": by, "stamp": 0.0}))
    assert (command is not None) == (math.hypot(*by) <= FARTHEST_MOVE)


@pytest.mark.parametrize(
    "message",
    [
        '{"type":"move","by":[NaN,0,0],"stamp":0}',
        '{"type":"move","by":[0,0],"stamp":0}',
        '{"type":"move","by":[0,0,0]}',
        '{"type":"move","by":[0,0,0],"stamp":0,"to":"the moon"}',
        '{"type":"jump"}',
        "[" * 200,
        '{"type":"end"}' + " " * LONGEST_MESSAGE,
        b"\xff\xfe",
    ],
)
def test_what_is_no_command_is_dropped(message):
    assert command_of(message) is None
