# SPDX-License-Identifier: GPL-3.0-or-later
# CMake toolchain: Zig's C and C++ compiler. It is Clang with a C++ library to link statically, with the symbols of any
# version of glibc, so that what it builds runs on systems that are older than this one, and with the headers and
# import libraries of Windows. native/packaging/third_party installs it. RAYBUNDLE_PLATFORM is linux or windows.
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES RAYBUNDLE_PLATFORM)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
get_filename_component(packaging ${CMAKE_CURRENT_LIST_DIR}/../../build/packaging ABSOLUTE)
file(GLOB zig ${packaging}/zig/lib/python3*/site-packages/ziglang/zig)
if(RAYBUNDLE_PLATFORM STREQUAL "windows")
    set(CMAKE_SYSTEM_NAME Windows)
    set(target x86_64-windows-gnu)
    # CMake wants a compiler of resources, although none are compiled.
    set(CMAKE_RC_COMPILER ${zig})
else()
    set(CMAKE_SYSTEM_NAME Linux)
    # Official Blender 4.2 and later needs glibc 2.28.
    set(target x86_64-linux-gnu.2.28)
endif()
foreach(language C CXX)
    set(CMAKE_${language}_COMPILER_TARGET ${target})
endforeach()
set(CMAKE_C_COMPILER ${zig} cc)
set(CMAKE_CXX_COMPILER ${zig} c++)
set(RAYBUNDLE_MARCH x86_64_v2)  # as Zig spells it

# Only libraries that were built from source, none of this system.
set(CMAKE_FIND_ROOT_PATH ${packaging}/${RAYBUNDLE_PLATFORM}/prefix)
foreach(kind INCLUDE LIBRARY PACKAGE)
    set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
