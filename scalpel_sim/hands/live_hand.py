"""A person who leads the instruments: their commands go to the one that they have chosen."""

import math
import time
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from bridge import TissueFrame
from scalpel_sim.hands.commands import (
    LONGEST_SILENCE,
    Choose,
    End,
    Engage,
    Jaws,
    LeadingCommand,
    Move,
    Release,
    Turn,
)
from scalpel_sim.hands.instrument import Instrument
from scalpel_sim.hands.live_blade import LiveBlade
from scalpel_sim.hands.live_grasper import LiveGrasper
from scalpel_sim.simulation import Simulation
from tissue import FloatArray


class LiveHand:
    """Leads blade and graspers as commands say, in place of their scripts.

    They start at rest, the blade is chosen, and nothing is held. Commands say how to move from
    where the chosen one wants to be, never where to be, so that nothing jumps when it is engaged
    again.

    A `Stroke` and `GraspMotion`s read from their rows lead to the same bits.

    Args:
        blade: The blade at its start.
        graspers: Graspers at theirs.
        frame: Where the tissue lies in the world.
        dt: Length of a frame [s].
        seconds: How long it leads at most [s]; then it has ended.
        clock: Wall time [s], by which silence is measured.
    """

    def __init__(
        self,
        blade: LiveBlade,
        graspers: Sequence[LiveGrasper],
        frame: TissueFrame,
        *,
        dt: float,
        seconds: float = math.inf,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.commands: deque[LeadingCommand] = deque()
        """What it is asked to do."""
        self.stamp: float | None = None
        """Stamp of the newest command that it has obeyed; None: there was none yet."""
        self.is_engaged = False
        """Whether it leads the chosen instrument."""
        self.ended_at: float | None = None
        """Simulated time at which it has ended [s]; from then on all rest."""
        self.blade = blade
        self.graspers = tuple(graspers)
        self.instruments: tuple[Instrument, ...] = (blade, *graspers)
        """What it may choose."""
        self.chosen = 0
        """Which of them it leads."""
        self._frame, self._clock = frame, clock
        self._dt, self._seconds = dt, seconds
        self._heard_at = -math.inf

    @classmethod
    def of(
        cls,
        simulation: Simulation,
        *,
        seconds: float = math.inf,
        clock: Callable[[], float] = time.monotonic,
    ) -> "LiveHand":
        """Return a hand for a simulation that was prepared to be led.

        Args:
            simulation: At its start.
            seconds: See `LiveHand`, as the rest.
            clock: Wall time [s].
        """
        frame, dt = simulation.frame, simulation.dt
        assert simulation.workspace is not None
        start, hand = simulation.stroke.start, simulation.arm.hand
        blade = LiveBlade(hand, start, frame, simulation.workspace, dt)
        graspers = []
        for each in simulation.graspers:
            assert each.workspace is not None
            graspers.append(LiveGrasper(each.grasper, each.motion, frame, each.workspace, dt))
        return cls(blade, graspers, frame, dt=dt, seconds=seconds, clock=clock)

    def take_over(self, simulation: Simulation) -> None:
        """Lead the instruments of the simulation that it was made for, from its next frame on."""
        simulation.leader = self
        for grasper, live in zip(simulation.graspers, self.graspers, strict=True):
            grasper.leader = live

    @property
    def numbers(self) -> tuple[float, ...]:
        """Where all instruments are led, and how far jaws are open: they tell moments apart."""
        return tuple(number for each in self.instruments for number in each.numbers)

    @property
    def tip(self) -> FloatArray:
        """Where the chosen instrument is led [m], world frame, shape (3,)."""
        return self.instruments[self.chosen].tip

    def lead(self, t: float) -> None:
        """Lead the blade to its pose at time `t` [s], a step after the last one.

        The graspers then know where they are to be led in this frame.
        """
        if self.ended_at is None:
            has_ended = self._obey() or t >= self._seconds
            for i, instrument in enumerate(self.instruments):
                is_engaged = self.is_engaged and i == self.chosen
                instrument.advance(t, is_engaged=is_engaged, moves=not has_ended)
            if has_ended:
                self.finish(max(t, self._dt))
        self.blade.lead(t)

    def finish(self, t: float) -> None:
        """End at time `t` [s], after the last frame, unless it has ended before."""
        if self.ended_at is None:
            self.ended_at = t
            self.let_go()
            for instrument in self.instruments:
                instrument.finish(t)

    def choose(self, instrument: int) -> None:
        """Let go, and lead another instrument from now on, if there is one of that number."""
        self.let_go()
        if instrument < len(self.instruments):
            self.chosen = instrument

    def let_go(self) -> None:
        """Have the chosen instrument rest where it is."""
        self.is_engaged = False
        self.instruments[self.chosen].pose.rest()

    def _obey(self) -> bool:
        """Do what the commands say; return whether one of them ends the run."""
        has_ended = False
        while self.commands:
            command = self.commands.popleft()
            self._heard_at = self._clock()
            chosen = self.instruments[self.chosen]
            if isinstance(command, Move | Turn):
                self.stamp = command.stamp
                by = self._frame.vectors_to_tissue(np.array(command.by))
                if self.is_engaged and isinstance(command, Move):
                    chosen.pose.move(by)
                elif self.is_engaged:
                    chosen.pose.turn(by)
            elif isinstance(command, Engage):
                self.is_engaged = True
            elif isinstance(command, Release):
                self.let_go()
            elif isinstance(command, Choose):
                self.choose(command.instrument)
            elif isinstance(command, Jaws):
                chosen.close_jaws(command.closed)
            elif isinstance(command, End):
                has_ended = True
        if self.is_engaged and self._clock() - self._heard_at > LONGEST_SILENCE:
            self.let_go()
        return has_ended
