# SPDX-License-Identifier: GPL-3.0-or-later
"""Calls the native library. This is the only module that uses ctypes.

The library is loaded at its first use and not when the add-on is registered, so that enabling the
add-on never fails and a missing or incompatible library causes a readable message. Arrays are numpy
arrays. Their shape and type are checked here: TypeError and ValueError name the array that does not
fit. Handles are wrapped in classes with close(), which are also context managers. A call that fails
raises RaybundleError. native/include/raybundle/raybundle.h describes the interface.
"""

from __future__ import annotations

import ctypes
import dataclasses
import enum
import functools
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from . import library_file, library_messages
from .messages import Message
from .surface_data import SurfaceData

ABI_VERSION = 3


class ErrorCode(enum.IntEnum):
    """Error codes of the native library, as in rb_error."""

    NONE = 0
    UNKNOWN = 1
    INVALID_ARGUMENT = 2
    INVALID_OPERATION = 3
    OUT_OF_MEMORY = 4
    UNSUPPORTED_HARDWARE = 5
    CANCELLED = 6


class RaybundleError(RuntimeError):
    """Raised if a call of the native library failed, or if the library cannot be used."""

    def __init__(self, code: int, message: str) -> None:
        """code: an ErrorCode. message: text for the user."""
        super().__init__(message)
        self.code = code
        self.message = message


# Names of the stages in the order of rb_stage. They are keys of the report's seconds.
STAGES = ('patches', 'first_shot', 'bundles', 'solve', 'reconstruction')

IMAGE_EXTENSIONS = {'REPEAT': 0, 'EXTEND': 1, 'CLIP': 2}
ROLES = {'BAKE': 0, 'OCCLUDE': 1}
SIDES = {'FRONT': 0, 'BACK': 1}
POINT_SHAPES = {'DISK': 0, 'SPHERE': 1}
AREA_SHAPES = {'RECTANGLE': 0, 'ELLIPSE': 1}
OUTPUTS = {'COMBINED': 0, 'LIGHTING': 1, 'DIRECT': 2, 'INDIRECT': 3}

# Types of settings in the order of rb_setting_type.
SETTING_TYPES = (int, float, str)

# A function that is called with the name of the stage and the completed share of the stage, 0 to 1.
# It cancels the bake by returning False.
Progress = Callable[[str, float], object]

_ProgressFunction = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_void_p, ctypes.c_int, ctypes.c_double)

_handle = ctypes.c_void_p
_int = ctypes.c_int32
_size = ctypes.c_size_t
_float = ctypes.c_float
_enum = ctypes.c_int
_text = ctypes.c_char_p
_floats = ctypes.POINTER(ctypes.c_float)
_ints = ctypes.POINTER(ctypes.c_int32)
_texts = ctypes.POINTER(ctypes.c_char_p)
_out = ctypes.POINTER
_rgb = 3 * ctypes.c_float

NO_IMAGE = -1  # RB_NO_IMAGE


class _AngleFactors(ctypes.Structure):
    _fields_ = [('linear', _rgb), ('square', _rgb), ('fifth', _rgb), ('cosine_fifth', _rgb)]


class _Color(ctypes.Structure):
    _fields_ = [('constant', _rgb), ('image', _int), ('image_weight', _rgb),
                ('corner_color_weight', _rgb)]


class _Part(ctypes.Structure):
    _fields_ = [('scale', _rgb), ('offset', _rgb)]


class _Shown(ctypes.Structure):
    _fields_ = [('color', _Part), ('from_above', _rgb), ('by_angle', _AngleFactors)]


class _Gloss(ctypes.Structure):
    _fields_ = [('part', _Part), ('by_angle', _AngleFactors), ('roughness', _float),
                ('masking', _enum)]


class _Lobe(ctypes.Structure):
    _fields_ = [('reflectance', _rgb), ('by_angle', _AngleFactors), ('roughness', _float)]


class _Diffuse(ctypes.Structure):
    _fields_ = [('model', _enum), ('roughness', _float), ('leaving', _AngleFactors)]


class _Surface(ctypes.Structure):
    """rb_surface. Its members, except for the size, have the names of those of SurfaceData."""

    _fields_ = [('size', _size), ('reflectance', _Color), ('emission', _Color),
                ('translucence', _Color), ('reflectance_by_angle', _AngleFactors),
                ('shown', _Shown), ('gloss', _Gloss), ('microfibers', _Lobe), ('velvet', _Lobe),
                ('burley_sheen', _Lobe), ('several_facets', _Lobe), ('diffuse', _Diffuse)]


class _SettingInfo(ctypes.Structure):
    """rb_setting_info."""

    _fields_ = (
        ('size', _size),
        ('name', _text),
        ('help', _text),
        ('unit', _text),
        ('type', _enum),
        ('least', ctypes.c_double),
        ('most', ctypes.c_double),
        ('default_number', ctypes.c_double),
        ('default_choice', _text),
        ('choice_count', _size),
        ('choices', _texts),
        ('choice_help', _texts),
        ('used_with', _text),
        ('used_with_choices', ctypes.c_uint32),
    )


class _RunState(ctypes.Structure):
    """rb_run_state."""

    _fields_ = (
        ('size', _size),
        ('is_running', ctypes.c_bool),
        ('stage', _enum),
        ('fraction', ctypes.c_double),
        ('noise', ctypes.c_double),
        ('interim', _int),
    )


