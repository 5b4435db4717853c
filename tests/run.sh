#!/usr/bin/env bash
# Builds Cairn from this checkout and runs every test: checks on and warnings as errors (dev), address and undefined-behaviour sanitizers
# (asan), and the thread sanitizer (tsan) over what runs on several threads. Sets up a bare Debian 12 by itself.
#   bash tests/run.sh [PRESET...]      default: dev asan tsan
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source tests/support/packages.sh
install_packages

jobs=$(nproc 2>/dev/null || echo 2)
if [ $# -gt 0 ]; then
    presets=("$@")
else
    presets=(dev asan)
    # The thread sanitizer finds nothing where no thread is started.
    if grep -rqE 'std::j?thread|std::async|<tbb/' --include='*.cpp' --include='*.hpp' engine collision solver; then presets+=(tsan); fi
fi

# GCC 12's sanitizers may find their addresses taken under kernels that scatter the address space far: ask for one that is not scattered.
steady=()
if setarch "$(uname -m)" -R true 2>/dev/null; then steady=(setarch "$(uname -m)" -R); fi

for preset in "${presets[@]}"; do
    echo "== build: $preset"
    cmake --preset "$preset"
    "${steady[@]}" cmake --build --preset "$preset" -j "$jobs"
done

failed=()
for preset in "${presets[@]}"; do
    echo "== test: $preset"
    "${steady[@]}" ctest --preset "$preset" -j "$jobs" || failed+=("$preset")
done
if [ ${#failed[@]} -gt 0 ]; then
    echo "Tests failed in: ${failed[*]}" >&2
    exit 1
fi
