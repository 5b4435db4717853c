#!/usr/bin/env bash
# Builds the release preset, runs the quick benchmark and the quick stress test, and ends with a table and the path of a report.
# Sets up a bare Debian 12 by itself.
#   bash apps/bench.sh                  under a minute of runs, once it is built
#   bash apps/bench.sh ARGUMENTS        what `cairn bench ARGUMENTS` does, see docs/benchmarks.md
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
source "$root/tests/support/packages.sh"
install_packages
install_optional_packages
cmake -S "$root" --preset release
cmake --build "$root/build/release" --target cairn -j "$(nproc 2>/dev/null || echo 2)"
cairn="$root/build/release/bin/cairn"
if [ $# -gt 0 ]; then exec "$cairn" bench "$@"; fi
out="$root/build/results/$(date -u +%Y%m%d-%H%M%S)"
"$cairn" bench --quick --out "$out"
"$cairn" stress --quick --out "$out"
echo "Report:"
"$cairn" report "$out"