# Argument types of all functions that return an rb_error.
_FALLIBLE: dict[str, Sequence[object]] = {
    'rb_new_scene': (_out(_handle),),
    'rb_add_image': (_handle, _text, _int, _int, _floats, _enum, _out(_int)),
    'rb_init_surface': (_out(_Surface), _size),
    'rb_add_material': (_handle, _text, _out(_Surface), _out(_Surface), _float, _int, _out(_int)),
    'rb_add_mesh': (_handle, _text, _floats, _size, _ints, _size, _ints, _size, _ints, _out(_int)),
    'rb_set_mesh_corner_normals': (_handle, _int, _floats, _size),
    'rb_set_mesh_sharp_edges': (_handle, _int, _ints, _size),
    'rb_set_mesh_uvs': (_handle, _int, _floats, _size),
    'rb_set_mesh_corner_colors': (_handle, _int, _floats, _size),
    'rb_add_instance': (_handle, _int, _text, _floats, _enum, _enum, _out(_int)),
    'rb_add_point_light': (_handle, _text, _floats, _floats, _float, _enum, _out(_int)),
    'rb_set_light_cone': (_handle, _int, _floats, _float, _float, ctypes.c_bool),
    'rb_add_sun_light': (_handle, _text, _floats, _floats, _float, _out(_int)),
    'rb_add_area_light': (_handle, _text, _floats, _floats, _floats, _floats, _enum, _out(_int)),
    'rb_set_light_spread': (_handle, _int, _float),
    'rb_remove_lights': (_handle,),
    'rb_set_light_shadows': (_handle, _int, ctypes.c_bool),
    'rb_set_instance_visibility': (_handle, _int, ctypes.c_bool, ctypes.c_bool),
    'rb_set_instance_quality': (_handle, _int, ctypes.c_float, ctypes.c_float),
    'rb_set_result_corners': (_handle, _int, _ints, _size),
    'rb_set_world': (_handle, _floats),
    'rb_set_world_image': (_handle, _int, _int, _floats),
    'rb_add_light_set': (_handle, _text, _out(_int)),
    'rb_set_light_set': (_handle, _int, _int),
    'rb_set_instance_light_set': (_handle, _int, _int),
    'rb_set_world_light_set': (_handle, _int),
    'rb_new_bake': (_out(_handle),),
    'rb_get_setting_info': (_size, _out(_SettingInfo)),
    'rb_set_bake_int': (_handle, _text, _int),
    'rb_set_bake_float': (_handle, _text, _float),
    'rb_set_bake_string': (_handle, _text, _text),
    'rb_get_bake_int': (_handle, _text, _out(_int)),
    'rb_get_bake_float': (_handle, _text, _out(_float)),
    'rb_get_bake_string': (_handle, _text, _out(_text)),
    'rb_set_bake_progress': (_handle, _ProgressFunction, ctypes.c_void_p),
    'rb_execute_bake': (_handle, _handle),
    'rb_start_bake': (_handle, _handle, _out(_handle)),
    'rb_get_run_state': (_handle, _out(_RunState)),
    'rb_get_run_light': (_handle, _int, _enum, _floats, _size),
    'rb_cancel_run': (_handle,),
    'rb_finish_run': (_handle,),
    'rb_get_corner_light': (_handle, _int, _enum, _floats, _size),
    'rb_get_vertex_light': (_handle, _int, _enum, _floats, _size),
    'rb_get_set_corner_light': (_handle, _int, _int, _enum, _floats, _size),
    'rb_get_set_vertex_light': (_handle, _int, _int, _enum, _floats, _size),
    'rb_get_corner_error': (_handle, _int, _floats, _size),
    'rb_get_adapted_mesh_size': (_handle, _int, _out(_size), _out(_size), _out(_size)),
    'rb_get_adapted_mesh': (_handle, _int, _floats, _size, _ints, _ints, _floats, _ints, _size,
                            _ints, _ints, _size),
    'rb_get_report': (_handle, _out(_text)),
    'rb_new_subdivision': (_floats, _size, _ints, _size, _ints, _size, _float, _out(_handle)),
    'rb_get_subdivision_size': (_handle, _out(_size), _out(_size)),
    'rb_get_subdivision': (_handle, _floats, _size, _ints, _ints, _ints, _floats, _size),
    'rb_new_simplification': (_floats, _size, _ints, _size, _ints, _size, _ints, _ints, _floats,
                              _floats, _size, _float, _out(_handle)),
    'rb_get_simplification_size': (_handle, _out(_size), _out(_size)),
    'rb_get_simplification': (_handle, _ints, _ints, _size, _ints, _ints, _size, _floats, _size),
}

# Result type and argument types of the functions that cannot fail.
_INFALLIBLE: dict[str, tuple[object, Sequence[object]]] = {
    'rb_get_abi_version': (_int, ()),
    'rb_get_version': (_text, ()),
    'rb_get_error_message': (_text, ()),
    'rb_release_scene': (None, (_handle,)),
    'rb_release_bake': (None, (_handle,)),
    'rb_release_run': (None, (_handle,)),
    'rb_get_setting_count': (_size, ()),
    'rb_release_subdivision': (None, (_handle,)),
    'rb_release_simplification': (None, (_handle,)),
}

_library: ctypes.CDLL | None = None


