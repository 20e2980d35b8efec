"""Ends the record of a hand whose run was killed, so that it reads as one that has ended."""

from pathlib import Path

from tissue import whole_file


def end_record(path: Path, t_end: float, n_bytes: int | None = None) -> None:
    """Cut off a last line that is not whole, and have the last pose last until a time.

    Until then the hand rested, or it would have left another row.

    Args:
        path: `stroke.csv`, or the file of a grasper.
        t_end: Simulated time [s].
        n_bytes: How much of it is kept [bytes]; None: all.

    Raises:
        OSError: the file cannot be read or written.
    """
    text = path.read_bytes()[:n_bytes].decode("ascii")
    lines = [line for line in text.splitlines(True) if line.endswith("\n")]
    if len(lines) > 1:
        last, _, pose = lines[-1].partition(",")
        if float(last) < t_end:
            lines.append(f"{t_end!r},{pose}")
    with whole_file(path) as unfinished:
        unfinished.write_text("".join(lines), "ascii")
