"""`twin VERB`: finds the verb's file, and turns every expected error into one line and exit code 2."""

from __future__ import annotations

import importlib
import logging
import signal
import sys
from pathlib import Path
from types import FrameType

from hardware.errors import HardwareError
from scripts.errors import UsageError
from scripts.runs.files import OutputError
from sim.errors import SimError
from slam.errors import SlamError
from worlds.errors import WorldError

VERBS = ("demo", "run", "worlds", "icp", "bench")
EXPECTED = (HardwareError, OutputError, SimError, SlamError, UsageError, WorldError)
INTERRUPTED = 130


def main(argv: list[str] | None = None) -> int:
    """Run a verb; returns the exit code."""
    logging.basicConfig(format="twin: %(levelname)s: %(message)s", level=logging.WARNING)
    signal.signal(signal.SIGTERM, _interrupt)
    arguments = sys.argv[1:] if argv is None else argv
    if not arguments or arguments[0] in ("-h", "--help"):
        print(_overview())
        return 0
    verb, *rest = arguments
    if verb not in VERBS:
        print(f"twin: no verb '{verb}'; available: {', '.join(VERBS)}", file=sys.stderr)
        return 2
    try:
        return importlib.import_module(f"scripts.{verb}").main(rest)
    except EXPECTED as error:
        print(f"twin: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("twin: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        return 0


def _interrupt(number: int, frame: FrameType | None) -> None:
    """SIGTERM ends a run as Ctrl-C does: wheels stop, outputs are kept."""
    raise KeyboardInterrupt


def _overview() -> str:
    lines = ["twin: a digital twin of a LEGO SLAM robot", "", "usage: twin VERB [options]; twin VERB --help says more", ""]
    lines += [f"  {verb:8} {_help(verb)}" for verb in VERBS]
    return "\n".join(lines)


def _help(verb: str) -> str:
    """The verb's HELP line, read without importing what the verb needs."""
    folder = Path(__file__).parent
    module = folder / f"{verb}.py"
    text = (module if module.is_file() else folder / verb / "__init__.py").read_text(encoding="utf-8")
    return text.split('\nHELP = "', 1)[1].split('"\n', 1)[0]


if __name__ == "__main__":
    sys.exit(main())
