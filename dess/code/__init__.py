"""Code: kernels that numba compiles, and hashes of the sources that results depend on."""
