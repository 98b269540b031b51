"""Notices on stderr."""

from numba import njit

from reports.cli import console


def test_compilation_is_announced_once(capsys):
    double = njit(lambda x: 2 * x)
    with console.compile_notice():
        assert (double(1), double(1.5)) == (2, 3.0)  # compiled twice
    assert capsys.readouterr().err == "compiling the simulator (first run only) ...\n"
    with console.compile_notice():
        assert double(2) == 4
    assert capsys.readouterr().err == ""
