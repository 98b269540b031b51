"""Write what the index of pages simulates: python tools/wasm/make_example.py [--check].

With ``--check`` nothing is written: what is there has to be what is made, and otherwise this ends
with 1.
"""

import json
import sys

from dess.reports.pages.index import EXAMPLE
from dess.reports.pages.panel import describe_example


def main() -> int:
    """Make the example, and write or compare it."""
    text = json.dumps(describe_example()) + "\n"
    if "--check" not in sys.argv[1:]:
        EXAMPLE.write_text(text, "utf-8")
        print(f"{EXAMPLE.name}: {len(text)} characters")
        return 0
    if EXAMPLE.read_text("utf-8") != text:
        print("The example of the index is not what is made: run nox -s wasm")
        return 1
    print("The example of the index is what is made.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
