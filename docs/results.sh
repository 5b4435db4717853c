#!/usr/bin/env bash
# Fills the results table of README.md, between its two markers, with what `cairn bench` prints on this machine. Takes a minute or two.
#   bash docs/results.sh [options of cairn bench]      after bash apps/bench.sh, which builds the program
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
cairn=${CAIRN:-build/release/bin/cairn}
table=$(mktemp)
trap 'rm -f "$table"' EXIT
{
    echo '```'
    if [ $# -eq 0 ]; then set -- --engines cairn --dt 1/60 --repeats 1; fi
    "$cairn" bench "$@" 2>/dev/null
    echo '```'
    processor=$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo 2>/dev/null | head -1)
    echo "One thread of ${processor:-this machine}, $(date +%Y-%m-%d). \`bash docs/results.sh\` writes it anew; \`cairn bench --help\` explains the columns."
} >"$table"
sed -i -e '/<!-- results: begin/,/<!-- results: end/{/<!-- results: begin/r '"$table" -e '/<!-- results:/!d}' README.md
