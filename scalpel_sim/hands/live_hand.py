"""A hand that a person leads in the page: it does what commands say."""

import numpy as np

from scalpel_sim.hands.commands import LONGEST_SILENCE, End, Engage, Move, Release, Turn
from scalpel_sim.hands.led_hand import LedHand


class LiveHand(LedHand):
    """A hand that obeys the commands of a page; see `LedHand`."""

    def _obey(self) -> bool:
        """Do what the commands say; return whether one of them ends the stroke."""
        has_ended = False
        while self.commands:
            command = self.commands.popleft()
            self._heard_at = self._clock()
            if isinstance(command, Move | Turn):
                self.stamp = command.stamp
                by = self._frame.vectors_to_tissue(np.array(command.by))
                if self.is_engaged and isinstance(command, Move):
                    self._pose.move(by)
                elif self.is_engaged:
                    self._pose.turn(by)
            elif isinstance(command, Engage):
                self.is_engaged = True
            elif isinstance(command, Release):
                self.let_go()
            elif isinstance(command, End):
                has_ended = True
        if self.is_engaged and self._clock() - self._heard_at > LONGEST_SILENCE:
            self.let_go()
        return has_ended
