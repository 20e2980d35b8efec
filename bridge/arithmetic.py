"""The arithmetic of a frame, in plain numbers: compiled where the tissue is in this process.

Python takes 1 us for each of these functions, and twice that where the tissue has filled the caches
since the last frame; compiled they take a quarter. A process without the tissue has no compiler.
"""

import functools
import math
from collections.abc import Callable, Sequence
from typing import Generic, NamedTuple, Protocol, TypeVar

Three = tuple[float, float, float]
"""A vector in plain numbers. As arrays the few of a frame take several times as long."""
Triple = Sequence[float]
"""Such a vector that may be a list."""
Six = tuple[float, float, float, float, float, float]
"""Force [N] and torque [N m]; or translation [m] and rotation vector [rad]."""
Axes = tuple[float, float, float, float, float, float, float, float, float]
"""Unit vectors along the edge from the tip, forward across it, and normal to the flat."""
EnergyNumbers = tuple[float, float, float, float, float, float, float]

ENERGY_TOLERANCE = 5e-7
"""Energy [J] that may be missing before the controller acts. At 1 kHz a wrench is half a frame
late, by which a blade that moves at v = 50 mm/s through tissue of K = 400 N/m gains this much in a
frame: K v^2 dt^2 / 2. With zero the controller would correct rounding errors."""


def axes_of(tip: Three, heel: Three, forward: Three) -> Axes:
    """Return the axes of a blade."""
    (tx, ty, tz), (hx, hy, hz), (fx, fy, fz) = tip, heel, forward
    ex, ey, ez = hx - tx, hy - ty, hz - tz
    size = 1.0 / math.sqrt(ex * ex + ey * ey + ez * ez)
    ex, ey, ez = ex * size, ey * size, ez * size
    along = ex * fx + ey * fy + ez * fz
    fx, fy, fz = fx - along * ex, fy - along * ey, fz - along * ez
    size = 1.0 / math.sqrt(fx * fx + fy * fy + fz * fz)
    fx, fy, fz = fx * size, fy * size, fz * size
    return ex, ey, ez, fx, fy, fz, ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx


def motion_between(tip_t0: Three, axes_t0: Axes, tip_t1: Three, axes_t1: Axes) -> Six:
    """Return the translation of the tip [m] and the rotation vector [rad] of a blade.

    The rotation carries edge and flat of the first pose to those of the second, by less than half
    a turn.
    """
    ax, ay, az, bx, by, bz, cx, cy, cz = axes_t0
    ux, uy, uz, vx, vy, vz, wx, wy, wz = axes_t1
    # Over the three axes, the sum of a x u is the axis of rotation times twice the sine, and the
    # sum of a . u is one plus twice the cosine.
    sx = (ay * uz - az * uy) + (by * vz - bz * vy) + (cy * wz - cz * wy)
    sy = (az * ux - ax * uz) + (bz * vx - bx * vz) + (cz * wx - cx * wz)
    sz = (ax * uy - ay * ux) + (bx * vy - by * vx) + (cx * wy - cy * wx)
    trace = (ax * ux + ay * uy + az * uz) + (bx * vx + by * vy + bz * vz)
    trace += cx * wx + cy * wy + cz * wz
    sine = 0.5 * math.sqrt(sx * sx + sy * sy + sz * sz)
    half = 0.5 * math.atan2(sine, 0.5 * (trace - 1.0)) / sine if sine > 0.0 else 0.5
    (x, y, z), (u, v, w) = tip_t0, tip_t1
    return u - x, v - y, w - z, half * sx, half * sy, half * sz


def energy_balance(
    felt: Six, wanted: Six, motion: Six, energy: float, work_at_start: float, work: float
) -> EnergyNumbers:
    """Return what `bridge.coupling.passivity.Passivity` knows of a frame before it acts.

    Args:
        felt: Force [N] and torque about the tip [N m] that the arm has felt since the last frame.
        wanted: Those that it is to feel from now on.
        motion: Motion of the arm's blade since the last frame.
        energy: Energy that the arm has put into the present contact [J].
        work_at_start: Work of the blade on the tissue when the contact began [J].
        work: That work now [J].

    Returns:
        Energy and work at the start of the contact, which may begin with this frame; the part of
        that work which the tissue has given back, as a negative number; the works of `felt` and
        `wanted` on the motion; the most that the latter may be; and the energy after the frame if
        `wanted` is felt [J].
    """
    ax, ay, az, au, av, aw = felt
    bx, by, bz, bu, bv, bw = wanted
    x, y, z, u, v, w = motion
    is_felt = ax != 0.0 or ay != 0.0 or az != 0.0 or au != 0.0 or av != 0.0 or aw != 0.0
    is_wanted = bx != 0.0 or by != 0.0 or bz != 0.0 or bu != 0.0 or bv != 0.0 or bw != 0.0
    if not (is_felt or is_wanted):
        energy, work_at_start = 0.0, work
    given = work - work_at_start
    if not given < 0.0:
        given = 0.0
    spent = ax * x + ay * y + az * z + au * u + av * v + aw * w
    power = bx * x + by * y + bz * z + bu * u + bv * v + bw * w
    left = energy - 0.5 * spent - given + ENERGY_TOLERANCE
    # While energy is left, both halves of the work are reserved. A deficit must be recovered in
    # the half that is being decided; reversing the last wrench is always enough, unless the
    # tissue has taken back what it returned.
    most = left
    if not left >= 0.0:
        most = 2.0 * left
        if -abs(spent) > most:
            most = -abs(spent)
    both = (ax + bx) * x + (ay + by) * y + (az + bz) * z
    both = both + (au + bu) * u + (av + bv) * v + (aw + bw) * w
    return energy, work_at_start, given, spent, power, most, energy - 0.5 * both


_F = TypeVar("_F", bound=Callable[..., object])


class _Callable(Protocol[_F]):
    call: _F


class _Plain(Generic[_F]):
    def __init__(self, function: _F) -> None:
        self.call = function


class Arithmetic(NamedTuple):
    """These functions, each as `name.call`."""

    axes: "_Callable[Callable[[Three, Three, Three], Axes]]"
    """`axes_of`."""
    motion: "_Callable[Callable[[Three, Axes, Three, Axes], Six]]"
    """`motion_between`."""
    balance: "_Callable[Callable[[Six, Six, Six, float, float, float], EnergyNumbers]]"
    """`energy_balance`."""


PLAIN = Arithmetic(_Plain(axes_of), _Plain(motion_between), _Plain(energy_balance))
"""In Python."""


@functools.cache
def compiled_arithmetic() -> Arithmetic:
    """Return them compiled, for floats: a process with a tissue has loaded the compiler."""
    from tissue.support import SameTypes, kernel

    found = Arithmetic(
        SameTypes(kernel(axes_of)),
        SameTypes(kernel(motion_between)),
        SameTypes(kernel(energy_balance)),
    )
    zero, along, across = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    axes = found.axes.call(zero, along, across)
    six = found.motion.call(zero, axes, zero, axes)
    found.balance.call(six, six, six, 0.0, 0.0, 0.0)
    return found
