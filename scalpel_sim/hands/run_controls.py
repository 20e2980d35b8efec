"""What a page asks of a run: to stand still, to go slowly, to go back, and to lead its hand."""

import time
from collections import deque
from collections.abc import Callable

from scalpel_sim.hands.commands import (
    Command,
    End,
    Engage,
    HandCommand,
    Pause,
    Reset,
    Resume,
    SlowMotion,
    Step,
    Undo,
)
from scalpel_sim.hands.history import History
from scalpel_sim.hands.live_hand import LiveHand
from scalpel_sim.hands.pace import Pace

FRAMES_PER_STEP = 10
"""Frames of a step: a hundredth of a second, in which a blade that cuts goes half a millimetre."""

SECONDS_PER_LOOK = 0.01
"""How often a run that stands still looks for commands [s]."""


class RunControls:
    """Obeys the commands of a page between frames, and passes on those to the hand.

    Args:
        pace: How fast time passes.
        history: Where the run can go back to.
        hand: Obeys the commands that lead the blade; None: a script leads it.
        sleep: Waits for so many seconds.
    """

    def __init__(
        self,
        pace: Pace,
        history: History,
        hand: LiveHand | None = None,
        *,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.commands: deque[Command] = deque()
        """What the page asks; any thread may append."""
        self.pace, self.history, self.hand = pace, history, hand
        self.is_paused = False
        """Whether time stands still."""
        self.on_change: Callable[[], None] = lambda: None
        """Called after a change that no frame shows."""
        self.on_wait: Callable[[], None] = lambda: None
        """Called each time that a run which stands still looks for commands."""
        self._sleep = sleep
        self._frames_left, self._is_stepping = 0, False
        self._pose_before_stroke: tuple[float, ...] | None = None

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
        self._sleep(SECONDS_PER_LOOK)
        self.pace.go_on()
        return True

    def _do(self, command: Command) -> None:
        if isinstance(command, HandCommand):
            if isinstance(command, Engage):
                self._begin_stroke()
            if isinstance(command, End):
                self.is_paused = False
            if self.hand is not None:
                self.hand.commands.append(command)
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

    def _begin_stroke(self) -> None:
        """Keep the present, to which an undo goes back; a stroke that led nowhere is none."""
        if self.hand is None or self.hand.is_engaged:
            return
        if self.hand.pose == self._pose_before_stroke:
            self.history.drop()
        self._pose_before_stroke = self.hand.pose
        self.history.add()

    def _go_back(self, to_start: bool) -> None:
        if self.hand is not None:
            self.hand.commands.clear()
            if self.hand.pose == self._pose_before_stroke and not to_start:
                self.history.drop()  # nothing was led since
        if self.history.reset() if to_start else self.history.undo():
            self._frames_left, self._is_stepping = 0, False
        self._pose_before_stroke = None
        self.on_change()

    def _let_go(self) -> None:
        """Have the hand let go, and forget what it was still to do."""
        if self.hand is not None:
            self.hand.commands.clear()
            self.hand.let_go()
