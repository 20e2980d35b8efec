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
SegmentNumbers = tuple[float, float, float, float, float, float, float, float, float]
"""Tip [m], heel [m] and forward direction of a blade."""
Arrival = tuple[bool, SegmentNumbers, Axes, Six]
EnergyNumbers = tuple[float, float, float, float, float, float, float, float, float]

ENERGY_TOLERANCE = 5e-7
"""Energy [J] that may be missing before the controller acts. At 1 kHz a wrench is half a frame
late, by which a blade that moves at v = 50 mm/s through tissue of K = 400 N/m gains this much in a
frame: K v^2 dt^2 / 2. With zero the controller would correct rounding errors."""


SHORTEST_EDGE = 1e-6
"""Shortest cutting edge [m]: a shorter one has no direction to align a swept box with."""

LARGEST_COSINE = 0.99
"""Largest cosine of the angle between `forward` and the edge. `forward` should be across the edge
(0); at less than eight degrees the plane of the blade is ill-conditioned."""

UNIT_TOLERANCE = 1e-6
"""Largest difference of the length of `forward` from 1: the accuracy of single precision."""

MAX_PLAUSIBLE_SPEED = 100.0
"""Largest plausible speed of the tip of a blade [m/s]: ten times that of a hand. Faster, the arm
was put elsewhere or diverges, and the blade would pass through the tissue in a frame."""

MAX_PLAUSIBLE_TURN = 0.5 * math.pi
"""Largest plausible turn of a blade in a frame [rad]: beyond, its path is a guess."""

CLEARLY = 0.99
"""Share of a limit up to which a value is within it without an exact test. Square roots here and
`math.hypot` there differ by 1e-15."""


def arrival(
    given: SegmentNumbers, origin: Three, tip_t0: Three, axes_t0: Axes, dt: float
) -> Arrival:
    """Return the pose of a blade at the end of a frame, and its motion in the frame.

    Args:
        given: The blade.
        origin: Origin of the frame of the result in that of the blade [m]; their axes are the same.
        tip_t0: Tip at the start of the frame [m].
        axes_t0: Axes then.
        dt: Length of the frame [s].

    Returns:
        Whether pose and motion are clearly plausible: else they need `expect_plane` and
        `expect_plausible_motion`, which have messages. Then the blade; its axes; and the
        translation of its tip [m] with the rotation vector [rad], by less than half a turn, that
        carries edge and flat of the first pose to those of the second. Without a plane the last
        two mean nothing.
    """
    tx, ty, tz, hx, hy, hz, fx, fy, fz = given
    x, y, z = origin
    tx, ty, tz, hx, hy, hz = tx - x, ty - y, tz - z, hx - x, hy - y, hz - z
    blade = (tx, ty, tz, hx, hy, hz, fx, fy, fz)
    ex, ey, ez = hx - tx, hy - ty, hz - tz
    length, forward = math.sqrt(ex * ex + ey * ey + ez * ez), fx * fx + fy * fy + fz * fz
    if not 0.0 < length < math.inf:
        return False, blade, axes_t0, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    size = 1.0 / length
    ex, ey, ez = ex * size, ey * size, ez * size
    along = ex * fx + ey * fy + ez * fz
    fx, fy, fz = fx - along * ex, fy - along * ey, fz - along * ez
    across = math.sqrt(fx * fx + fy * fy + fz * fz)
    if not 0.0 < across < math.inf:
        return False, blade, axes_t0, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    size = 1.0 / across
    fx, fy, fz = fx * size, fy * size, fz * size
    nx, ny, nz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    ax, ay, az, bx, by, bz, cx, cy, cz = axes_t0
    # Over the three axes, the sum of a x u is the axis of rotation times twice the sine, and the
    # sum of a . u is one plus twice the cosine.
    sx = (ay * ez - az * ey) + (by * fz - bz * fy) + (cy * nz - cz * ny)
    sy = (az * ex - ax * ez) + (bz * fx - bx * fz) + (cz * nx - cx * nz)
    sz = (ax * ey - ay * ex) + (bx * fy - by * fx) + (cx * ny - cy * nx)
    trace = (ax * ex + ay * ey + az * ez) + (bx * fx + by * fy + bz * fz)
    trace += cx * nx + cy * ny + cz * nz
    sine = 0.5 * math.sqrt(sx * sx + sy * sy + sz * sz)
    half = 0.5 * math.atan2(sine, 0.5 * (trace - 1.0)) / sine if sine > 0.0 else 0.5
    x, y, z = tip_t0
    x, y, z, u, v, w = tx - x, ty - y, tz - z, half * sx, half * sy, half * sz
    is_plausible = (
        CLEARLY * length > SHORTEST_EDGE
        and abs(forward - 1.0) < CLEARLY * UNIT_TOLERANCE
        and abs(along) < CLEARLY * LARGEST_COSINE
        and math.sqrt(x * x + y * y + z * z) < CLEARLY * MAX_PLAUSIBLE_SPEED * dt
        and math.sqrt(u * u + v * v + w * w) < CLEARLY * MAX_PLAUSIBLE_TURN
    )
    axes = (ex, ey, ez, fx, fy, fz, nx, ny, nz)
    return is_plausible, blade, axes, (x, y, z, u, v, w)


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
        `wanted` on the motion; the most that the latter may be; the energy after the frame if
        `wanted` is felt [J]; and the sizes of force [N] and torque [N m] of `wanted`, to rounding.
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
    force = math.sqrt(bx * bx + by * by + bz * bz)
    torque = math.sqrt(bu * bu + bv * bv + bw * bw)
    return energy, work_at_start, given, spent, power, most, energy - 0.5 * both, force, torque


_F = TypeVar("_F", bound=Callable[..., object])


class _Callable(Protocol[_F]):
    call: _F


class _Plain(Generic[_F]):
    def __init__(self, function: _F) -> None:
        self.call = function


class Arithmetic(NamedTuple):
    """These functions, each as `name.call`."""

    arrival: "_Callable[Callable[[SegmentNumbers, Three, Three, Axes, float], Arrival]]"
    """`arrival`."""
    balance: "_Callable[Callable[[Six, Six, Six, float, float, float], EnergyNumbers]]"
    """`energy_balance`."""


PLAIN = Arithmetic(_Plain(arrival), _Plain(energy_balance))
"""In Python."""


@functools.cache
def compiled_arithmetic() -> Arithmetic:
    """Return them compiled, for floats: a process with a tissue has loaded the compiler."""
    from tissue.support import SameTypes, kernel

    found = Arithmetic(SameTypes(kernel(arrival)), SameTypes(kernel(energy_balance)))
    zero, six = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    found.arrival.call((*zero, *six), zero, zero, (*zero, *six), 0.0)
    found.balance.call(six, six, six, 0.0, 0.0, 0.0)
    return found
