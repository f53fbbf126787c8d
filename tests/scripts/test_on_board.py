import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WITHOUT = """
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("pybullet", "embreex"):
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)

sys.meta_path.insert(0, Absent())
from scripts.cli import main
sys.exit(main(sys.argv[1:]))
"""


def test_the_simulation_is_an_extra():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    needed = " ".join([*project["dependencies"], *project["optional-dependencies"]["robot"]])
    assert "pybullet" not in needed
    assert "embreex" not in needed
    assert "pybullet" in " ".join(project["optional-dependencies"]["sim"])


@pytest.mark.wall_clock
def test_the_real_robot_runs_where_neither_pybullet_nor_embree_is_installed(emulate, tmp_path):
    brick, lidar = emulate()
    arguments = ["run", "--robot", "ev3", "--ev3", brick, "--lidar", lidar, "--pipeline", "lidar_slam", "--duration", "3"]
    run = [sys.executable, "-c", WITHOUT, *arguments, "--out", str(tmp_path / "run")]
    done = subprocess.run(run, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run" / "map.pgm").is_file()
    simulated = subprocess.run([sys.executable, "-c", WITHOUT, "run"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert simulated.returncode == 2
    assert simulated.stderr.count("\n") == 1
    assert "pybullet" in simulated.stderr
