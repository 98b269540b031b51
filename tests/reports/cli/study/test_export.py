"""``dess study export``: a results folder with its page as one file."""

from zipfile import ZipFile

import pytest

from tests.reports.here import notebooks_here


@pytest.fixture
def run(dess):
    """The command, after a study has been run; pages are made in this process."""
    assert dess("study", "run", "trial.toml", "--out", "out")[0] == 0
    with notebooks_here():
        yield dess


def test_results_and_page_are_bundled(run, refusal, tmp_path):
    """The page is that of dess report, and may be given."""
    code, out, err = run("study", "export", "out", "--crate", "a.zip", "--license", "cc0-1.0")
    assert (code, out) == (0, "a.zip: 20 missions with study-trial.html, licence CC0-1.0\n")
    with ZipFile("a.zip") as archive:
        archive.extractall("unpacked")
    assert run("study", "diff", "out", "unpacked/results")[1] == "identical: 20 missions\n"
    page = tmp_path / "unpacked" / "study-trial.html"
    assert run("verify", page)[0] == 0
    arguments = ("--crate", "b.zip", "--license", "CC0-1.0", "--page", page)
    assert run("study", "export", "out", *arguments) == (0, out.replace("a.zip", "b.zip"), "")
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    (tmp_path / "other.html").write_text(f"{page.read_text('utf-8')}<br>", "utf-8")
    line = refusal("study", "export", "out", "--crate", "c.zip", "--page", "other.html")
    assert "does not show the results" in line


# Arguments, and what the line on stderr must name.
BAD = {
    "out": "Missing option '--crate'",
    "out --crate out": "--crate: out is not a zip file; allowed: .zip",
    "out --crate none/a.zip": "none/a.zip: cannot be written",
    "out --crate a.zip --license mine": "--license: 'mine' is unknown",
    "out --crate a.zip --page none.html": "none.html: no such file",
    "out --crate a.zip --page small.toml": "small.toml: does not show the results of this study",
}


@pytest.mark.usefixtures("run")
def test_what_cannot_be_exported_gets_one_line_and_leaves_nothing(refusal):
    for arguments, words in BAD.items():
        assert words in refusal("study", "export", *arguments.split())
