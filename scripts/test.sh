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
quick=0 live=0
python -m pytest -m wall_clock -n 0 "$@" || live=$?
python -m pytest -m "not wall_clock" -n 2 --dist loadfile "$@" || quick=$?
echo "pytest's exit codes: $quick, and $live for the tests in wall-clock time (5: there are none)"
[ "$quick" -ne 5 ] || exit "$live"
[ "$live" -ne 5 ] || exit "$quick"
exit $((quick > live ? quick : live))
