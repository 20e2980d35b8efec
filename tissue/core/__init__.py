"""Ground of the engine; only these modules import numba and llvmlite.

In the order in which they are best read:

    array_types      types of arrays, by their contents
    tetrahedral_mesh positions, tetrahedra, and their labels
    limits           bounds of requests to a tissue
    jit              the decorator that compiles kernels
    kernel_parts     kernels compiled once, as parts of others
    kernel_cache     compiled kernels on disk
    vec3             points and vectors of three numbers
    three_vectors    the edge of a blade, and a wrench
    lazy_fields      tuples whose fields are made on first use
    sized            shapes of the arrays of structs
    structs          structs of arrays that a kernel gets as one pointer
    hash_table       a hash table in arrays
    simd             vectors of eight doubles
    simd_rows        rows of arrays in such vectors, sums and comparisons
    simd_blocks      blocks of tetrahedra, in doubles or singles, and the logarithm
    thread_team      loops that threads share, and their atomic numbers
    memory_blocks    the memory of structs, copied at once
    attributes       the attributes of an object
    memento          a tree of objects at one time
    memento_reading  its plain form, written and read
"""