# --------------------------------------------------------------------------------------------------
# Library
# --------------------------------------------------------------------------------------------------


def library_path() -> Path:
    """Returns the path at which the build creates the shared library."""
    name = {'win32': "raybundle.dll", 'darwin': "libraybundle.dylib"}.get(
        sys.platform, "libraybundle.so")
    return Path(__file__).parent / "lib" / name


def load() -> ctypes.CDLL:
    """Returns the library, which is loaded at the first call. Raises RaybundleError with code
    INVALID_OPERATION if the library is missing, is damaged, cannot be loaded or has another version
    of the interface."""
    global _library
    if _library is not None:
        return _library
    path = library_path()
    if not path.is_file():
        raise RaybundleError(
            ErrorCode.INVALID_OPERATION,
            Message("The native library is missing: {path}. Build it with 'cmake --preset release "
                    "&& cmake --build --preset release', or install the add-on from a release for "
                    "this platform", path=path))
    try:
        damage = library_file.damage(path)
        if damage:
            raise RaybundleError(
                ErrorCode.INVALID_OPERATION,
                Message("The native library is damaged: {path} ({damage}). Install the add-on "
                        "again from its zip, or build the library again", path=path,
                        damage=damage))
        library = ctypes.CDLL(str(path))
        library.rb_get_abi_version.restype = _int
        version = library.rb_get_abi_version()
    except (OSError, AttributeError) as error:
        raise RaybundleError(
            ErrorCode.INVALID_OPERATION,
            Message("The native library cannot be loaded: {path} ({error}). Build it again, or "
                    "install the add-on from a release for this platform", path=path,
                    error=error)) from error
    if version != ABI_VERSION:
        raise RaybundleError(
            ErrorCode.INVALID_OPERATION,
            Message("The native library {path} has interface version {version}, but this add-on "
                    "needs {needed}: build or install both from the same release", path=path,
                    version=version, needed=ABI_VERSION))
    try:
        _declare(library)
    except AttributeError as error:
        raise RaybundleError(
            ErrorCode.INVALID_OPERATION,
            Message("The native library {path} lacks a function of interface version {version} "
                    "({error}): build or install both from the same release", path=path,
                    version=ABI_VERSION, error=error)) from error
    _library = library
    return library


def version() -> str:
    """Returns the release of the native library as "major.minor.patch"."""
    return load().rb_get_version().decode()


def _declare(library: ctypes.CDLL) -> None:
    for name, (result, arguments) in _INFALLIBLE.items():
        function = getattr(library, name)
        function.restype = result
        function.argtypes = arguments

    def raise_on_error(code: int, function: object, arguments: tuple) -> int:
        if code != ErrorCode.NONE:
            message = library.rb_get_error_message().decode(errors='replace')
            raise RaybundleError(code, library_messages.recognised(message))
        return code

    for name, arguments in _FALLIBLE.items():
        function = getattr(library, name)
        function.restype = _enum
        function.argtypes = arguments
        function.errcheck = raise_on_error


# --------------------------------------------------------------------------------------------------
# Arrays
# --------------------------------------------------------------------------------------------------


def _array(values: object, dtype: type, shape: tuple[int | None, ...], name: str) -> np.ndarray:
    """Converts values to a C-contiguous array of the given type and shape. None in shape stands for
    any length.

    Floats may change precision and integers size, but floats are not converted to integers. Raises
    TypeError or ValueError, with the name of the array, if type or shape do not fit.
    """
    array = np.asarray(values)
    if array.size and not np.can_cast(array.dtype, dtype, casting='same_kind'):
        raise TypeError(f"{name}: expected {np.dtype(dtype).name}, got {array.dtype.name}")
    if array.ndim != len(shape) or any(
            expected is not None and expected != given
            for expected, given in zip(shape, array.shape)):
        raise ValueError(f"{name}: expected shape {shape}, got {array.shape}")
    return np.ascontiguousarray(array, dtype=dtype)


def _float_array(values: object, shape: tuple[int | None, ...], name: str) -> np.ndarray:
    return _array(values, np.float32, shape, name)


def _int_array(values: object, shape: tuple[int | None, ...], name: str) -> np.ndarray:
    return _array(values, np.int32, shape, name)


def _as_floats(array: np.ndarray) -> object:
    return array.ctypes.data_as(_floats)


def _as_ints(array: np.ndarray) -> object:
    return array.ctypes.data_as(_ints)


def _fill(target: ctypes.Structure, data: object, name: str) -> None:
    """Sets the members of a struct from the members with equal names of data, a dataclass of
    surface_data.py. Factors by angle are the rows of an array."""
    if isinstance(target, _AngleFactors):
        rows = _float_array(data, (len(target._fields_), 3), name)
        for (member, _), row in zip(target._fields_, rows):
            getattr(target, member)[:] = row
        return
    for item in dataclasses.fields(data):
        member, value = getattr(target, item.name), getattr(data, item.name)
        path = f"{name}.{item.name}"
        if isinstance(member, ctypes.Structure):
            _fill(member, value, path)
        elif isinstance(member, _rgb):
            member[:] = _float_array(value, (3,), path)
        else:
            setattr(target, item.name, NO_IMAGE if value is None else value)


