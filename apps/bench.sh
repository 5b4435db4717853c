#!/usr/bin/env bash
# Builds the release preset and runs `cairn bench` with the arguments given here. Sets up a bare Debian 12 by itself.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
source "$root/tests/support/packages.sh"
install_packages
install_optional_packages
cmake -S "$root" --preset release
cmake --build "$root/build/release" --target cairn -j "$(nproc 2>/dev/null || echo 2)"
exec "$root/build/release/bin/cairn" bench "$@"
