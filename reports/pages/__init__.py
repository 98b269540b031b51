"""Pages: notebooks are run and rendered as HTML files, which ``dess verify`` can check."""

import sys

# nbformat imports jsonschema, which compiles grammars of web addresses if it finds rfc3987_syntax.
# That takes longer than most pages, and no schema of a notebook has an address.
sys.modules["rfc3987_syntax"] = None  # type: ignore[assignment]
