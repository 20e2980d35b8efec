"""`BlockTree`: things that may touch, by blocks of eight that are near each other and face alike.

Whoever asks gives a box and a direction. A block is skipped where its box is elsewhere, or where
all that is in it faces as the asking one does: two parts of one lip do not touch each other. Eight
blocks are a group, which is skipped alike. So what lies apart costs a few tests.

The tree is made anew for each update of the pairs, by sorting: a tenth of what the asking takes.
"""

import math

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, aligned, filled, lanes, load_lanes
from tissue.core.simd_gather import larger, larger_bits
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, add, dot, norm, scale, store, vec3
from tissue.geometry.aabb import Aabb, box_at, empty_box, store_box, with_point

N_ROWS = 9
"""Rows of eight numbers for each eight of a level."""

HIGH, DIRECTION = 3, 6
"""The first of the rows for the highest corners of boxes, behind those for the lowest; and for what
faces alike: the middle of all directions, over the cosine with an asking one above which nothing
there can touch, or 0."""

_BITS = 4
"""Bits of the place along each axis by which things are sorted."""

_BYTE = 256

_MARGIN = 1e-9
"""Margin of a cosine for rounding."""


class Level(Arrays):
    """Things, blocks or groups, eight at a time: what each encloses.

    Of each eight there are nine rows of eight numbers: the lowest corners of
    boxes, the highest (`HIGH`), and what faces alike (`DIRECTION`).
    """

    rows: FloatArray
    """The rows, shape (72 * eights,). Where there is nothing, the lowest corner is
    infinite."""
    least: FloatArray
    """Least cosine between a direction in it and its middle; -1 if one has no direction. Shape
    (8 * eights,)."""
    middle: FloatArray
    """Unit vector along the mean direction of each, shape (8 * eights, 3)."""


class BlockTree(Arrays):
    """The things, as they were entered and in the order of their blocks."""

    n_items: IntCell
    """Number of things."""
    item: IntArray
    """The things as they were entered, shape (capacity,)."""
    low: FloatArray
    """Lowest corner of the box of each [m], shape (capacity, 3)."""
    high: FloatArray
    """Highest corner of that box [m], shape (capacity, 3)."""
    direction: FloatArray
    """Unit vector out of the body at each, or 0; shape (capacity, 3)."""
    order: IntArray
    """Places of the things in the order of the blocks, shape (capacity,)."""
    key: IntArray
    """Scratch: what things are sorted by, shape (capacity,)."""
    spare: IntArray
    """Scratch of the sorting, shape (capacity,)."""
    count: IntArray
    """Scratch of the sorting, shape (257,)."""
    things: Level
    blocks: Level
    groups: Level
    found: IntArray
    """What the last question found, shape (capacity + 8,)."""


def _new_level(n: int) -> Level:
    """Return a level with room for `n` and whole eights."""
    n = filled(n)
    return Level(rows=aligned(N_ROWS * n), least=np.zeros(n), middle=np.zeros((n, 3)))


