"""The house keeps its own rules."""

import ast
import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

from hardware.logs.registry import LOG_FORMATS
from hardware.registry import BACKENDS
from slam.navigation.policies import POLICIES
from slam.pipelines import PIPELINES

ROOT = Path(__file__).parents[1]
PACKAGES = ("slam", "hardware", "sim", "worlds")
SOURCES = [path for package in (*PACKAGES, "scripts") for path in sorted((ROOT / package).rglob("*.py"))]
UNITS_ALLOWED = (
    "hardware/drivers/",
    "hardware/protocols/",
    "hardware/emulators/",
    "hardware/logs/",
    "sim/drive.py",
    "sim/imu.py",
    "sim/wire.py",
    "scripts/",
)
UNIT_SUFFIX = re.compile(r"_(mm|cm|deg|counts|ms|us)$")
MACHINE_PATH = re.compile(r"(?<![\w.])/(?:home|Users|root|work|tmp)/\w")


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def sources(*packages: str) -> list[Path]:
    return [path for path in SOURCES if relative(path).split("/")[0] in packages]


def identifiers(path: Path) -> set[str]:
    """Every name that the file defines or uses."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.arg(arg=name) | ast.keyword(arg=str(name)):
                names.add(name)
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                names.add(name)
    return names


def imported(path: Path) -> set[str]:
    """Top-level modules that the file imports."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    plain = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    return {name.split(".")[0] for name in plain | {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}}


def tracked_files() -> list[Path]:
    listing = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False, text=True)
    if listing.returncode != 0:
        pytest.skip("not a git checkout")
    return [path for name in listing.stdout.split("\0") if (path := ROOT / name).is_file()]


def test_imports_follow_the_arrows() -> None:
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command; lint_imports_command()", "--no-cache", "--no-logo"]
    lint = subprocess.run(command, cwd=ROOT, capture_output=True, check=False, text=True)
    assert lint.returncode == 0, lint.stdout + lint.stderr


def test_no_file_has_more_than_400_lines() -> None:
    lengths = {relative(path): len(path.read_text(encoding="utf-8").splitlines()) for path in SOURCES}
    assert {name: length for name, length in lengths.items() if length > 400} == {}


def test_only_the_devices_and_the_command_line_know_other_units_than_si() -> None:
    others = [path for path in SOURCES if not relative(path).startswith(UNITS_ALLOWED)]
    assert {relative(path): bad for path in others if (bad := sorted(filter(UNIT_SUFFIX.search, identifiers(path))))} == {}


def test_nothing_prints_outside_the_command_line() -> None:
    assert [relative(path) for path in sources(*PACKAGES) if "print" in identifiers(path)] == []


def test_neither_estimator_nor_twin_reads_a_wall_clock() -> None:
    clocks = {"time", "datetime"}
    assert {relative(path): used for path in sources("slam", "sim") if (used := clocks & imported(path))} == {}


def test_no_tracked_file_names_a_folder_of_somebodys_machine() -> None:
    named: dict[str, list[str]] = {}
    for path in tracked_files():
        text = path.read_bytes().decode("utf-8", errors="ignore")
        if found := MACHINE_PATH.findall(text):
            named[relative(path)] = found
    assert named == {}


@pytest.mark.parametrize("target", sorted({**BACKENDS, **LOG_FORMATS}.values()))
def test_every_name_in_a_registry_of_strings_can_be_imported(target: str) -> None:
    module, _, attribute = target.partition(":")
    assert isinstance(getattr(importlib.import_module(module), attribute), type)


@pytest.mark.parametrize("settings", [*PIPELINES.values(), *POLICIES.values()], ids=lambda settings: settings.__name__)
def test_every_registered_class_is_a_frozen_dataclass_that_builds(settings: type) -> None:
    assert settings.__dataclass_params__.frozen
    assert callable(settings.build)


@pytest.mark.parametrize("module", ["slam", "slam.messages", "hardware.hal", "hardware.spec"])
def test_the_vocabulary_does_not_pay_for_numba(module: str) -> None:
    program = f"import sys, {module}; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=False).returncode == 0
