import pytest

from scalpel_sim.crtk.operating_state import COMMANDS, CommandError, OperatingState

REFUSED = None
# The table of the convention: commands in columns, states in rows; `invalid` is refused here.
PUBLISHED = {
    "DISABLED": ("ENABLED", "DISABLED", REFUSED, REFUSED),
    "ENABLED": ("ENABLED", "DISABLED", "PAUSED", REFUSED),
    "PAUSED": (REFUSED, "DISABLED", "PAUSED", "ENABLED"),
    "FAULT": ("ENABLED", "DISABLED", REFUSED, REFUSED),
}


def in_state(state, *, is_homed=False):
    found = OperatingState()
    found.state, found.is_homed = state, is_homed
    return found


@pytest.mark.parametrize("state", PUBLISHED)
@pytest.mark.parametrize("column", range(4))
def test_commands_lead_where_the_published_table_says(state, column):
    arm, wanted = in_state(state), PUBLISHED[state][column]
    if wanted is REFUSED:
        with pytest.raises(CommandError, match=f"it is {state}, in which there is no"):
            arm.obey(COMMANDS[column])
    else:
        arm.obey(COMMANDS[column])
    assert arm.state == (wanted or state)


@pytest.mark.parametrize("state", ["DISABLED", "PAUSED", "FAULT"])
def test_an_arm_is_homed_when_it_is_enabled_and_not_else(state):
    arm = in_state(state)
    with pytest.raises(CommandError, match="enable it first"):
        arm.obey("home")
    assert not arm.is_homed


def test_an_arm_is_ready_while_it_is_enabled_and_homed():
    arm = OperatingState()
    ready = []
    for command in ("enable", "home", "pause", "resume", "unhome", "home", "disable", "enable"):
        arm.obey(command)
        ready.append(arm.is_ready)
    assert ready == [False, True, False, True, False, True, False, True]


@pytest.mark.parametrize(
    ("state", "is_homed", "message"),
    [("ENABLED", False, "it is not homed"), ("PAUSED", True, "it is PAUSED, not ENABLED")],
)
def test_an_arm_that_is_not_ready_refuses_motion_and_says_why(state, is_homed, message):
    with pytest.raises(CommandError, match=f"servo_cp is refused: {message}"):
        in_state(state, is_homed=is_homed).expect_ready("servo_cp")


def test_an_unknown_command_is_refused_with_the_known_ones():
    with pytest.raises(CommandError, match="'power'; there are enable, disable, pause"):
        OperatingState().obey("power")
