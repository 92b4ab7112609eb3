"""How kernels are compiled with numba: the decorator, the cache on disk, SIMD numbers, vector algebra."""
