import os
import re
import subprocess
import sys

import pytest

from scripts.cli import VERBS, main
from slam.navigation.policies import POLICIES
from slam.pipelines import PIPELINES
from worlds.loader import world_names

TWIN = [sys.executable, "-m", "scripts.cli"]


def error_of(capsys, *argv: str) -> str:
    """The one line that a refused command leaves."""
    assert main(list(argv)) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert re.fullmatch(r"twin: .+\n", err)
    return err


@pytest.mark.parametrize("argv", [[], ["--help"], ["-h"], ["help"]])
def test_the_overview_has_a_line_for_every_verb(argv, capsys):
    assert main(argv) == 0
    overview = capsys.readouterr().out
    for verb in VERBS:
        assert re.search(rf"^  {verb} +\w.{{20,}}$", overview, re.MULTILINE)


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_explains_itself(verb, capsys):
    assert main([verb, "--help"]) == 0
    out, err = capsys.readouterr()
    assert f"usage: twin {verb}" in out
    assert "{None}" not in out
    assert err == ""


def test_the_help_of_run_names_what_can_be_chosen(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    main(["run", "--help"])
    text = capsys.readouterr().out
    assert all(f"`{name}`" in text for name in (*PIPELINES, *POLICIES))


def test_a_slip_in_a_verb_is_answered_with_the_nearest_one(capsys):
    assert "did you mean demo?" in error_of(capsys, "dmo")


@pytest.mark.parametrize(
    ("argv", "problem"),
    [
        (["run", "--robto", "sim"], "not understood: --robto, sim; did you mean --robot?; see twin run --help"),
        (["run", "--robot"], "--robot needs a value"),
        (["run", "--seed", "x"], "--seed must be an integer, not 'x'"),
        (["run", "--duration", "ten"], "--duration must be a number, not 'ten'"),
        (["run", "--rays", "laser"], "--rays cannot be 'laser'; available: 'grid', 'embree', 'bullet'"),
        (["run", "--start", "1", "2"], "--start cannot be ['1', '2']; write --start X Y YAW"),
        (["run", "--record", "yes"], "not understood: yes"),
        (["run", "stray"], "not understood: stray"),
        (["demo", "--duration", "3"], "not understood: --duration, 3"),
        (["worlds", "draw", "x"], "available: list, preview, export"),
        (["worlds", "preview"], "missing: NAME, --out PATH"),
        (["worlds", "preview", "nowhere", "--out", "x.png"], "no world 'nowhere'"),
    ],
)
def test_a_wrong_option_is_one_line_that_says_what_is_right(argv, problem, capsys):
    assert problem in error_of(capsys, *argv)


def test_the_worlds_are_listed_when_nothing_else_is_asked(capsys):
    assert main(["worlds"]) == 0
    listing = capsys.readouterr().out
    assert all(name in listing for name in world_names())


@pytest.mark.parametrize("argv", [["experiment"], ["--help"], ["run", "--help"]])
def test_a_reader_that_has_gone_is_no_error(argv):
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "wb") as pipe:
        ended = subprocess.run([*TWIN, *argv], stdout=pipe, stderr=subprocess.PIPE, check=False)
    assert (ended.returncode, ended.stderr) == (0, b"")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full here")
def test_a_full_disk_behind_stdout_is_one_line():
    with open("/dev/full", "wb") as full:
        ended = subprocess.run([*TWIN, "--help"], stdout=full, stderr=subprocess.PIPE, check=False)
    assert (ended.returncode, ended.stderr) == (2, b"twin: stdout: No space left on device\n")
