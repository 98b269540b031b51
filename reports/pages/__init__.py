"""Pages: notebooks are run and rendered as HTML files, which ``dess verify`` can check."""

import sys

# The library nbformat imports jsonschema, which compiles grammars for addresses if it finds this
# library. It takes longer than most pages, and no schema of a notebook has an address.
sys.modules["rfc3987_syntax"] = None  # type: ignore[assignment]
