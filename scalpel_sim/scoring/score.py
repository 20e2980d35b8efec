"""`Score`: how well a task is done so far, whoever leads the instruments."""

from collections.abc import Mapping
from typing import Any

from bridge import InProcessLink
from scalpel_sim.scene.arm_tables import BLADE_NAME
from scalpel_sim.scene.task_table import SuccessTable
from scalpel_sim.scoring.cut_terms import CutTerms
from scalpel_sim.scoring.exposure import Exposure, TaskCamera
from scalpel_sim.scoring.hand_terms import HandTerms
from scalpel_sim.scoring.plan import Plan
from scalpel_sim.scoring.tissue_terms import PiecesTerm, StrainTerm
from scalpel_sim.scoring.yardstick import Yardstick
from scalpel_sim.simulation import Simulation
from tissue import BoolArray, Snapshot, Tissue

CONTROL_STEP = 0.02
"""Time from one look at the tissue to the next [s]: a control step of a hand or a policy."""

_AT_LEAST = ("covered", "held", "removed", "exposed")
"""Terms of which success asks for that much; of others for no more."""


class Score:
    """The score of a simulation so far. It is a part of the simulation's state.

    Forces count in each frame; all else at each control step.

    Args:
        yardstick: The plan and the limits.
        simulation: Before its first frame, with all its instruments.
        body: The body then.
    """

    def __init__(self, yardstick: Yardstick, simulation: Simulation, body: Snapshot) -> None:
        self._yardstick = yardstick
        self._every = max(round(CONTROL_STEP / simulation.dt), 1)
        self._link = simulation.link
        self._tissue = _tissue_of(simulation)
        self._n_faces = self._link.n_cut_faces
        limit = yardstick.force_limit
        graspers = simulation.graspers
        self.hands = (
            HandTerms(BLADE_NAME, limit(BLADE_NAME), can_hold=False),
            *(HandTerms(each.name, limit(each.name), can_hold=True) for each in graspers),
        )
        """Terms of each instrument, the blade first."""
        self._graspers = tuple(zip(self.hands[1:], graspers, strict=True))
        self.cut = CutTerms(yardstick)
        """Terms of the cut."""
        self._area_held = 0.0
        self._strains = tuple(StrainTerm(each) for each in yardstick.strains)
        self._look_at_strain()
        self._pieces = PiecesTerm(yardstick, body, simulation.link.n_pieces())
        self._time = 0.0
        self._work = (0.0, 0.0)
        self._has_labels = len(simulation.link.describe().labels) > 1
        self._work_of_labels: tuple[float, ...] = ()
        self._exposed: float | None = None
        self._exposure = _exposure_of(yardstick, simulation, body)
        self._look_at_target(simulation)

    @property
    def yardstick(self) -> Yardstick:
        """The plan and the limits."""
        return self._yardstick

    def compare_with(self, yardstick: Yardstick) -> None:
        """Compare cuts with another plan from now on; before the first cut."""
        self._yardstick, self.cut = yardstick, CutTerms(yardstick)

    @property
    def plan(self) -> Plan | None:
        """The plan; None where there is none."""
        return self._yardstick.plan

    @property
    def is_covered(self) -> BoolArray:
        """Which places of the plan are cut, shape (n,). A copy."""
        return self.cut.is_covered

    @property
    def asks(self) -> bool:
        """Whether the task has a condition of success."""
        return bool(_asked(self._yardstick.task.success))

    def after_frame(self, simulation: Simulation) -> None:
        """Count a frame, and where it ends a control step, that."""
        dt, blade, of_blade = simulation.dt, simulation.blade, self.hands[0]
        of_blade.feel(blade.wrench, dt)
        for terms, each in self._graspers:
            terms.feel(each.wrench, dt)
        if simulation.n_frames % self._every == 0:
            dt *= self._every
            of_blade.move(blade.segment.numbers[:3], False, dt)
            for terms, each in self._graspers:
                terms.move(tuple(each.grasper.pads.centre.tolist()), each.holds, dt)
            self.look(simulation)

    def look(self, simulation: Simulation) -> None:
        """Look at the tissue now; at each control step it is done anyway."""
        self._time = simulation.time
        result = simulation.bridge.result
        if result is not None:
            self._work = (result.work_of_blade, result.work_of_cutting)
            if self._has_labels:
                self._work_of_labels = tuple(result.cutting_of_labels.tolist())
        if self._link.n_cut_faces > self._n_faces:
            faces = self._link.cut_faces(since=self._n_faces)
            self._n_faces += faces.n
            self.cut.take(faces)
            if all(each.holds for _, each in self._graspers):
                self._area_held += float(faces.areas.sum())
            self._pieces.look(self._link)
        self._look_at_strain()
        self._look_at_target(simulation)

    def _look_at_strain(self) -> None:
        """Look where the tissue is stretched too far now, if it is in this process."""
        if self._tissue is not None:
            for strain in self._strains:
                strain.look(self._tissue)

    def _look_at_target(self, simulation: Simulation) -> None:
        """Look how much of the target its camera sees, if the tissue is in this process."""
        if self._exposure is not None and self._tissue is not None:
            self._exposed = self._exposure.look(self._tissue, simulation)

    def terms(self) -> dict[str, float]:
        """Return the terms as of the last control step, by name, in SI units.

        Those that are not known are left out: without a plan, a target, limits of strain or a
        camera; and strain and what is exposed where the tissue is in another process.
        """
        task, hands = self._yardstick.task, self.hands
        found = _terms_of_cut(self.cut, self.plan)
        if task.spare:
            found |= {
                "spared": float(self.cut.is_spared),
                "spared_area": float(self.cut.spared_area.sum()),
            }
            if self.cut.area > 0.0:
                found["spared_distance"] = float(self.cut.spared_distance.min())
        if self._strains and self._tissue is not None:
            found["strain_above"] = sum(each.volume for each in self._strains)
        found["pieces"] = float(self._pieces.n)
        if task.target is not None:
            found |= {"removed": self._pieces.removed, "healthy": self._pieces.healthy}
        found |= {
            "force": max(each.force for each in hands),
            "force_above": max(each.force_above for each in hands),
            "impulse": sum(each.impulse for each in hands),
            "path_length": sum(each.path_length for each in hands),
            "jerk": max(each.jerk for each in hands),
            "exposed": self._exposed,
            "time": self._time,
            "work": self._work[0],
        }
        if self._graspers and self.cut.area > 0.0:
            found["held"] = self._area_held / self.cut.area
        for each in hands:
            if each.can_hold:
                found[f"{each.name}_held"] = each.held
                found[f"{each.name}_dropped"] = float(each.dropped)
        return {name: value for name, value in found.items() if value is not None}

    def failed(self, terms: Mapping[str, float] | None = None) -> list[str] | None:
        """Return the conditions of success that do not hold now; None where there are none.

        A term that is not known does not hold.

        Args:
            terms: What `terms` returned; None: as it does now.
        """
        task, terms = self._yardstick.task, self.terms() if terms is None else terms
        asked = _asked(task.success)
        if not asked and task.seconds is None:
            return None
        found = [name for name, bound in asked.items() if not _holds(name, terms.get(name), bound)]
        late = task.seconds is not None and self._time > task.seconds
        return [*found, "seconds"] if late else found

    def figures(self) -> dict[str, Any]:
        """Return the terms as of the last control step, for `summary.json`."""
        task, cut, failed = self._yardstick.task, self.cut, self.failed()
        terms, asked = self.terms(), _asked(task.success)
        unknown = [name for name in asked if name not in terms]
        known = [name for name in failed or [] if name not in unknown]
        is_known = failed is not None and (known or not unknown)
        return {
            "kind": task.kind,
            "success": not known if is_known else None,
            "failed": known,
            "unknown": unknown,
            "asked": dict(asked),
            "terms": terms,
            "planned_area_m2": None if self.plan is None else self.plan.area,
            "tolerance_m": task.tolerance,
            "area_by_blade_m2": float(cut.area_of_cause[0]),
            "area_finished_m2": float(cut.area_of_cause[1]),
            "spared": [
                {
                    "label": part.name,
                    "margin_m": part.margin,
                    "cut_area_m2": float(cut.spared_area[i]),
                    "distance_m": float(cut.spared_distance[i]) if cut.area > 0.0 else None,
                }
                for i, part in enumerate(self._yardstick.spared)
            ],
            "strains": [
                {"label": row.name, "limit": row.limit, "volume_m3": term.volume}
                for row, term in zip(self._yardstick.strains, self._strains, strict=True)
                if self._tissue is not None
            ],
            "instruments": [_figures_of_hand(each) for each in self.hands],
            "work_of_blade_j": self._work[0],
            "work_of_cutting_j": self._work[1],
            "work_of_cutting_by_label_j": list(self._work_of_labels),
        }


