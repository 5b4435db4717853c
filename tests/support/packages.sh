# Sourced by tests/run.sh and apps/bench.sh: `install_packages` sees to it that everything Cairn is built from is on the machine.
# On Debian and its relatives it installs what is missing, and only that; elsewhere it prints what is needed and goes on.

cairn_packages=(
    g++ cmake ninja-build                                # CMake >= 3.25, a C++20 compiler
    libeigen3-dev libfcl-dev libccd-dev libqhull-dev     # the engine
    nlohmann-json3-dev libcli11-dev libfmt-dev           # scene files, the command line
    libtbb-dev                                           # threads (optional: CAIRN_TBB=OFF builds without)
    catch2                                               # the tests
)
# What `cairn bench` compares with and draws with. Everything works without.
cairn_optional_packages=(pkg-config libbullet-dev libode-dev gnuplot-nox)

install_packages() {
    local package state missing=()
    if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
        echo "This is no Debian: nothing is installed here. Cairn needs what Debian calls"
        echo "    ${cairn_packages[*]}"
        check_tools
        return
    fi
    for package in "${cairn_packages[@]}"; do
        state=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null) || state=
        [ "$state" = installed ] || missing+=("$package")
    done
    if [ ${#missing[@]} -gt 0 ]; then
        echo "Installing Debian packages: ${missing[*]}"
        if ! as_root true; then
            echo "Missing packages need root, and sudo does not give it. Run as root, then start again:" >&2
            echo "    apt-get update && apt-get install -y --no-install-recommends ${missing[*]}" >&2
            return 1
        fi
        # A source list that does not answer must not stop what the others can give.
        as_root apt-get -o Acquire::Retries=3 update -qq || echo "apt-get update did not end well; trying with the lists that are there"
        as_root env DEBIAN_FRONTEND=noninteractive apt-get -o Acquire::Retries=3 -o DPkg::Lock::Timeout=600 \
            install -y -qq --no-install-recommends "${missing[@]}" </dev/null
    fi
    check_tools
}

# Installs what is missing of the optional packages if that can be done without asking; says what is left out otherwise.
install_optional_packages() {
    local package missing=()
    command -v dpkg-query >/dev/null && command -v apt-get >/dev/null || return 0
    for package in "${cairn_optional_packages[@]}"; do
        [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] && return 0
    echo "Installing optional Debian packages: ${missing[*]}"
    as_root env DEBIAN_FRONTEND=noninteractive apt-get -o Acquire::Retries=3 -o DPkg::Lock::Timeout=600 \
        install -y -qq --no-install-recommends "${missing[@]}" </dev/null || echo "Goes on without: ${missing[*]}"
}

# Runs a command as root: plainly if we are, else through sudo (which may ask for a password only if there is somebody to ask).
as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    elif command -v sudo >/dev/null; then
        if [ -t 0 ]; then sudo "$@"; else sudo -n "$@"; fi
    else
        return 1
    fi
}

check_tools() {
    local tool
    for tool in cmake ninja c++; do
        command -v "$tool" >/dev/null || { echo "Cannot go on: there is no $tool on this machine." >&2; return 1; }
    done
}
