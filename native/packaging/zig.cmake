# SPDX-License-Identifier: GPL-3.0-or-later
# CMake toolchain: Zig's C and C++ compiler. It is Clang with a C++ library to link statically, and with the symbols of
# any version of glibc, so that what it builds runs on systems that are older than this one. native/packaging/zip
# installs it.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
get_filename_component(packaging ${CMAKE_CURRENT_LIST_DIR}/../../build/packaging ABSOLUTE)
file(GLOB zig ${packaging}/zig/lib/python3*/site-packages/ziglang/zig)
set(CMAKE_C_COMPILER ${zig} cc)
set(CMAKE_CXX_COMPILER ${zig} c++)
# Official Blender 4.2 and later needs glibc 2.28.
set(CMAKE_C_COMPILER_TARGET x86_64-linux-gnu.2.28)
set(CMAKE_CXX_COMPILER_TARGET x86_64-linux-gnu.2.28)
set(RAYBUNDLE_MARCH x86_64_v2)  # as Zig spells it

# Only libraries that were built from source, none of this system.
set(CMAKE_FIND_ROOT_PATH ${packaging}/prefix)
foreach(kind INCLUDE LIBRARY PACKAGE)
    set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
