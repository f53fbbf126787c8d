"""Pages of figures, made of files that runs of `twin bench` have left."""

import json
from pathlib import Path

import pytest

from scripts.bench import main
from scripts.errors import UsageError

ROW = {"group": "rays", "name": "a beam", "value": 2.5, "unit": "m", "reach": "≥ 2", "peer": "another", "peer_value": 1.25, "ratio": 2.0}


def rows_in(path: Path, *rows: dict[str, object]) -> Path:
    path.write_text(json.dumps([{**row, "command": "twin bench rays"} for row in rows]), encoding="utf-8")
    return path


def test_rows_of_files_become_one_page_in_the_order_of_the_groups(tmp_path: Path) -> None:
    later, first = rows_in(tmp_path / "a.json", {**ROW, "group": "twin", "name": "a day"}), rows_in(tmp_path / "b.json", ROW)
    assert main(["--read", str(later), str(first), "--markdown", str(tmp_path / "page.md"), "--json", str(tmp_path / "all.json")]) == 0
    page = (tmp_path / "page.md").read_text(encoding="utf-8").splitlines()
    told = [line for line in page if line.startswith(("##", "| a "))]
    assert told == [
        "## `twin bench rays`",
        "| a beam | 2.5 | m | ≥ 2 | another | 1.25 | 2.00 |",
        "## `twin bench twin`",
        "| a day | 2.5 | m | ≥ 2 | another | 1.25 | 2.00 |",
    ]
    assert [row["group"] for row in json.loads((tmp_path / "all.json").read_text(encoding="utf-8"))] == ["rays", "twin"]


@pytest.mark.parametrize(
    "rows", ["no json", '[{"group": "rays"}]', '["a"]', '[{"group": "elsewhere", "name": "", "value": 1, "unit": ""}]']
)
def test_a_file_without_rows_is_refused_in_a_line(tmp_path: Path, rows: str) -> None:
    (tmp_path / "rows.json").write_text(rows, encoding="utf-8")
    with pytest.raises(UsageError, match="--read"):
        main(["--read", str(tmp_path / "rows.json")])
