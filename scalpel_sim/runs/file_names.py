"""Names of the files of a run, in its folder."""

SUMMARY = "summary.json"
FORCES = "forces.csv"
PLOT = "force.png"
ENERGY_PLOT = "energy.png"
INITIAL = "initial.vtu"
FINAL = "final.vtu"
REPLAY = "replay.html"
REPORT = "report.html"
SCENE = "scene.toml"
STROKE = "stroke.csv"
"""Motion of the blade in a hand. A scripted run leaves it, and the files of graspers: they may be
the very ones that are done again."""
PLAN = "plan.npz"
"""Plan by which a run that a hand led is scored: that of the strokes which the hand replaced."""
RUN_FILES = (SCENE, SUMMARY, FORCES, PLOT, ENERGY_PLOT, INITIAL, FINAL, REPLAY, REPORT)
"""Names of all files that a run can write, besides `STROKE` and `PLAN`."""

REPLAY_FRAMES = "replay.part"
"""The frames of the replay, while the run continues."""

JOURNAL = "journal.part"
"""Notes of the run on itself, while it continues."""

CHECKPOINT_FILES = ("checkpoint_a.bin", "checkpoint_b.bin")
"""Names of the files: each checkpoint replaces the older one."""

PASSING_FILES = (*CHECKPOINT_FILES, REPLAY_FRAMES, JOURNAL)
"""Names of files that are there until a run is complete."""


def grasp_file(name: str) -> str:
    """Return the name of the file of what a hand did with a grasper."""
    return f"grasper_{name}.csv"