def new_block_tree(capacity: int) -> BlockTree:
    """Return an empty tree with room for that many things."""
    of_items = ("item", "order", "key", "spare")
    n_blocks = capacity // WIDTH + 1
    return BlockTree(
        n_items=0,
        **{name: np.zeros(capacity, np.int64) for name in of_items},
        **{name: np.zeros((capacity, 3)) for name in ("low", "high", "direction")},
        count=np.zeros(_BYTE + 1, np.int64),
        things=_new_level(capacity),
        blocks=_new_level(n_blocks),
        groups=_new_level(n_blocks // WIDTH + 1),
        found=np.zeros(capacity + WIDTH, np.int64),
    )


@inlined
def enter(tree: BlockTree, item: int, box: Aabb, direction: Vec3) -> None:
    """Enter a thing; `arrange` is called after the last.

    Args:
        tree: Written.
        item: Its number.
        box: The box around it [m].
        direction: Where it faces, of any length.
    """
    i = tree.n_items
    tree.n_items += 1
    tree.item[i] = item
    store_box(tree.low, tree.high, i, box)
    store(tree.direction, i, _unit(direction))


@kernel
def arrange(tree: BlockTree, alike: float) -> None:
    """Put what was entered into blocks.

    Args:
        tree: Written.
        alike: Cosine between two directions above which things cannot touch, from 0 to 1.
    """
    _write_keys(tree)
    _sort_by_byte(tree, 0)
    _sort_by_byte(tree, 8)
    for i in range(tree.n_items):
        at = tree.order[i]
        box, direction = box_at(tree.low, tree.high, at), vec3(tree.direction, at)
        _write_hull(tree.things, i, box, direction, 1.0, alike)
    _end_level(tree.things, tree.n_items)
    blocks, groups = _eights(tree.n_items), _eights(_eights(tree.n_items))
    for block in range(blocks):
        _enclose_things(tree, block, alike)
    _end_level(tree.blocks, blocks)
    for group in range(groups):
        _enclose_blocks(tree, group, blocks, alike)
    _end_level(tree.groups, groups)


@inlined
def _eights(n: int) -> int:
    """Return how many times eight holds `n`."""
    return (n + WIDTH - 1) // WIDTH


@kernel
def find_near(tree: BlockTree, box: Aabb, direction: Vec3, length: float) -> int:
    """Write what overlaps a box to `found`, less what faces alike; return how many there are.

    What faces alike to within rounding may be found, too.

    Args:
        tree: `found` is written.
        box: Where to search.
        direction: Direction out of the body where it is asked for.
        length: Length of that; inf if it does not matter.
    """
    n = 0
    for first in range(_eights(_eights(_eights(tree.n_items)))):
        groups = _near(tree.groups, first, box, direction, length)
        for i in range(WIDTH * (groups > 0)):
            if groups >> i & 1 == 0:
                continue
            group = WIDTH * first + i
            blocks = _near(tree.blocks, group, box, direction, length)
            for k in range(WIDTH * (blocks > 0)):
                if blocks >> k & 1 == 0:
                    continue
                block = WIDTH * group + k
                things = _near(tree.things, block, box, direction, length)
                if things == 0:
                    continue
                for q in range(min(WIDTH, tree.n_items - WIDTH * block)):
                    tree.found[n] = tree.item[tree.order[WIDTH * block + q]]
                    n += things >> q & 1
    return n


@inlined
def _near(level: Level, i: int, box: Aabb, direction: Vec3, length: float) -> int:
    """Return bits for what of eight may be asked for; see `find_near`.

    Args:
        level: What they enclose.
        i: Which eight.
        box: Where to search.
        direction: Direction out of the body where it is asked for.
        length: Length of that.
    """
    rows, at = level.rows, N_ROWS * WIDTH * i
    low, high = box.low, box.high
    apart = larger(
        _gap(rows, at, low.x, high.x),
        larger(_gap(rows, at + WIDTH, low.y, high.y), _gap(rows, at + 2 * WIDTH, low.z, high.z)),
    )
    along = (
        lanes(direction.x) * load_lanes(rows, at + DIRECTION * WIDTH)
        + lanes(direction.y) * load_lanes(rows, at + (DIRECTION + 1) * WIDTH)
        + lanes(direction.z) * load_lanes(rows, at + (DIRECTION + 2) * WIDTH)
    )
    is_out = larger_bits(apart, lanes(0.0)) | larger_bits(along, lanes(length))
    return ~is_out & (1 << WIDTH) - 1


@inlined
def _gap(rows: FloatArray, at: int, low: float, high: float) -> Lanes:
    """Return how far apart boxes are along an axis [m], negative where they overlap."""
    above = load_lanes(rows, at) - lanes(high)
    return larger(above, lanes(low) - load_lanes(rows, at + HIGH * WIDTH))


@kernel
def _write_keys(tree: BlockTree) -> None:
    """Write what things are sorted by: along which axis they face, then where they are.

    Places are interleaved bit by bit (Morton's order), so that what follows is near.
    """
    box = empty_box()
    for i in range(tree.n_items):
        box = with_point(box, vec3(tree.low, i))
    extent = max(box.high.x - box.low.x, max(box.high.y - box.low.y, box.high.z - box.low.z))
    last = (1 << _BITS) - 1
    per_metre = last / extent if extent > 0.0 else 0.0
    for i in range(tree.n_items):
        p = vec3(tree.low, i)
        a = int(per_metre * (p.x - box.low.x))
        b = int(per_metre * (p.y - box.low.y))
        c = int(per_metre * (p.z - box.low.z))
        key = 0
        for bit in range(_BITS):
            key |= (((a >> bit) & 1) << 2 | ((b >> bit) & 1) << 1 | ((c >> bit) & 1)) << 3 * bit
        tree.key[i] = key | _axis_of(vec3(tree.direction, i)) << 3 * _BITS
        tree.order[i] = i


@inlined
def _axis_of(direction: Vec3) -> int:
    """Return the number, from 0 to 5, of the axis along or against which a direction is most."""
    x, y, z = abs(direction.x), abs(direction.y), abs(direction.z)
    if x >= y and x >= z:
        return 0 if direction.x > 0.0 else 1
    if y >= z:
        return 2 if direction.y > 0.0 else 3
    return 4 if direction.z > 0.0 else 5


@kernel
def _sort_by_byte(tree: BlockTree, shift: int) -> None:
    """Sort the places by one byte of their keys; what is alike keeps its order."""
    count, order, spare = tree.count, tree.order, tree.spare
    for byte in range(_BYTE + 1):
        count[byte] = 0
    for i in range(tree.n_items):
        count[(tree.key[i] >> shift & _BYTE - 1) + 1] += 1
    for byte in range(1, _BYTE):
        count[byte] += count[byte - 1]
    for i in range(tree.n_items):
        byte = tree.key[order[i]] >> shift & _BYTE - 1
        spare[count[byte]] = order[i]
        count[byte] += 1
    for i in range(tree.n_items):
        order[i] = spare[i]


@kernel
def _enclose_things(tree: BlockTree, block: int, alike: float) -> None:
    """Enclose the things of a block."""
    box, total = empty_box(), Vec3(0.0, 0.0, 0.0)
    begin, end = WIDTH * block, min(WIDTH * (block + 1), tree.n_items)
    for i in range(begin, end):
        at = tree.order[i]
        box = with_point(with_point(box, vec3(tree.low, at)), vec3(tree.high, at))
        total = add(total, vec3(tree.direction, at))
    middle, least = _unit(total), 1.0
    for i in range(begin, end):
        least = min(least, dot(middle, vec3(tree.direction, tree.order[i])))
    _write_hull(tree.blocks, block, box, middle, least, alike)


@kernel
def _enclose_blocks(tree: BlockTree, group: int, n_blocks: int, alike: float) -> None:
    """Enclose the blocks of a group."""
    blocks, rows = tree.blocks, tree.blocks.rows
    box, total = empty_box(), Vec3(0.0, 0.0, 0.0)
    begin, end = WIDTH * group, min(WIDTH * (group + 1), n_blocks)
    for block in range(begin, end):
        at = N_ROWS * begin + block - begin
        low = Vec3(rows[at], rows[at + WIDTH], rows[at + 2 * WIDTH])
        at += HIGH * WIDTH
        high = Vec3(rows[at], rows[at + WIDTH], rows[at + 2 * WIDTH])
        box = with_point(with_point(box, low), high)
        total = add(total, vec3(blocks.middle, block))
    middle, least = _unit(total), 1.0
    for block in range(begin, end):
        # The angles of a direction to the block's and of that to the group's add up.
        own, beside = blocks.least[block], dot(middle, vec3(blocks.middle, block))
        both = own * beside - _sine_of(own) * _sine_of(beside)
        least = min(least, both if own > 0.0 and beside > 0.0 else -1.0)
    _write_hull(tree.groups, group, box, middle, least, alike)


@kernel
def _write_hull(level: Level, i: int, box: Aabb, middle: Vec3, least: float, alike: float) -> None:
    """Write what number `i` of a level encloses.

    All in it is within an angle `a` of its middle. What asks from within `b` of that middle is
    within a + b of all; so all is alike if that is within the angle of the cosine `alike`.

    Args:
        level: Written.
        i: Which.
        box: The box around it.
        middle: Unit vector along its mean direction.
        least: Least cosine between a direction in it and that.
        alike: As for `arrange`.
    """
    facing = 0.0
    if least > alike + _MARGIN:
        facing = 1.0 / (alike * least + _sine_of(alike) * _sine_of(least) + _MARGIN)
    rows, at = level.rows, N_ROWS * WIDTH * (i // WIDTH) + i % WIDTH
    low, high = box.low, box.high
    rows[at], rows[at + WIDTH], rows[at + 2 * WIDTH] = low.x, low.y, low.z
    at += HIGH * WIDTH
    rows[at], rows[at + WIDTH], rows[at + 2 * WIDTH] = high.x, high.y, high.z
    at += (DIRECTION - HIGH) * WIDTH
    rows[at], rows[at + WIDTH] = facing * middle.x, facing * middle.y
    rows[at + 2 * WIDTH] = facing * middle.z
    store(level.middle, i, middle)
    level.least[i] = least


@kernel
def _end_level(level: Level, n: int) -> None:
    """Let nothing be found behind the first `n`, up to whole eights."""
    for i in range(n, WIDTH * _eights(n)):
        for axis in range(3):
            level.rows[N_ROWS * WIDTH * (i // WIDTH) + axis * WIDTH + i % WIDTH] = math.inf


@inlined
def _unit(a: Vec3) -> Vec3:
    """Return the unit vector along another, 0 for 0."""
    length = norm(a)
    return scale(1.0 / length if length > 0.0 else 0.0, a)


@inlined
def _sine_of(cosine: float) -> float:
    """Return the sine of an angle up to a half turn."""
    return math.sqrt(max(1.0 - cosine * cosine, 0.0))
