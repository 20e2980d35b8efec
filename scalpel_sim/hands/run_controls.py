"""What a page asks of a run: to stand still, to go slowly, to go back, and to lead its hand."""

import time
from collections import deque
from collections.abc import Callable

from scalpel_sim.hands.commands import (
    Begin,
    Choose,
    Command,
    End,
    Engage,
    Jaws,
    LeadingCommand,
    Pause,
    Reset,
    Resume,
    SlowMotion,
    Step,
    Undo,
)
from scalpel_sim.hands.history import History
from scalpel_sim.hands.led_hand import LedHand
from scalpel_sim.hands.pace import Pace

FRAMES_PER_STEP = 10
"""Frames of a step: a hundredth of a second, in which a blade that cuts goes half a millimetre."""

SECONDS_ASLEEP = 0.01
"""How often a run that stands still looks for commands [s]."""


class RunControls:
    """Obeys the commands of a page between frames, and passes on those to the hand.

    Args:
        pace: How fast time passes.
        history: Where the run can go back to.
        hand: Obeys the commands that lead the blade; None: a script leads it.
        commands: What the page asks; any thread may append. None: there is no page.
        sleep: Waits for so many seconds.
    """

    def __init__(
        self,
        pace: Pace,
        history: History,
        hand: LedHand | None = None,
        commands: deque[Command] | None = None,
        *,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.commands: deque[Command] = deque() if commands is None else commands
        """What the page asks."""
        self.pace, self.history, self.hand = pace, history, hand
        self.is_paused = False
        """Whether time stands still."""
        self.has_ended = False
        """Whether the page has ended the run."""
        self.next: Begin | None = None
        """The run that the page has asked for after this one."""
        self.notice = ""
        """What the page is to tell the person."""
        self.on_change: Callable[[], None] = lambda: None
        """Called after a change that no frame shows."""
        self.on_wait: Callable[[], None] = lambda: None
        """Called each time that a run which stands still looks for commands."""
        self._sleep = sleep
        self._frames_left, self._is_stepping = 0, False
        self._numbers_before_stroke: tuple[float, ...] | None = None

    def obey(self) -> bool:
        """Do what the page asks; return whether the run is to wait, and then to ask again."""
        while self.commands:
            self._do(self.commands.popleft())
        if not self.is_paused:
            return False
        if self._frames_left:
            self._frames_left -= 1
            self._is_stepping = True
            return False
        if self._is_stepping:
            self._is_stepping = False
            self.on_change()  # pictures skip most frames
        self.on_wait()
        self._sleep(SECONDS_ASLEEP)
        self.pace.go_on()
        return True

    def _do(self, command: Command) -> None:
        if isinstance(command, LeadingCommand):
            if isinstance(command, Engage | Jaws):
                self._begin_stroke()
            self._pass_on(command)
        elif isinstance(command, Pause | Resume):
            self._let_go()
            self.is_paused, self._frames_left = isinstance(command, Pause), 0
            self.on_change()
        elif isinstance(command, Step):
            self._frames_left = FRAMES_PER_STEP
        elif isinstance(command, SlowMotion):
            self.pace.rate = command.rate
            self.on_change()
        elif isinstance(command, Undo | Reset):
            self._go_back(isinstance(command, Reset))
        elif isinstance(command, Begin):
            self.next = command
            self._pass_on(End())

    def _pass_on(self, command: LeadingCommand) -> None:
        """Have the hand obey."""
        if isinstance(command, End):
            self.is_paused, self.has_ended = False, True
        if self.hand is None:
            return
        if isinstance(command, Choose) and self.is_paused:  # no frame would show it
            self.hand.choose(command.instrument)
            self.on_change()
        else:
            self.hand.commands.append(command)

    def _begin_stroke(self) -> None:
        """Keep the present, to which an undo goes back; a stroke that led nowhere is none."""
        if self.hand is None or self.hand.is_engaged:
            return
        if self.hand.numbers == self._numbers_before_stroke:
            self.history.drop()
        self._numbers_before_stroke = self.hand.numbers
        self.history.add()

    def _go_back(self, to_start: bool) -> None:
        if self.hand is not None:
            self.hand.commands.clear()
            if self.hand.numbers == self._numbers_before_stroke and not to_start:
                self.history.drop()  # nothing was led since
        if self.history.reset() if to_start else self.history.undo():
            self._frames_left, self._is_stepping = 0, False
        self._let_go()  # it may have led at the moment to which it went back
        self._numbers_before_stroke = None
        self.on_change()

    def _let_go(self) -> None:
        """Have the hand let go, and forget what it was still to do."""
        if self.hand is not None:
            self.hand.commands.clear()
            self.hand.let_go()
