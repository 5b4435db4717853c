#!/usr/bin/env bash
# Draws docs/figures/chain.svg from a run of the shipped scene chain_10: the chain at every sample, the anchor at its top. Needs gnuplot.
#   bash docs/figures/chain.sh      after bash apps/bench.sh, which builds the program
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
cairn=${CAIRN:-build/release/bin/cairn}
lines=$(mktemp)
trap 'rm -f "$lines"' EXIT
"$cairn" run chain_10 --quiet --states /dev/stdout |
    awk -F, 'NR > 1 && $1 <= 1.5 { if ($1 != t && NR > 2) print ""; t = $1; printf "%.3f %.3f %.3f\n", $3, $5, $1 }' >"$lines"
gnuplot <<END
set terminal svg size 720,420 font "sans-serif,12"
set output "docs/figures/chain.svg"
set size ratio -1
set xlabel "x [m]"
set ylabel "z [m]"
set cblabel "t [s]"
set grid lc rgb "#dddddd"
plot "$lines" using 1:2:3 with linespoints palette pt 7 ps 0.25 lw 1 notitle
END