class _Handle:
    """Owns a native object, which close() or the end of a with block releases."""

    _release = ""

    def __init__(self) -> None:
        self._library = load()
        self._pointer = _handle()

    def close(self) -> None:
        """Releases the native object. Does nothing if it was released before."""
        if self._pointer:
            getattr(self._library, self._release)(self._pointer)
            self._pointer = _handle()

    @property
    def is_closed(self) -> bool:
        return not self._pointer

    def __enter__(self):
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def __del__(self) -> None:
        # If the library could not be loaded, there is no pointer.
        if getattr(self, '_pointer', None):
            self.close()


# --------------------------------------------------------------------------------------------------
# Scene
# --------------------------------------------------------------------------------------------------


class Scene(_Handle):
    """The native library's scene: images, materials, meshes, instances, lights and world.

    Arrays are copied. Methods whose name begins with "add" return the id of the added element. All
    methods raise RaybundleError if the library rejects the arguments.
    """

    _release = 'rb_release_scene'

    def __init__(self) -> None:
        super().__init__()
        self._library.rb_new_scene(ctypes.byref(self._pointer))

    def add_image(self, name: str, pixels: np.ndarray, extension: str) -> int:
        """Adds an image. pixels: (height, width, 3) float, linear RGB, bottom row first. extension:
        a key of IMAGE_EXTENSIONS."""
        pixels = _float_array(pixels, (None, None, 3), "pixels")
        identifier = _int()
        self._library.rb_add_image(
            self._pointer, name.encode(), pixels.shape[1], pixels.shape[0], _as_floats(pixels),
            IMAGE_EXTENSIONS[extension], ctypes.byref(identifier))
        return identifier.value

    def add_material(self, name: str, front: SurfaceData, back: SurfaceData,
                     opacity: float = 1.0, opacity_image: int | None = None) -> int:
        """Adds a material. opacity: 0 to 1, share of the light that does not pass straight through.
        The mean of the channels of opacity_image, the id of an image, multiplies it; None: no
        image."""
        sides = [self._surface(data, side) for data, side in ((front, "front"), (back, "back"))]
        identifier = _int()
        self._library.rb_add_material(
            self._pointer, name.encode(), *map(ctypes.byref, sides), opacity,
            NO_IMAGE if opacity_image is None else opacity_image, ctypes.byref(identifier))
        return identifier.value

    def _surface(self, data: SurfaceData, name: str) -> _Surface:
        surface = _Surface()
        self._library.rb_init_surface(ctypes.byref(surface), ctypes.sizeof(surface))
        _fill(surface, data, name)
        return surface

    def add_mesh(self, name: str, vertices: np.ndarray, corner_vertices: np.ndarray,
                 face_offsets: np.ndarray, face_materials: np.ndarray | None) -> int:
        """Adds a mesh. vertices: (n, 3) m. corner_vertices: (c,), vertex of each corner.
        face_offsets: (f + 1,), first corner of each face, and c. face_materials: (f,), ids, or None
        for a grey of 0.8."""
        vertices = _float_array(vertices, (None, 3), "vertices")
        corner_vertices = _int_array(corner_vertices, (None,), "corner_vertices")
        face_offsets = _int_array(face_offsets, (None,), "face_offsets")
        face_count = len(face_offsets) - 1
        materials = None
        if face_materials is not None:
            face_materials = _int_array(face_materials, (face_count,), "face_materials")
            materials = _as_ints(face_materials)
        identifier = _int()
        self._library.rb_add_mesh(
            self._pointer, name.encode(), _as_floats(vertices), len(vertices),
            _as_ints(corner_vertices), len(corner_vertices), _as_ints(face_offsets), face_count,
            materials, ctypes.byref(identifier))
        return identifier.value

    def set_mesh_corner_normals(self, mesh: int, normals: np.ndarray) -> None:
        """Sets the shading normals of a mesh. normals: (c, 3), unit length, per corner."""
        normals = _float_array(normals, (None, 3), "normals")
        self._library.rb_set_mesh_corner_normals(
            self._pointer, mesh, _as_floats(normals), len(normals))

    def set_mesh_sharp_edges(self, mesh: int, edges: np.ndarray) -> None:
        """Sets the sharp edges of a mesh. edges: (e, 2), the two vertices of each edge."""
        edges = _int_array(edges, (None, 2), "edges")
        self._library.rb_set_mesh_sharp_edges(self._pointer, mesh, _as_ints(edges), len(edges))

    def set_mesh_uvs(self, mesh: int, uvs: np.ndarray) -> None:
        """Sets the coordinates at which materials read images. uvs: (c, 2), per corner."""
        uvs = _float_array(uvs, (None, 2), "uvs")
        self._library.rb_set_mesh_uvs(self._pointer, mesh, _as_floats(uvs), len(uvs))

    def set_mesh_corner_colors(self, mesh: int, colors: np.ndarray) -> None:
        """Sets the colours for materials with corner colours. colors: (c, 3), linear RGB, per
        corner."""
        colors = _float_array(colors, (None, 3), "colors")
        self._library.rb_set_mesh_corner_colors(
            self._pointer, mesh, _as_floats(colors), len(colors))

    def add_instance(self, mesh: int, name: str, transform: np.ndarray, role: str,
                     side: str) -> int:
        """Adds an instance of a mesh. transform: (3, 4), object to world. role: a key of ROLES.
        side: a key of SIDES."""
        transform = _float_array(transform, (3, 4), "transform")
        identifier = _int()
        self._library.rb_add_instance(
            self._pointer, mesh, name.encode(), _as_floats(transform), ROLES[role], SIDES[side],
            ctypes.byref(identifier))
        return identifier.value

    def add_point_light(self, name: str, position: np.ndarray, intensity: np.ndarray,
                        radius: float, shape: str) -> int:
        """Adds a point light. position: (3,) m. intensity: (3,) W/sr. radius: m. shape: a key of
        POINT_SHAPES."""
        position = _float_array(position, (3,), "position")
        intensity = _float_array(intensity, (3,), "intensity")
        identifier = _int()
        self._library.rb_add_point_light(
            self._pointer, name.encode(), _as_floats(position), _as_floats(intensity), radius,
            POINT_SHAPES[shape], ctypes.byref(identifier))
        return identifier.value

    def set_light_cone(self, light: int, world_to_light: np.ndarray, angle: float,
                       blend: float, dims_by_cosine: bool) -> None:
        """Makes a point light a spot light, which shines along its -Z axis. world_to_light: (3, 3).
        angle: full opening in radians. blend: 0 to 1, share of the cone in which the light fades.
        dims_by_cosine: whether the intensity falls off with the cosine to the axis."""
        world_to_light = _float_array(world_to_light, (3, 3), "world_to_light")
        self._library.rb_set_light_cone(
            self._pointer, light, _as_floats(world_to_light), angle, blend, dims_by_cosine)

    def add_sun_light(self, name: str, direction: np.ndarray, irradiance: np.ndarray,
                      angle: float) -> int:
        """Adds a sun. direction: (3,), towards the sun. irradiance: (3,) W/m^2, at normal
        incidence. angle: angular diameter in radians."""
        direction = _float_array(direction, (3,), "direction")
        irradiance = _float_array(irradiance, (3,), "irradiance")
        identifier = _int()
        self._library.rb_add_sun_light(
            self._pointer, name.encode(), _as_floats(direction), _as_floats(irradiance), angle,
            ctypes.byref(identifier))
        return identifier.value

    def add_area_light(self, name: str, centre: np.ndarray, axis_u: np.ndarray,
                       axis_v: np.ndarray, radiance: np.ndarray, shape: str) -> int:
        """Adds an area light. centre: (3,) m. axis_u, axis_v: (3,) m, half axes. radiance: (3,)
        W/(m^2 sr). shape: a key of AREA_SHAPES."""
        centre = _float_array(centre, (3,), "centre")
        axis_u = _float_array(axis_u, (3,), "axis_u")
        axis_v = _float_array(axis_v, (3,), "axis_v")
        radiance = _float_array(radiance, (3,), "radiance")
        identifier = _int()
        self._library.rb_add_area_light(
            self._pointer, name.encode(), _as_floats(centre), _as_floats(axis_u),
            _as_floats(axis_v), _as_floats(radiance), AREA_SHAPES[shape],
            ctypes.byref(identifier))
        return identifier.value

    def set_light_spread(self, light: int, spread: float) -> None:
        """Limits the directions of the light of an area light. spread: full opening in radians, 0
        to pi."""
        self._library.rb_set_light_spread(self._pointer, light, spread)

    def set_light_shadows(self, light: int, casts_shadows: bool) -> None:
        """Sets whether surfaces block the light of a lamp. They do by default."""
        self._library.rb_set_light_shadows(self._pointer, light, casts_shadows)

    def remove_lights(self) -> None:
        """Removes all lights. Lights that are added get their ids."""
        self._library.rb_remove_lights(self._pointer)

    def set_instance_visibility(self, instance: int, stops_direct: bool, exchanges: bool) -> None:
        """Sets which light an instance affects. stops_direct: whether the instance blocks direct
        light. exchanges: whether the instance reflects light to other surfaces and blocks their
        light."""
        self._library.rb_set_instance_visibility(self._pointer, instance, stops_direct, exchanges)

    def set_instance_quality(self, instance: int, noise: float, patch_size: float) -> None:
        """Sets how exactly the light of an instance is computed. noise: factor on target_error.
        patch_size: factor on the edge length of the instance's patches. Both 0.01 to 100."""
        self._library.rb_set_instance_quality(self._pointer, instance, noise, patch_size)

    def set_result_corners(self, instance: int, corners: np.ndarray) -> None:
        """Limits the results of an instance to some corners. corners: (k,), the corners of the
        instance's mesh whose light will be read."""
        corners = _int_array(corners, (None,), "corners")
        self._library.rb_set_result_corners(self._pointer, instance, _as_ints(corners),
                                            len(corners))

    def set_world(self, radiance: np.ndarray) -> None:
        """Sets the constant light of the world. radiance: (3,) W/(m^2 sr), equal in all
        directions."""
        radiance = _float_array(radiance, (3,), "radiance")
        self._library.rb_set_world(self._pointer, _as_floats(radiance))

    def set_world_image(self, pixels: np.ndarray) -> None:
        """Sets the image of the world, which is added to the radiance of set_world. pixels:
        (height, width, 3) W/(m^2 sr), equirectangular as in Cycles, bottom row first."""
        pixels = _float_array(pixels, (None, None, 3), "pixels")
        self._library.rb_set_world_image(
            self._pointer, pixels.shape[1], pixels.shape[0], _as_floats(pixels))

    def add_light_set(self, name: str) -> int:
        """Adds a light set, which contains no lights yet."""
        identifier = _int()
        self._library.rb_add_light_set(self._pointer, name.encode(), ctypes.byref(identifier))
        return identifier.value

    def set_light_set(self, light: int, light_set: int) -> None:
        """Puts a light into a light set."""
        self._library.rb_set_light_set(self._pointer, light, light_set)

    def set_instance_light_set(self, instance: int, light_set: int) -> None:
        """Puts the emission of an instance into a light set."""
        self._library.rb_set_instance_light_set(self._pointer, instance, light_set)

    def set_world_light_set(self, light_set: int) -> None:
        """Puts the light of the world into a light set."""
        self._library.rb_set_world_light_set(self._pointer, light_set)


