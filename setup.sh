# SPDX-License-Identifier: GPL-3.0-or-later
# Functions for ./bake, ./test and other scripts, which source this file with the repository root as working
# directory: they install missing Debian packages, and configure and build the native library if it is out of date.

bake_packages=(blender python3-numpy g++ cmake ninja-build libembree-dev libglm-dev libopenmesh-dev libtbb-dev
    libeigen3-dev nlohmann-json3-dev)
# Mesa draws the window of the UI test in software. Matplotlib draws figures.
test_packages=(libgtest-dev librapidcheck-dev python3-pytest python3-matplotlib xvfb xauth xdotool libgl1-mesa-dri
    libegl-mesa0)
# Clang with its sanitizers, and LLVM, which adds line numbers to their reports.
sanitizer_packages=(clang libclang-rt-14-dev llvm)
# The zip of the add-on is built by a compiler from Python's package index, from sources of libraries.
zip_packages=(cmake ninja-build binutils python3-venv dpkg-dev patch xz-utils bzip2)

# require_packages PACKAGE ...: installs Debian packages that are missing, as root or with sudo. Without these rights
# prints the command that installs them and exits.
require_packages() {
    local missing=() package
    for package in "$@"; do
        [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] && return
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        if ! sudo -n true 2>/dev/null; then
            echo "These Debian packages are missing; install them first:" >&2
            echo "    apt-get install ${missing[*]}" >&2
            exit 1
        fi
        as_root=(sudo -n)
    fi
    echo "Installing ${missing[*]}"
    "${as_root[@]}" apt-get update -q >/dev/null
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -q -y --no-install-recommends "${missing[@]}" >/dev/null
}

# fetch_source PACKAGE FOLDER: unpacks the source of a library into FOLDER. Downloads it as the source of a Debian
# package, from the servers that this machine gets its packages from. It must have the name and the SHA-256 that
# native/packaging/SOURCES lists. Returns 1 if it cannot be had.
fetch_source() {
    local pinned=$PWD/native/packaging/SOURCES folder=$PWD/build/sources list archive
    local apt=(apt-get -q -o Dir::Etc::sourcelist=/dev/null -o "Dir::Etc::sourceparts=$folder/servers"
        -o "Dir::State::lists=$folder/lists")
    archive=$(grep -o " $1_.*" "$pinned")
    archive=${archive# }
    mkdir -p "$folder/servers" "$folder/lists" "$2"
    if [ ! -e "$folder/$archive" ]; then
        sed -n 's/^deb /deb-src /p' /etc/apt/sources.list >"$folder/servers/list.list" 2>/dev/null || true
        for list in /etc/apt/sources.list.d/*.sources; do
            [ ! -e "$list" ] || sed 's/^Types:.*/Types: deb-src/' "$list" >"$folder/servers/$(basename "$list")"
        done
        "${apt[@]}" update && (cd "$folder" && "${apt[@]}" source --download-only --tar-only "$1") || return 1
    fi
    (cd "$folder" && grep " $archive\$" "$pinned" | sha256sum --check --quiet) || return 1
    tar -xf "$folder/$archive" -C "$2" --strip-components=1
}

# Sets the variable blender to the program that BLENDER names, or else to the first Blender on the caller's PATH. Then
# makes the environment of all further commands independent of the caller's Python: Debian's Blender takes the folders
# of its Python from the python3 that is first on PATH. In a virtual environment, or after another Python was
# installed, this python3 has no numpy.
use_own_environment() {
    blender=$(command -v "${BLENDER:-blender}") ||
        { echo "${BLENDER:-blender}: there is no such program" >&2; exit 1; }
    unset VIRTUAL_ENV PYTHONHOME PYTHONPATH
    export PATH=/usr/bin:/bin:$PATH
}

# build TESTS [TARGET ...]: configures the library if needed and builds the targets, or all. TESTS, ON or OFF, is
# whether tests are configured. They use the Blender of use_own_environment, if that function was called before. On a
# failure prints the log and exits.
build() {
    local log=build/release.log cache=build/release/CMakeCache.txt options=("RAYBUNDLE_TESTS:BOOL=$1") option
    local is_configured=true
    [ -z "${blender:-}" ] || options+=("BLENDER:FILEPATH=$blender")
    shift
    mkdir -p build
    for option in "${options[@]}"; do
        grep -qxF "$option" "$cache" 2>/dev/null || is_configured=false
    done
    if [ ! -f build/release/build.ninja ] || ! $is_configured; then
        cmake --preset release "${options[@]/#/-D}" >"$log" 2>&1 ||
            { cat "$log" >&2; exit 1; }
    fi
    cmake --build --preset release "$@" >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
}
