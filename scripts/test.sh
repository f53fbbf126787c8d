#!/bin/sh
# All checks, in the order of CI: format, lint, spelling, types, contracts, tests. Options go to pytest.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh test
PATH="$PWD/.venv/bin:$PATH"
export PATH
ruff format --check --quiet .
ruff check --quiet .
typos
basedpyright --level error
lint-imports --no-logo
exec python -m pytest -n 2 --dist loadfile "$@"
