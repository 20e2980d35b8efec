"""Limits of the cost of one request to a tissue: a server that computes for long serves nobody."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from bridge.driven import FrameLoad, FramePose
from bridge.tcp.wire import MessageError
from tissue import FloatArray

if TYPE_CHECKING:  # only the function that makes a tissue loads the compiler
    from tissue import BladeSweep, Tissue

FARTHEST_IN_A_REQUEST = 100.0
"""Farthest motion of the edge, or of a driven frame, in a request, in mean node sizes of the body.
The edge is followed in quarters of a node size, so that these are 400 increments, and 15 times as
many where the step goes wrong and is repeated. In a frame of a millisecond a scalpel moves by a
hundredth of a node size."""

LARGEST_SWEEP = 1000.0
"""Area that the edge may sweep in a request, as its length times how far it moves, in squares of
the mean node size; also its length, in node sizes. Points along the edge, some to a node size, are
followed in each increment."""

MOST_STEPS_REQUESTED = 1000
"""Steps of the integrator in a request that are always allowed. A frame of the scenes takes 1 to
20."""

MOST_WORK = 4e6
"""Steps of the integrator times tetrahedra that are allowed where it is more, for a body at rest:
0.1 s. One that is torn about takes up to 20 times as many (`step_choice.MOST_OF_LONG`)."""


class RequestLimits:
    """The limits of the requests to a body.

    Args:
        tissue: The body, before it is cut: what cuts leave takes as long steps, by mass scaling.
    """

    def __init__(self, tissue: Tissue) -> None:
        self._node_size = tissue.node_size
        self._farthest = FARTHEST_IN_A_REQUEST * tissue.node_size
        self._step = tissue.cut_report().initial.time_step

    def check_step(self, sweep: BladeSweep | None, dt: float, n_tetrahedra: int) -> None:
        """Check the motion of the blade, and the length of the step [s].

        Raises:
            MessageError: the step would take too long.
        """
        most_steps = max(MOST_STEPS_REQUESTED, MOST_WORK / n_tetrahedra)
        if dt > most_steps * self._step:
            raise MessageError(
                f"a step of {dt:g} s, which takes some {dt / self._step:.4g} steps of the "
                f"integrator; at most {most_steps * self._step:.3g} s are allowed. Take shorter "
                "steps"
            )
        if sweep is not None:
            self._check_sweep(sweep)

    def check_poses(self, poses: Sequence[FramePose], before: Sequence[FrameLoad]) -> None:
        """Check how far frames move.

        Args:
            poses: Where they will be.
            before: What the body did to each in the last step, and where.

        Raises:
            MessageError: one moves too far.
        """
        for i, (pose, load) in enumerate(zip(poses, before, strict=True)):
            self._check_path(f"frame {i}", load.wrench.point, pose.origin)

    def _check_sweep(self, sweep: BladeSweep) -> None:
        (tip_t0, heel_t0, _), (tip_t1, heel_t1, _) = sweep
        travel = max(
            self._check_path("the tip of the blade", tip_t0, tip_t1),
            self._check_path("the heel of the blade", heel_t0, heel_t1),
        )
        length = max(_distance(tip_t0, heel_t0), _distance(tip_t1, heel_t1))
        size = self._node_size
        if max(length / size, length * travel / size**2) > LARGEST_SWEEP:
            raise MessageError(
                f"an edge of {length:.3g} m moves by {travel:.3g} m in one step; the length is at "
                f"most {LARGEST_SWEEP * size:.3g} m, and length times travel at most "
                f"{LARGEST_SWEEP * size**2:.3g} m2, {LARGEST_SWEEP:g} squares of the mean node "
                "size. Take shorter steps, or a shorter blade"
            )

    def _check_path(self, what: str, before: FloatArray, after: FloatArray) -> float:
        """Return how far something moves [m]."""
        distance = _distance(before, after)
        if not distance <= self._farthest:
            raise MessageError(
                f"{what} moves by {distance:.3g} m in one step; at most {self._farthest:.3g} m are "
                f"allowed, {FARTHEST_IN_A_REQUEST:g} times the mean node size. Take shorter steps"
            )
        return distance


def _distance(a: FloatArray, b: FloatArray) -> float:
    return math.dist(a.tolist(), b.tolist())
