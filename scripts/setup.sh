#!/bin/sh
# Make .venv with Python 3.11 if it is missing or out of date, and install the project into it: sh scripts/setup.sh [EXTRA]; without one the simulation's
set -eu
cd "$(dirname "$0")/.."
extra=${1:-sim}

if [ ! -x .venv/bin/python ]; then
    python=
    for candidate in python3.11 python3; do
        if "$candidate" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null; then python=$candidate; break; fi
    done
    if [ -z "$python" ]; then
        echo "bricktwin needs Python 3.11 (PyBullet has no wheels for later ones). Install it, for example:" >&2
        echo "  Debian 12: apt-get install python3.11 python3.11-venv;  Ubuntu: the deadsnakes PPA;  anywhere: uv python install 3.11 or pyenv install 3.11" >&2
        exit 2
    fi
    if ! "$python" -m venv .venv; then
        rm -rf .venv
        echo "$python cannot make a virtual environment. On Debian and Ubuntu: apt-get install python3.11-venv" >&2
        exit 2
    fi
fi

wanted=$(cat pyproject.toml constraints.txt | cksum)
stamp=".venv/.installed${extra:+-$extra}"
if [ "$(cat "$stamp" 2>/dev/null || true)" != "$wanted" ]; then
    echo "Installing bricktwin${extra:+[$extra]} into .venv; the first time this takes a minute or two." >&2
    .venv/bin/python -m pip install --quiet --no-compile --disable-pip-version-check --constraint constraints.txt --editable ".${extra:+[$extra]}"
    echo "$wanted" > "$stamp"
fi
