"""Ground of the engine; only these modules import numba and llvmlite.

In the order in which they are best read:

    array_types    types of arrays, by what they hold
    limits         how much may be asked of a tissue
    jit            the decorator that compiles kernels
    lazy_fields    tuples whose fields are made when they are asked for
    vec3           points and vectors of three numbers
    structs        structs of arrays that a kernel gets as one pointer
    hash_table     a hash table in arrays
    simd           vectors of eight doubles
    simd_gather    gathers of such vectors from arrays
    atomics        numbers that threads share
    thread_team    loops that threads share
"""