# --------------------------------------------------------------------------------------------------
# Bake
# --------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Setting:
    """The library's description of a setting of a bake."""

    name: str
    type: type  # int, float, or str for a choice
    help: str
    unit: str  # "m", "MB", or "" if the setting has no unit
    least: float  # smallest allowed value of a number; 0 for a choice
    most: float  # largest allowed value of a number; 0 for a choice
    default: int | float | str
    choices: dict[str, str]  # help of each choice by name, in a fixed order; empty for numbers
    # Name of the choice that determines whether the setting has an effect, and its values for which
    # the setting has one. If the name is empty, the setting always has an effect.
    used_with: str = ""
    used_with_choices: frozenset[str] = frozenset()


@functools.cache
def settings() -> dict[str, Setting]:
    """Returns all settings of a bake by name. Raises RaybundleError if the library cannot be
    loaded."""
    library = load()
    result, used_with = {}, {}
    for index in range(library.rb_get_setting_count()):
        info = _SettingInfo(size=ctypes.sizeof(_SettingInfo))
        library.rb_get_setting_info(index, ctypes.byref(info))
        kind = SETTING_TYPES[info.type]
        default = info.default_choice.decode() if kind is str else kind(info.default_number)
        choices = {info.choices[k].decode(): info.choice_help[k].decode()
                   for k in range(info.choice_count)}
        name = info.name.decode()
        result[name] = Setting(name, kind, info.help.decode(), info.unit.decode(), info.least,
                               info.most, default, choices)
        if info.used_with:
            used_with[name] = info.used_with.decode(), info.used_with_choices
    for name, (choice, bits) in used_with.items():
        values = frozenset(value for k, value in enumerate(result[choice].choices) if bits >> k & 1)
        result[name] = dataclasses.replace(result[name], used_with=choice,
                                           used_with_choices=values)
    return result


