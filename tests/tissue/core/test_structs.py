"""`Arrays`: kernels read and write the fields of a struct."""

import numpy as np
import pytest

from tissue import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, FloatCell, IntCell, Vectors
from tissue.core.vec3 import Vec3

pytestmark = pytest.mark.kernel


class Inner(Arrays):
    values: FloatArray
    weight: float


class Field(Arrays):
    values: FloatArray
    direction: Vec3


class Outer(Arrays):
    numbers: IntArray
    inner: Inner
    table: FloatArray
    flags: np.ndarray


def example(n=3):
    return Outer(
        numbers=np.arange(n),
        inner=Inner(values=np.linspace(0.0, 1.0, n), weight=2.5),
        table=np.arange(2.0 * n).reshape(n, 2),
        flags=np.array([True, False, True]),
    )


@kernel
def summed(outer):
    """Return a sum over every field, including those of a nested struct."""
    total = 0.0
    for i in range(len(outer.numbers)):
        total += outer.numbers[i] + outer.inner.weight * outer.inner.values[i]
    for i in range(outer.table.shape[0]):
        for j in range(outer.table.shape[1]):
            total += outer.table[i, j]
    if outer.flags[0] and not outer.flags[1]:
        total += 100.0
    return total


@kernel
def write(outer):
    outer.table[1, 1] = -1.0
    outer.inner.values[0] = 7.0


def test_a_kernel_reads_every_kind_of_field():
    assert summed(example()) == pytest.approx(3 + 2.5 * 1.5 + 15 + 100)


def test_a_kernel_writes_into_the_arrays_themselves():
    outer = example()
    write(outer)
    assert outer.table[1, 1] == -1.0
    assert outer.inner.values[0] == 7.0


def test_replaced_keeps_the_other_fields_and_does_not_change_the_original():
    first = example()
    second = first.replaced(numbers=np.array([10, 20]))
    assert second.inner is first.inner
    assert second.table is first.table
    assert len(first.numbers) == 3


@pytest.mark.parametrize(
    "fields", [{}, {"values": np.zeros(2)}, {"values": 0, "weight": 1, "x": 2}]
)
def test_missing_and_unknown_fields_are_refused(fields):
    with pytest.raises(TypeError, match="Inner takes"):
        Inner(**fields)


def test_an_array_with_gaps_is_refused():
    with pytest.raises(TypeError, match="contiguous"):
        Inner(values=np.zeros(10)[::2], weight=1.0)


def test_a_field_of_another_type_than_before_is_refused():
    example()
    with pytest.raises(TypeError, match="other types"):
        Inner(values=np.zeros(3, dtype=np.int64), weight=1.0)


class Counter(Arrays):
    values: FloatArray
    n: IntCell
    total: FloatCell


class Holder(Arrays):
    counter: Counter


class Frame(Vectors):
    origin: Vec3
    axis: Vec3


@kernel
def count_up(holder, by):
    for i in range(len(holder.counter.values)):
        holder.counter.n += 1
        holder.counter.total += by * holder.counter.values[i]
    return holder.counter.n


@kernel
def along(frame, distance):
    return frame.origin.x + distance * frame.axis.z


def test_kernels_and_python_see_the_same_cells():
    counter = Counter(values=np.array([1.0, 2.0]), n=5, total=0.5)
    holder = Holder(counter=counter)
    assert count_up(holder, 2.0) == 7
    assert (counter.n, counter.total) == (7, 6.5)
    counter.n, counter.total = 0, -1.0
    assert count_up(holder, 1.0) == 2
    assert (counter.n, counter.total) == (2, 2.0)


def test_a_replaced_struct_has_cells_of_its_own():
    first = Counter(values=np.ones(1), n=1, total=0.0)
    second = first.replaced(values=np.ones(3))
    second.n = 9
    assert (first.n, second.n) == (1, 9)


def test_a_struct_of_vectors_needs_them_all():
    with pytest.raises(TypeError, match="origin"):
        Frame(Vec3(1.0, 0.0, 0.0))


def test_a_struct_of_vectors_is_made_of_vectors_or_of_their_numbers():
    made = Frame(Vec3(1.0, 2.0, 3.0), Vec3(4.0, 5.0, 6.0))
    read = Frame.of_numbers((1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    for frame in (made, read):
        assert (frame.origin, frame.axis) == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
        assert along(frame, 2.0) == 13.0
    with pytest.raises(AttributeError, match="no end"):
        _ = made.end


@kernel
def along_field(field, i):
    return field.values[i] * field.direction.y


def test_a_kernel_reads_a_vector_beside_arrays():
    field = Field(values=np.array([1.0, 2.0]), direction=Vec3(0.0, 3.0, 0.0))
    assert along_field(field, 1) == 6.0


def test_numbers_that_do_not_fit_a_struct_of_vectors_are_refused():
    for numbers in ((1.0,) * 5, (1.0,) * 5 + ("one",)):
        with pytest.raises(TypeError):
            Frame.of_numbers(numbers)


class Rows(Arrays):
    points: FloatArray = sized("rows", 3)
    first: IntArray = sized("rows", fill=-1)
    shape: FloatArray = sized((4, "blocks"), is_for_vectors=True)
    n: IntCell
    weight: float


def test_a_struct_is_made_from_the_sizes_of_its_arrays_and_grows_by_them():
    rows = Rows.new({"rows": 2, "blocks": 8}, real=np.float32, weight=0.5)
    assert (rows.n, rows.weight, rows.first.tolist()) == (0, 0.5, [-1, -1])
    assert (rows.points.dtype, rows.shape.dtype) == (np.float64, np.float32)
    assert rows.shape.shape == (32,) and rows.shape.ctypes.data % 64 == 0
    rows.n, rows.points[1, 2] = 1, 7.0
    larger = rows.grown({"rows": 3})
    assert (larger.n, larger.first.tolist()) == (1, [-1, -1, -1])
    assert larger.points.shape == (3, 3) and larger.points[1, 2] == larger.points.sum() == 7.0
    assert larger.shape is rows.shape