def _tissue_of(simulation: Simulation) -> Tissue | None:
    """Return the tissue of a simulation; None where it is in another process."""
    link = simulation.link
    return link.tissue if isinstance(link, InProcessLink) else None


def _exposure_of(yardstick: Yardstick, simulation: Simulation, body: Snapshot) -> Exposure | None:
    """Return what looks at the target of a task; None where it has no camera.

    Raises:
        UsageError: there is no such camera.
    """
    name, scene = yardstick.task.camera, simulation.scene
    if name is None:
        return None
    views = () if scene is None else scene.views
    return Exposure(TaskCamera(name, views, simulation.arm.model), body, yardstick.target)


def _terms_of_cut(cut: CutTerms, plan: Plan | None) -> dict[str, float | None]:
    """Return the terms of what was cut of a plan, and beside it."""
    if plan is None:
        return {"cut_area": cut.area}
    return {
        "cut_area": cut.area,
        "covered": cut.covered,
        "off_plan": cut.off_plan,
        "path_error": cut.path_error,
        "path_error_largest": cut.largest_error,
        "depth_error": cut.depth_error,
    }


def _asked(success: SuccessTable) -> Mapping[str, float]:
    """Return the conditions of success that are given, by the name of their term."""
    given = {name: getattr(success, name) for name in success.__struct_fields__}
    return {name: float(bound) for name, bound in given.items() if bound is not None}


def _holds(name: str, value: float | None, bound: float) -> bool:
    """Return whether a condition holds; one of a term that is not known does not."""
    if value is None:
        return False
    if name == "spared":
        return value >= bound
    return value >= bound if name in _AT_LEAST else value <= bound


def _figures_of_hand(hand: HandTerms) -> dict[str, Any]:
    """Return the figures of an instrument."""
    return {
        "name": hand.name,
        "force_n": hand.force,
        "force_limit_n": hand.limit,
        "force_above_n": hand.force_above,
        "impulse_ns": hand.impulse,
        "path_length_m": hand.path_length,
        "jerk_m_s3": hand.jerk,
        "held": hand.held,
        "dropped": hand.dropped if hand.can_hold else None,
    }