def _setting_type(name: str) -> type:
    """Returns the type of a setting. Returns float for an unknown name, which the library itself
    rejects."""
    return settings()[name].type if name in settings() else float


@dataclasses.dataclass(frozen=True)
class AdaptedMesh:
    """A mesh whose faces lie on those of a source mesh, with n vertices, c corners and f faces."""

    vertices: np.ndarray  # (n, 3) float32, object space, m; those of the source come first
    corner_vertices: np.ndarray  # (c,) int32
    source_corners: np.ndarray  # (c, 3) int32, the source's corners between which a corner lies
    source_weights: np.ndarray  # (c, 3) float32, their weights, which sum to 1
    # (c,) int32: the source's corner at which the source's edge begins on which the edge from the
    # corner to the next lies; -1: it crosses a face of the source.
    source_edges: np.ndarray
    face_offsets: np.ndarray  # (f + 1,) int32, the first corner of each face
    source_faces: np.ndarray  # (f,) int32, the source's face that contains the face


class Bake(_Handle):
    """A bake: its settings, execution and results. Patches and lines are kept for the next
    execution."""

    _release = 'rb_release_bake'

    def __init__(self) -> None:
        super().__init__()
        self._library.rb_new_bake(ctypes.byref(self._pointer))

    def set(self, name: str, value: int | float | str) -> None:
        """Sets a setting. name: a key of settings(). Raises RaybundleError if the name is unknown
        or the value is not allowed."""
        kind = _setting_type(name)
        if kind is str:
            self._library.rb_set_bake_string(self._pointer, name.encode(), str(value).encode())
        elif kind is int:
            self._library.rb_set_bake_int(self._pointer, name.encode(), int(value))
        else:
            self._library.rb_set_bake_float(self._pointer, name.encode(), float(value))

    def get(self, name: str) -> int | float | str:
        """Returns the value of a setting. name: a key of settings(). Raises RaybundleError if the
        name is unknown."""
        kind = _setting_type(name)
        if kind is str:
            text = _text()
            self._library.rb_get_bake_string(self._pointer, name.encode(), ctypes.byref(text))
            return text.value.decode()
        if kind is int:
            integer = _int()
            self._library.rb_get_bake_int(self._pointer, name.encode(), ctypes.byref(integer))
            return integer.value
        real = _float()
        self._library.rb_get_bake_float(self._pointer, name.encode(), ctypes.byref(real))
        return real.value

    def execute(self, scene: Scene, progress: Progress | None = None) -> None:
        """Bakes a scene. Raises RaybundleError, with code CANCELLED if progress returned False. An
        exception in progress also cancels the bake and is raised again here. If progress calls
        close(), there are no results."""
        raised: list[BaseException] = []

        def report(_user: object, stage: int, fraction: float) -> bool:
            try:
                return progress(STAGES[stage], fraction) is not False
            except BaseException as exception:
                # An exception must not cross the C frames between this function and execute.
                raised.append(exception)
                return False

        # Keep the function object in this frame, because it must exist as long as the library may
        # call it.
        function = _ProgressFunction(report) if progress else _ProgressFunction()
        self._library.rb_set_bake_progress(self._pointer, function, None)
        try:
            self._library.rb_execute_bake(self._pointer, scene._pointer)
        except RaybundleError:
            if raised:
                raise raised[0]
            raise
        finally:
            if not self.is_closed:  # progress may have closed the bake
                self._library.rb_set_bake_progress(self._pointer, _ProgressFunction(), None)
        if raised:
            raise raised[0]

    def corner_light(self, instance: int, output: str, count: int, light_set: int | None = None
                     ) -> np.ndarray:
        """Returns the light at the corners of an instance's mesh, (count, 3) float32. output: a key
        of OUTPUTS. count: number of corners. light_set: id, or None for the light of all lights."""
        return self._light('corner', instance, output, count, light_set)

    def vertex_light(self, instance: int, output: str, count: int, light_set: int | None = None
                     ) -> np.ndarray:
        """Returns the light at the vertices of an instance's mesh, (count, 3) float32. output: a
        key of OUTPUTS. count: number of vertices. light_set: id, or None for the light of all
        lights."""
        return self._light('vertex', instance, output, count, light_set)

    def _light(self, element: str, instance: int, output: str, count: int,
               light_set: int | None) -> np.ndarray:
        """Returns corner_light or vertex_light. element: 'corner' or 'vertex'."""
        light = np.empty((count, 3), np.float32)
        arguments = (instance, OUTPUTS[output], _as_floats(light), count)
        if light_set is None:
            getattr(self._library, f'rb_get_{element}_light')(self._pointer, *arguments)
        else:
            getattr(self._library, f'rb_get_set_{element}_light')(
                self._pointer, light_set, *arguments)
        return light

    def corner_error(self, instance: int, count: int) -> np.ndarray:
        """Returns the stated error of LIGHTING at the corners of an instance's mesh, (count,)
        float32, W/(m^2 sr). count: number of corners."""
        error = np.empty(count, np.float32)
        self._library.rb_get_corner_error(self._pointer, instance, _as_floats(error), count)
        return error

    def adapted_mesh(self, instance: int) -> AdaptedMesh:
        """Returns the mesh at whose corners the light of an instance is, after an execution with
        the setting adapt_meshes. Raises RaybundleError if the last one had it off."""
        sizes = [_size() for _ in range(3)]
        self._library.rb_get_adapted_mesh_size(self._pointer, instance, *map(ctypes.byref, sizes))
        vertices, corners, faces = (size.value for size in sizes)
        mesh = AdaptedMesh(np.empty((vertices, 3), np.float32), np.empty(corners, np.int32),
                           np.empty((corners, 3), np.int32), np.empty((corners, 3), np.float32),
                           np.empty(corners, np.int32), np.empty(faces + 1, np.int32),
                           np.empty(faces, np.int32))
        self._library.rb_get_adapted_mesh(
            self._pointer, instance, _as_floats(mesh.vertices), vertices,
            _as_ints(mesh.corner_vertices), _as_ints(mesh.source_corners),
            _as_floats(mesh.source_weights), _as_ints(mesh.source_edges), corners,
            _as_ints(mesh.face_offsets), _as_ints(mesh.source_faces), faces)
        return mesh

    def report(self) -> dict:
        """Returns the native part of the report of the last successful execution. Raises
        RaybundleError if there was none."""
        text = _text()
        self._library.rb_get_report(self._pointer, ctypes.byref(text))
        return json.loads(text.value.decode())


