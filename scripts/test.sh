#!/bin/sh
# All checks. Options go to pytest. Tests in wall-clock time mostly wait: they run beside everything else, which gives way to them.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh test
PATH="$PWD/.venv/bin:$PATH"
export PATH
quick=0 live=0 said=$(mktemp)
setsid python -m pytest -m wall_clock -n 0 "$@" > "$said" 2>&1 &
trap 'kill -- -$! $! 2> /dev/null || true; rm -f "$said"' EXIT  # the emulators too
trap 'exit 130' INT TERM
gently() { nice -n 19 "$@"; }
gently ruff format --check --quiet .
gently ruff check --quiet .
gently typos
gently basedpyright --level error
gently lint-imports --no-logo
gently python -m pytest -m "not wall_clock" -n 2 --dist loadfile "$@" || quick=$?
wait $! || live=$?
cat "$said"
echo "pytest's exit codes: $quick, and $live for the tests in wall-clock time (5: there are none)"
[ "$quick" -ne 5 ] || exit "$live"
[ "$live" -ne 5 ] || exit "$quick"
exit $((quick > live ? quick : live))
