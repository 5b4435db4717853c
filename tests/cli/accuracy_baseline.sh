#!/usr/bin/env bash
# Writes the baseline of accuracy anew, which the tests hold every build against. Look at the difference before you commit it.
#   bash tests/cli/accuracy_baseline.sh [PROGRAM]       default: build/release/bin/cairn
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cairn=${1:-$root/build/release/bin/cairn}
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
scenes=(projectile slide_stop slide_roll incline_slip incline_stick roll_incline bounce cradle pendulum rod_pendulum slider top torque_free
        heavy_on_light card_house stack_5 fixed_beam)
arguments=()
for scene in "${scenes[@]}"; do arguments+=(--scene "$scene"); done
"$cairn" bench "${arguments[@]}" --engines cairn --dt 1/60 --repeats 1 --no-profile --out "$out"
cp "$out/results.json" "$root/tests/cli/accuracy_baseline.json"