@dataclasses.dataclass(frozen=True)
class RunState:
    """What a run is doing."""

    is_running: bool
    stage: str  # one of STAGES, the present or the last one
    fraction: float  # finished share of the stage, 0 to 1
    noise: float | None  # the noise so far, relative to the light; None: not known yet
    interim: int  # number of times that interim light was made


class Run(_Handle):
    """A bake in a thread of the native library. The bake and the scene are in use until it has
    ended. close() cancels a run that goes on, and waits for its end."""

    _release = 'rb_release_run'

    def __init__(self, bake: Bake, scene: Scene) -> None:
        """Starts the run. Raises RaybundleError if the bake or the scene is in use."""
        super().__init__()
        self._library.rb_start_bake(bake._pointer, scene._pointer, ctypes.byref(self._pointer))

    def state(self) -> RunState:
        """Returns what the run is doing now."""
        state = _RunState(size=ctypes.sizeof(_RunState))
        self._library.rb_get_run_state(self._pointer, ctypes.byref(state))
        return RunState(state.is_running, STAGES[state.stage], state.fraction,
                        state.noise if state.noise >= 0.0 else None, state.interim)

    def light(self, instance: int, output: str, count: int) -> np.ndarray:
        """Returns the interim light at the corners of an instance's mesh, (count, 3) float32.
        output: a key of OUTPUTS. count: number of corners. Raises RaybundleError while
        state().interim is 0."""
        light = np.empty((count, 3), np.float32)
        self._library.rb_get_run_light(self._pointer, instance, OUTPUTS[output], _as_floats(light),
                                       count)
        return light

    def cancel(self) -> None:
        """Asks the run to end, and does not wait for its end."""
        self._library.rb_cancel_run(self._pointer)

    def finish(self) -> None:
        """Waits for the end of the run. Raises RaybundleError if the bake failed, with code
        CANCELLED if it was cancelled."""
        self._library.rb_finish_run(self._pointer)


