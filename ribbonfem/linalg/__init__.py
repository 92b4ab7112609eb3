"""Linear algebra of the hot loops: banded matrices, operations on arrays."""
