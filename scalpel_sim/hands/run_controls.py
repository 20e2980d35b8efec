"""Requests of a page to a run: to pause, to slow down, to go back, and to lead its hand."""

import time
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from bridge import InProcessLink
from scalpel_sim.hands.commands import (
    Aim,
    Begin,
    Choose,
    Command,
    CutLines,
    End,
    Engage,
    Jaws,
    Lead,
    LeadingCommand,
    Move,
    Pause,
    Release,
    Reset,
    Resume,
    SlowMotion,
    Step,
    StillThere,
    Turn,
    Undo,
)
from scalpel_sim.hands.run_results import RunResults
from scalpel_sim.hands.teleoperation import Teleoperation
from scalpel_sim.simulation import Simulation
from scalpel_sim.state import SimulationState

FRAMES_PER_STEP = 10
"""Frames of a step: a hundredth of a second, in which a blade that cuts goes half a millimetre."""

SECONDS_ASLEEP = 0.01
"""Interval at which a run that stands still looks for commands [s]."""

MOST_STROKES = 50
"""Strokes that can be undone. Each keeps a state of the body in memory, some megabytes."""

SHORTEST_PAUSE = 5e-3
"""Shortest pause that slows a run to real time [s]: a shorter one costs more than it gains."""

MOST_BEHIND = 0.05
"""Delay of simulated time that is caught up, at most [s]. What is lost beyond is lost: a blade
that is led by hand must not run ahead of the hand afterwards."""

MEASURED_OVER = 0.5
"""Wall time over which the factor is measured [s]."""


class Follower(Protocol):
    """A part of the run so far that goes back with it: a file, a replay."""

    def mark(self) -> Any:
        """Return how far it has got."""

    def cut_back(self, mark: Any) -> None:
        """Forget what came after a mark."""


class _Moment(NamedTuple):
    """A run at the end of a frame."""

    state: SimulationState
    marks: list[Any]
    """Mark of each follower."""


class History:
    """States of a run at its start, and before each of its last strokes.

    Args:
        simulation: The run, at its start.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._followers: list[Follower] = []
        self._start: _Moment | None = None
        self._moments: list[_Moment] = []

    @property
    def can_go_back(self) -> bool:
        """Whether the run can go back: the state of a tissue in another process is out of reach."""
        return isinstance(self._simulation.link, InProcessLink)

    @property
    def n_strokes(self) -> int:
        """Number of strokes that can be undone."""
        return len(self._moments)

    def begin(self, *followers: Follower) -> None:
        """Keep the start.

        Args:
            followers: What goes back with the simulation.
        """
        self._followers += followers
        if self.can_go_back:
            self._start = self._now()

    def add(self) -> None:
        """Keep the present as that before a stroke."""
        if self.can_go_back:
            self._moments = [*self._moments[-(MOST_STROKES - 1) :], self._now()]

    def drop(self) -> None:
        """Forget the moment before the last stroke: that was none."""
        del self._moments[-1:]

    def undo(self) -> bool:
        """Go back to before the last stroke; return whether there was one."""
        return bool(self._moments) and self._go_to(self._moments.pop())

    def reset(self) -> bool:
        """Go back to the start; return whether it is known."""
        self._moments.clear()
        return self._start is not None and self._go_to(self._start)

    def _now(self) -> _Moment:
        marks = [each.mark() for each in self._followers]
        return _Moment(self._simulation.save_state(), marks)

    def _go_to(self, moment: _Moment) -> bool:
        self._simulation.load_state(moment.state)
        for follower, mark in zip(self._followers, moment.marks, strict=True):
            follower.cut_back(mark)
        return True


class Pace:
    """Slows a simulation to real time, or to slow motion, where it is faster.

    Args:
        clock: Wall time [s].
        sleep: Waits for so many seconds.
        shortest_pause: Shortest pause that slows the run [s]; 0: it waits after each frame, as a
            device needs it.
    """

    def __init__(
        self,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
        shortest_pause: float = SHORTEST_PAUSE,
    ) -> None:
        self.rate = 1.0
        """Simulated time over wall time, at most."""
        self.factor = 1.0
        """Simulated time over wall time, lately."""
        self._clock, self._sleep = clock, sleep
        self._shortest_pause = shortest_pause
        self._due = self._since = clock()
        self._simulated = 0.0

    def wait(self, dt: float) -> None:
        """Wait, after a frame of that length [s], until its end is due."""
        self._due += dt / self.rate
        self._simulated += dt
        now = self._clock()
        if self._due - now > self._shortest_pause:
            self._sleep(self._due - now)
            now = self._clock()
        self._due = max(self._due, now - MOST_BEHIND)
        if now - self._since >= MEASURED_OVER:
            self.factor = self._simulated / (now - self._since)
            self._simulated, self._since = 0.0, now

    def go_on(self) -> None:
        """Forget the time that has passed since the last frame: it was not the simulation's."""
        self._due = self._since = self._clock()
        self._simulated = 0.0


