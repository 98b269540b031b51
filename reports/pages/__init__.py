"""Pages: notebooks are run and rendered as HTML files, which ``dess verify`` can check."""
