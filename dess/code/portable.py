"""Functions of the C library on arrays, with the same bits on every processor.

NumPy's own differ in their last bits between processors with and without AVX-512, and with them
records and decisions would.
"""

import math

import numpy as np

exp = np.vectorize(math.exp, otypes=[float])
log10 = np.vectorize(math.log10, otypes=[float])