class RunControls:
    """Obeys the commands of a page between frames, and passes on those to the hand.

    Args:
        pace: How fast time passes.
        history: Where the run can go back to.
        hand: Obeys the commands that lead the blade; None: a script leads it.
        commands: What the page requests; any thread may append. None: there is no page.
        sleep: Waits for so many seconds.
    """

    def __init__(
        self,
        pace: Pace,
        history: History,
        hand: Teleoperation | None = None,
        commands: deque[Command] | None = None,
        *,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.commands: deque[Command] = deque() if commands is None else commands
        """Commands of the page."""
        self.pace, self.history, self.hand = pace, history, hand
        self.is_paused = False
        """Whether time stands still."""
        self.has_ended = False
        """Whether the page has ended the run."""
        self.next: Begin | CutLines | None = None
        """The run that the page has requested after this one."""
        self.notice = ""
        """Message of the page to the person."""
        self.results: RunResults | None = None
        """Results of the run; None: it goes on."""
        self.on_change: Callable[[], None] = lambda: None
        """Called after a change that no frame shows."""
        self.on_wait: Callable[[], None] = lambda: None
        """Called each time that a run which stands still looks for commands."""
        self._sleep = sleep
        self._frames_left, self._is_stepping = 0, False
        self._numbers_before_stroke: tuple[float, ...] | None = None

    def obey(self) -> bool:
        """Obey the page; return whether the run is to wait, and then to obey again."""
        while self.commands:
            command = self.commands.popleft()
            RUN_COMMANDS[type(command)](self, command)
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

    def stop_time(self, *, stops: bool) -> None:
        """Release the instrument, and stop the time or continue it."""
        self._release()
        self.is_paused, self._frames_left = stops, 0
        self.on_change()

    def step(self) -> None:
        """Continue the time for `FRAMES_PER_STEP` frames."""
        self._frames_left = FRAMES_PER_STEP

    def slow_down(self, rate: float) -> None:
        """Change the rate at which time passes."""
        self.pace.rate = rate
        self.on_change()

    def end(self, following: Begin | CutLines | None = None) -> None:
        """End the run; `following` is the one after it."""
        if following is not None:
            self.next = following
        self.is_paused, self.has_ended = False, True
        self.pass_on(End())

    def choose(self, command: Choose) -> None:
        """Lead another instrument, at once where no frame would show it."""
        if self.hand is not None and self.is_paused:
            self.hand.choose(command.instrument)
            self.on_change()
        else:
            self.pass_on(command)

    def begin_stroke(self, command: Engage | Jaws) -> None:
        """Keep the present for an undo, and pass the command on."""
        self._begin_stroke()
        self.pass_on(command)

    def pass_on(self, command: LeadingCommand) -> None:
        """Pass a command on to the hand."""
        if self.hand is not None:
            self.hand.commands.append(command)

    def _begin_stroke(self) -> None:
        """Keep the present, to which an undo goes back; a stroke that led nowhere is none."""
        if self.hand is None or self.hand.is_engaged:
            return
        if self.hand.numbers == self._numbers_before_stroke:
            self.history.drop()
        self._numbers_before_stroke = self.hand.numbers
        self.history.add()

    def go_back(self, *, to_start: bool) -> None:
        """Return to before the last stroke, or to the start."""
        if self.hand is not None:
            self.hand.commands.clear()
            if self.hand.numbers == self._numbers_before_stroke and not to_start:
                self.history.drop()  # nothing was led since
        if self.history.reset() if to_start else self.history.undo():
            self._frames_left, self._is_stepping = 0, False
        self._release()  # it may have led at the moment to which it went back
        self._numbers_before_stroke = None
        self.on_change()

    def _release(self) -> None:
        """Release the instrument, and forget the commands that are left."""
        if self.hand is not None:
            self.hand.commands.clear()
            self.hand.release()


RUN_COMMANDS: dict[type[Command], Callable[[RunControls, Any], None]] = {
    Pause: lambda run, _: run.stop_time(stops=True),
    Resume: lambda run, _: run.stop_time(stops=False),
    Step: lambda run, _: run.step(),
    SlowMotion: lambda run, command: run.slow_down(command.rate),
    Undo: lambda run, _: run.go_back(to_start=False),
    Reset: lambda run, _: run.go_back(to_start=True),
    Begin: lambda run, command: run.end(command),
    CutLines: lambda run, command: run.end(command),
    End: lambda run, _: run.end(),
    Choose: RunControls.choose,
    Engage: RunControls.begin_stroke,
    Jaws: RunControls.begin_stroke,
    Release: RunControls.pass_on,
    Move: RunControls.pass_on,
    Aim: RunControls.pass_on,
    Turn: RunControls.pass_on,
    StillThere: RunControls.pass_on,
    Lead: lambda run, _: None,
}
"""Handler of each message between two frames. Those that the hand obeys are in `HAND_COMMANDS`."""