# --------------------------------------------------------------------------------------------------
# Subdivision
# --------------------------------------------------------------------------------------------------


class Subdivision(_Handle):
    """A conforming triangle mesh, built from another mesh, with edges of at most max_edge, m.

    Each corner of a triangle lies between three corners of one face of the source mesh.

    vertices        (n, 3) float32, m
    triangles       (t, 3) int32, vertex indices
    source_faces    (t,) int32, the face of the source mesh that contains the triangle
    source_corners  (t, 3, 3) int32, three source corners for each corner of a triangle
    source_weights  (t, 3, 3) float32, the weights of the source corners, which sum to 1
    """

    _release = 'rb_release_subdivision'

    def __init__(self, vertices: np.ndarray, corner_vertices: np.ndarray,
                 face_offsets: np.ndarray, max_edge: float) -> None:
        super().__init__()
        vertices = _float_array(vertices, (None, 3), "vertices")
        corner_vertices = _int_array(corner_vertices, (None,), "corner_vertices")
        face_offsets = _int_array(face_offsets, (None,), "face_offsets")
        self._library.rb_new_subdivision(
            _as_floats(vertices), len(vertices), _as_ints(corner_vertices), len(corner_vertices),
            _as_ints(face_offsets), len(face_offsets) - 1, max_edge, ctypes.byref(self._pointer))
        vertex_count, triangle_count = _size(), _size()
        self._library.rb_get_subdivision_size(
            self._pointer, ctypes.byref(vertex_count), ctypes.byref(triangle_count))
        count = triangle_count.value
        self.vertices = np.empty((vertex_count.value, 3), np.float32)
        self.triangles = np.empty((count, 3), np.int32)
        self.source_faces = np.empty(count, np.int32)
        self.source_corners = np.empty((count, 3, 3), np.int32)
        self.source_weights = np.empty((count, 3, 3), np.float32)
        self._library.rb_get_subdivision(
            self._pointer, _as_floats(self.vertices), len(self.vertices),
            _as_ints(self.triangles), _as_ints(self.source_faces), _as_ints(self.source_corners),
            _as_floats(self.source_weights), count)


class Simplification(_Handle):
    """A mesh without the vertices of a source mesh that its shape and the values at its corners do
    not need. It has c corners and f faces: those of the source from which nothing was removed, and
    triangles.

    source_corners  (c,) int32, the source's corner with the vertex and the values of each corner
    source_edges    (c,) int32, the source's corner at which an edge begins that stays one and on
                    which the edge from the corner to the next lies; -1: there is none
    face_offsets    (f + 1,) int32, the first corner of each face
    source_faces    (f,) int32, a face of the source with the kind of each face
    changes         (v,) float32, RMS over the vertices of the change of each value

    The source has n corners and m faces. face_kinds: (m,), faces of different kinds stay apart.
    kept_edges: (n,), whether the edge from each corner to the next stays one. values: (n, v).
    tolerances: (v,), the largest change of each value at any vertex. distance: of removed vertices
    from the surface, m.
    """

    _release = 'rb_release_simplification'

    def __init__(self, vertices: np.ndarray, corner_vertices: np.ndarray, face_offsets: np.ndarray,
                 face_kinds: np.ndarray, kept_edges: np.ndarray, values: np.ndarray,
                 tolerances: np.ndarray, distance: float) -> None:
        super().__init__()
        vertices = _float_array(vertices, (None, 3), "vertices")
        corner_vertices = _int_array(corner_vertices, (None,), "corner_vertices")
        face_offsets = _int_array(face_offsets, (None,), "face_offsets")
        corners, faces = len(corner_vertices), len(face_offsets) - 1
        face_kinds = _int_array(face_kinds, (faces,), "face_kinds")
        kept_edges = _int_array(kept_edges, (corners,), "kept_edges")
        tolerances = _float_array(tolerances, (None,), "tolerances")
        values = _float_array(values, (corners, len(tolerances)), "values")
        self._library.rb_new_simplification(
            _as_floats(vertices), len(vertices), _as_ints(corner_vertices), corners,
            _as_ints(face_offsets), faces, _as_ints(face_kinds), _as_ints(kept_edges),
            _as_floats(values), _as_floats(tolerances), len(tolerances), distance,
            ctypes.byref(self._pointer))
        corner_count, face_count = _size(), _size()
        self._library.rb_get_simplification_size(
            self._pointer, ctypes.byref(corner_count), ctypes.byref(face_count))
        self.source_corners = np.empty(corner_count.value, np.int32)
        self.source_edges = np.empty(corner_count.value, np.int32)
        self.face_offsets = np.empty(face_count.value + 1, np.int32)
        self.source_faces = np.empty(face_count.value, np.int32)
        self.changes = np.empty(len(tolerances), np.float32)
        self._library.rb_get_simplification(
            self._pointer, _as_ints(self.source_corners), _as_ints(self.source_edges),
            corner_count.value, _as_ints(self.face_offsets), _as_ints(self.source_faces),
            face_count.value, _as_floats(self.changes), len(self.changes))
