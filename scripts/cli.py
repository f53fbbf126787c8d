"""`twin VERB`: finds the verb's file, and turns every expected error into one line and exit code 2."""

from __future__ import annotations

import difflib
import importlib
import importlib.util
import logging
import os
import re
import signal
import sys
from pathlib import Path
from types import FrameType

from hardware.errors import HardwareError
from scripts.errors import FAILED, INTERRUPTED, UsageError
from scripts.runs.files import OutputError
from sim.errors import SimError
from slam.errors import SlamError
from worlds.errors import WorldError

VERBS = (
    "demo", "run", "compare", "experiment", "evaluate", "worlds", "convert", "icp", "print",
    "emulate", "doctor", "install", "teleop", "calibrate", "locate", "bench",
)  # fmt: skip
EXPECTED = (HardwareError, OutputError, SimError, SlamError, UsageError, WorldError)


def main(argv: list[str] | None = None) -> int:
    """Run a verb; returns the exit code."""
    logging.basicConfig(format="twin: %(levelname)s: %(message)s", level=logging.WARNING)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupt)
    try:
        code = _dispatch(sys.argv[1:] if argv is None else argv)
        if sys.stdout is not None:
            sys.stdout.flush()
    except EXPECTED as error:
        return _fail(str(error))
    except MemoryError as error:
        return _fail(f"out of memory ({error}); take a coarser map, a shorter run or a larger machine")
    except KeyboardInterrupt:
        return _fail("interrupted", INTERRUPTED)
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # or the interpreter meets a broken stdout once more at its end
        return 0 if isinstance(error, BrokenPipeError) else _fail(f"{error.filename or 'stdout'}: {error.strerror}")
    return code


def _dispatch(arguments: list[str]) -> int:
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(_overview())
        return 0
    verb, *rest = arguments
    if verb not in VERBS:
        nearest = difflib.get_close_matches(verb, VERBS, n=1)
        hint = f"; did you mean {nearest[0]}?" if nearest else ""
        raise UsageError(f"no verb '{verb}'; available: {', '.join(VERBS)}{hint}")
    try:
        return importlib.import_module(f"scripts.{verb}").main(rest)
    except SystemExit:  # after --help, and after rich has found a closed pipe
        return 0


def _fail(problem: str, code: int = FAILED) -> int:
    print(f"twin: {' '.join(problem.split())}", file=sys.stderr)
    return code


def _interrupt(number: int, frame: FrameType | None) -> None:
    """SIGTERM ends a run as Ctrl-C does, also one that a script has put in the background."""
    raise KeyboardInterrupt


def _overview() -> str:
    lines = ["twin: a digital twin of a LEGO SLAM robot", "", "usage: twin VERB [options]", ""]
    lines += [f"  {verb:10} {_help(verb)}" for verb in VERBS]
    return "\n".join([*lines, "", "Start with `twin demo`. `twin VERB --help` explains a verb and all its options."])


def _help(verb: str) -> str:
    """The verb's HELP line, read without importing what the verb needs."""
    spec = importlib.util.find_spec(f"scripts.{verb}")
    found = re.search(r'^HELP = "(.*)"$', Path(spec.origin).read_text(encoding="utf-8"), re.MULTILINE) if spec and spec.origin else None
    return found[1] if found else ""


if __name__ == "__main__":
    sys.exit(main())
