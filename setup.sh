# SPDX-License-Identifier: GPL-3.0-or-later
# What ./bake and ./test have in common: missing Debian packages are installed (as root or with sudo; else they are
# named and the command stops), and the native library is configured and built as far as it is out of date.
# Sourced with the repository root as working directory.

bake_packages=(blender python3-numpy g++ cmake ninja-build libembree-dev libglm-dev libopenmesh-dev libtbb-dev
    libeigen3-dev nlohmann-json3-dev)
# The window of the UI test is drawn by Mesa in software, figures by Matplotlib.
test_packages=(libgtest-dev librapidcheck-dev python3-pytest python3-matplotlib xvfb xauth xdotool libgl1-mesa-dri
    libegl-mesa0)
# Clang's sanitizers, and what names the lines in their reports.
sanitizer_packages=(clang libclang-rt-14-dev llvm)

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

# Sets blender to BLENDER's or the first on PATH, as the caller has it, and gives what is started from here on an
# environment of its own: Debian's Blender takes its Python's folders from the python3 that it finds on PATH, which
# in a virtual environment, or after another Python was installed, has no numpy.
use_own_environment() {
    blender=$(command -v "${BLENDER:-blender}") ||
        { echo "${BLENDER:-blender}: there is no such program" >&2; exit 1; }
    unset VIRTUAL_ENV PYTHONHOME PYTHONPATH
    export PATH=/usr/bin:/bin:$PATH
}

# build TESTS [TARGET ...]: TESTS is ON or OFF. Tests use the Blender of use_own_environment, if that was called.
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
