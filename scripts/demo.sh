#!/bin/sh
# The main job: a tour of a room in simulation, mapped and scored against the truth. Options go to `twin demo`.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh
exec .venv/bin/twin demo "$@"
