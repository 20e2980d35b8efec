"""A hand that somebody leads: it has the instruments, and what it did with them is recorded."""

import abc
import math
import time
from collections import deque
from collections.abc import Callable
from typing import Any, cast

import numpy as np

from scalpel_sim.hands.commands import (
    LONGEST_SILENCE,
    Aim,
    Choose,
    End,
    Engage,
    Jaws,
    LeadingCommand,
    Move,
    Release,
    StillThere,
    Turn,
)
from scalpel_sim.hands.driven_instruments import LiveBlade, LiveGrasper, LiveInstrument
from scalpel_sim.simulation import Simulation
from tissue import FloatArray


class Teleoperation(abc.ABC):
    """Leads blade and graspers towards wanted poses, in place of their scripts.

    They start at rest, the blade is chosen, and nothing is held. Whoever leads says how to move
    from where the chosen one wants to be, never where to be, so that nothing jumps when it is
    engaged again.

    A `Stroke` and `GraspMotion`s read from their rows lead to the same bits.

    Args:
        simulation: At its start, prepared to be led; its leaders stay until `take_over`.
        seconds: How long it leads at most [s]; then it has ended.
        clock: Wall time [s], by which silence is measured.
    """

    def __init__(
        self,
        simulation: Simulation,
        *,
        seconds: float = math.inf,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.commands: deque[LeadingCommand] = deque()
        """Commands to be obeyed in the next frame."""
        self.stamp: float | None = None
        """Stamp of the newest command that it has obeyed; None: there was none yet."""
        self.is_engaged = False
        """Whether it leads the chosen instrument."""
        self.is_to_end = False
        """Whether it ends before the next frame."""
        self.ended_at: float | None = None
        """Simulated time at which it has ended [s]; from then on all rest."""
        self.n_limited = 0
        """Frames in which a limit of speed, turn rate or room held an instrument back."""
        frame, dt = simulation.frame, simulation.dt
        self._frame, self._clock = frame, clock
        self._dt, self._seconds = dt, seconds
        self._heard_at = -math.inf
        assert simulation.workspace is not None
        start, hand = simulation.stroke.start, simulation.arm.hand
        self.blade = LiveBlade(hand, start, frame, simulation.workspace, dt)
        self.graspers = tuple(
            LiveGrasper(each.grasper, each.motion, frame, cast(FloatArray, each.workspace), dt)
            for each in simulation.graspers
        )
        self.instruments: tuple[LiveInstrument, ...] = (self.blade, *self.graspers)
        """Instruments that it may choose."""
        self.chosen = 0
        """Which of them it leads."""

    def end(self) -> None:
        """End before the next frame."""
        self.is_to_end = True

    @abc.abstractmethod
    def _obey(self) -> bool:
        """Obey the commands since the last frame; return whether the run is to end."""

    def take_over(self, simulation: Simulation) -> None:
        """Lead the instruments of the simulation that it was made for, from its next frame on."""
        simulation.blade.controller = self
        for grasper, live in zip(simulation.graspers, self.graspers, strict=True):
            grasper.controller = live

    @property
    def numbers(self) -> tuple[float, ...]:
        """Where all instruments are led, and how far jaws are open: they distinguish moments."""
        return tuple(number for each in self.instruments for number in each.numbers)

    @property
    def stylus_distance(self) -> float:
        """Distance of the stylus of a device from where the blade is led [m]; 0 without one."""
        return 0.0

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
            self.n_limited += any([each.pose.was_limited() for each in self.instruments])
            if has_ended:
                self.finish(max(t, self._dt))
        self.blade.lead(t)

    def finish(self, t: float) -> None:
        """End at time `t` [s], after the last frame, unless it has ended before."""
        if self.ended_at is None:
            self.ended_at = t
            self.release()
            for instrument in self.instruments:
                instrument.finish(t)

    def choose(self, instrument: int) -> None:
        """Release the instrument, and lead the one of that number from now on, if there is one."""
        self.release()
        if instrument < len(self.instruments):
            self.chosen = instrument

    def release(self) -> None:
        """Release the chosen instrument: it rests where it is."""
        self.is_engaged = False
        self.instruments[self.chosen].pose.rest()


class LiveHand(Teleoperation):
    """A hand that obeys the commands of a page; see `Teleoperation`.

    After `LONGEST_SILENCE` of the page it rests, and the next command continues its stroke.
    """

    _rests_in_silence = False

    def _obey(self) -> bool:
        """Obey the commands; return whether one of them ends the run."""
        while self.commands:
            command = self.commands.popleft()
            self._heard_at = self._clock()
            if self._rests_in_silence:
                self.engage()
            HAND_COMMANDS[type(command)](self, command)
        if self.is_engaged and self._clock() - self._heard_at > LONGEST_SILENCE:
            self.release()
            self._rests_in_silence = True
        return self.is_to_end

    def release(self) -> None:
        """See `Teleoperation.release`."""
        super().release()
        self._rests_in_silence = False

    def engage(self) -> None:
        """Lead the chosen instrument from now on."""
        self.is_engaged, self._rests_in_silence = True, False

    def move(self, command: Move | Turn) -> None:
        """Move or turn the chosen instrument, if it is engaged."""
        self.stamp = command.stamp
        by = self._frame.vectors_to_tissue(np.array(command.by))
        pose = self.instruments[self.chosen].pose
        if self.is_engaged:
            (pose.move if isinstance(command, Move) else pose.turn)(by)

    def aim(self, command: Aim) -> None:
        """Lead the chosen instrument to a place, if it is engaged."""
        self.stamp = command.stamp
        if self.is_engaged:
            self.instruments[self.chosen].aim(np.array(command.to))

    def close_jaws(self, closed: bool) -> None:
        """Close or open the jaws of the chosen instrument."""
        self.instruments[self.chosen].close_jaws(closed)


HAND_COMMANDS: dict[type[LeadingCommand], Callable[[LiveHand, Any], None]] = {
    Engage: lambda hand, _: hand.engage(),
    Release: lambda hand, _: hand.release(),
    Move: LiveHand.move,
    Aim: LiveHand.aim,
    Turn: LiveHand.move,
    Choose: lambda hand, command: hand.choose(command.instrument),
    Jaws: lambda hand, command: hand.close_jaws(command.closed),
    End: lambda hand, _: hand.end(),
    StillThere: lambda hand, _: None,
}
"""Handler of each message that the hand obeys in its next frame."""
