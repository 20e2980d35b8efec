"""Ground of the engine: the compiler, structs of arrays, points and vectors of eight doubles."""
