"""The engine as a WebAssembly module, for pages: what it is made of, and the arrays that it takes.

``entry`` has the compiled functions of which ``nox -s wasm`` builds the module, ``image`` makes the
arrays of a scenario, and ``module`` reads the module. A page, or a program of any language with a
WebAssembly runtime, lays out the arrays of an image and calls the exports, as
``docs/reference/webassembly.md`` says.
"""
