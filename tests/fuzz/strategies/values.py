"""Values that are written into files and onto command lines: odd, huge, hostile, and plain ones."""

import json

from hypothesis import strategies as st

LONG = 100_000  # characters, digits or levels
SCRIPTS = (
    "<script>document.title='ran'</script>",
    "</script><img src=x onerror=alert(1)>",
    "[x](javascript:alert(1))",
    "`x` **y** |z| $a$ \\begin{x}",
    "{{ 7*7 }}{% raw %}",
    "$(touch ran)`touch ran`;touch ran|touch ran",
    "%s%n{0}{x!r}",
    "=cmd|'/c calc'!A1",
    "__import__('os').system('touch ran')",
)
_CONTROL = ("\x1b[31mred\x1b[0m", "\x1b]0;title\x07", "a\r\nb", "\x00", "\u202egnp.exe", "\x9b2J")
_NAMES = ("../../ran", "..", ".", "~", "-", "--help", "/", "//x", "nul:", "a" * 300, "é" * 200)
_NODES = ("/dev/zero", "/dev/full", "/dev/stdin", "/proc/self/mem", "/proc/kmsg", "/", "/etc")

positions = st.integers(0, 60) | st.integers(0, 10**6)
long_texts = st.sampled_from(["x", "é", "[", "9", "\n", "<b>", "\\", "\u202e"]).map(
    lambda text: text * LONG
)
texts = st.one_of(
    st.text(max_size=20),
    st.sampled_from(SCRIPTS),
    st.sampled_from(_CONTROL),
    st.sampled_from(_NAMES),
    st.sampled_from(_NODES),
    st.characters(categories=["Cc", "Cf", "Cs", "Zl"]).map(lambda char: f"a{char}b"),
)
numbers = st.one_of(
    st.integers(-3, 3).map(str),
    st.integers(-(2**70), 2**70).map(str),
    st.floats().map(repr),
    st.sampled_from(["1e400", "1e-320", "-0.0", "1e9", "0x1F", "1_000", "2147483648", "1e308"]),
    st.integers(1, 5).map(lambda power: "9" * 10**power),
)
depths = st.sampled_from([5, 300, 2000, LONG])
# Nested values, in JSON or in TOML.
nested = st.one_of(
    depths.map(lambda depth: "[" * depth + "]" * depth),
    depths.map(lambda depth: '{"a":' * depth + "1" + "}" * depth),
    depths.map(lambda depth: "{a=" * depth + "1" + "}" * depth),
    depths.map(lambda depth: "[" * depth),
)


def quoted(text: str) -> str:
    """A text in quotes, which JSON and TOML both read; lone surrogates are escaped."""
    return json.dumps(text)


pairs = st.tuples(numbers, numbers).map(lambda pair: f"[{pair[0]}, {pair[1]}]")
_words = {
    "json": ["null", "true", "[]", "{}", '""', "[[]]", '{"": null}', "NaN", "-Infinity"],
    "toml": ["true", "[]", "{}", '""', "[[]]", "nan", "-inf", "1979-05-27", "07:32:00"],
}
_values = st.one_of(numbers, texts.map(quoted), pairs, long_texts.map(quoted), nested)
_many = st.integers(10, 10**5).map(lambda count: f"[{'0,' * count}0]")
_lists = st.lists(texts.map(quoted), max_size=4).map(lambda items: f"[{', '.join(items)}]")
json_values = st.one_of(_values, st.sampled_from(_words["json"]), _many)
toml_values = st.one_of(_values, st.sampled_from(_words["toml"]), _lists)
_actions = st.sampled_from(["replace", "replace", "replace", "remove", "rename", "insert"])
json_keys = texts.map(quoted)


@st.composite
def json_edits(draw: st.DrawFn) -> tuple[tuple[int, str, str], ...]:
    """One to three edits of a JSON document."""
    edits = []
    for _ in range(draw(st.sampled_from([1, 1, 1, 2, 3]))):
        action = draw(_actions)
        new = draw(json_keys if action == "rename" else json_values)
        edits.append((draw(positions), action, new))
    return tuple(edits)


@st.composite
def byte_edits(draw: st.DrawFn) -> tuple[tuple[int, bytes | None], ...]:
    """One to three edits of the bytes of a file."""
    new = st.none() | st.binary(min_size=1, max_size=8)
    place = st.integers(0, 200) | st.integers(0, 10**7)
    return tuple(draw(st.lists(st.tuples(place, new), min_size=1, max_size=3)))
