"""The former name of ``dess.model.guard``, which can be imported for one more release."""

import sys
import warnings

from dess.model import guard

warnings.warn("dess.guard has become dess.model.guard", DeprecationWarning, stacklevel=2)
sys.modules[__name__] = guard
