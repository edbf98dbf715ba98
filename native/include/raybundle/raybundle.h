/* SPDX-License-Identifier: GPL-3.0-or-later
 * Raybundle: diffuse global illumination of a scene by bundles of parallel global lines, baked to
 * the corners and vertices of its meshes.
 *
 * This is the whole C99 interface, in the order a caller needs it:
 *   scene (images, materials, meshes, instances, lights, world)
 *   -> bake (settings, progress, execute)
 *   -> light per corner or vertex, report.
 *
 * Conventions
 * - Units: metres, W/m^2 (emission, irradiance), W/(m^2 sr) (radiance), W/sr (intensity). All
 * colours are linear RGB, three floats.
 * - Light of more than 1e15 in these units (of an area light: times its area) and what reaches further
 *   than 1e12 m from the origin are refused.
 * - Every fallible function returns an rb_error; rb_get_error_message() explains the last failure
 * of the calling thread and names the object concerned. Output parameters are untouched on failure.
 * - Arrays are pointer + count, are read or written only during the call, and stay the caller's. No
 *   memory of the caller is kept.
 * - Different handles may be used from different threads at once. A call with a handle that another
 * call is not done with, in another thread or around the progress function, fails with
 * RB_ERROR_INVALID_OPERATION. Handles are numbers and no addresses; one that was released, or is of
 * another kind, fails with RB_ERROR_INVALID_ARGUMENT, and its release does nothing.
 */
#ifndef RAYBUNDLE_H
#define RAYBUNDLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define RB_API __declspec(dllexport)
#else
#define RB_API __attribute__((visibility("default")))
#endif

/* C++ must not see a value that an enum does not have, as a caller may pass one, unless its type is
 * fixed. */
#ifdef __cplusplus
#define RB_INT : int32_t
extern "C" {
#else
#define RB_INT
#endif

/* ------------------------------------------------------------------------------------------------
 * Version and errors
 * --------------------------------------------------------------------------------------------- */

/* Raised by one whenever a signature or a meaning below changes; a caller built for another one
 * must not go on. */
#define RB_ABI_VERSION 2

/* RB_ABI_VERSION of the library that was loaded. */
RB_API int32_t rb_get_abi_version(void);

/* Release of the library, "major.minor.patch". Static memory. */
RB_API const char* rb_get_version(void);

typedef enum rb_error RB_INT {
    RB_ERROR_NONE = 0,
    RB_ERROR_UNKNOWN = 1,
    RB_ERROR_INVALID_ARGUMENT = 2, /* the message names the argument or the object */
    RB_ERROR_INVALID_OPERATION =
        3, /* the call came at the wrong time, e.g. results before a bake */
    RB_ERROR_OUT_OF_MEMORY = 4,
    RB_ERROR_UNSUPPORTED_HARDWARE = 5,
    RB_ERROR_CANCELLED = 6 /* the progress function returned false */
} rb_error;

/* What the last failing call of this thread said (UTF-8, at most 2047 bytes of it), or "" if none
 * failed yet. Valid until the next failing call of this thread. */
RB_API const char* rb_get_error_message(void);

/* ------------------------------------------------------------------------------------------------
 * Scene: what the user has, copied in
 * --------------------------------------------------------------------------------------------- */

typedef struct rb_scene_impl* rb_scene;

/* Makes an empty scene in *scene; the caller releases it. */
RB_API rb_error rb_new_scene(rb_scene* scene);

/* Frees the scene, or lets the call that is at work with it do so. NULL is allowed. A bake keeps what
 * it needs, so the scene may go first. */
RB_API void rb_release_scene(rb_scene scene);

typedef enum rb_image_extension RB_INT {
    RB_IMAGE_REPEAT = 0,
    RB_IMAGE_EXTEND = 1, /* border pixels go on */
    RB_IMAGE_CLIP = 2    /* black outside */
} rb_image_extension;

/* Adds an image of width * height linear RGB pixels, bottom row first as in Blender. Id in *image.
 */
RB_API rb_error rb_add_image(rb_scene scene, const char* name, int32_t width, int32_t height,
                             const float* rgb, rb_image_extension extension, int32_t* image);

/* Stands for no image where a material may have one. */
#define RB_NO_IMAGE (-1)

/* A colour that may vary over a mesh, RGB:
 *   constant + image_weight * image + corner_color_weight * corner colours
 * averaged over each patch, where a negative sum counts as 0. Weights are finite and may be
 * negative.
 *   image                of rb_add_image, or RB_NO_IMAGE. It is read at the UVs of the mesh
 *                        (rb_set_mesh_uvs) and black on a mesh without UVs
 *   image_weight         not used without an image
 *   corner_color_weight  of the colours of rb_set_mesh_corner_colors, which are black on a mesh
 *                        without them */
typedef struct rb_color {
    float constant[3];
    int32_t image;
    float image_weight[3];
    float corner_color_weight[3];
} rb_color;

/* How a share of light depends on the cosine c between the normal and the direction of the light:
 * the sum of four terms, each times a factor (RGB, finite). The mean of a term is that over light
 * from all directions. */
typedef struct rb_angle_factors {
    float linear[3];       /* of 1 - c; mean 1/3 */
    float square[3];       /* of (1 - c)^2; mean 1/6 */
    float fifth[3];        /* of (1 - c)^5; mean 1/21 */
    float cosine_fifth[3]; /* of c (1 - c)^5; mean 1/84 */
} rb_angle_factors;

/* A part of the reflectance of a side, which may vary with it: scale * reflectance + offset (RGB,
 * finite). */
typedef struct rb_part {
    float scale[3];
    float offset[3];
} rb_part;

/* What outputs show of a side.
 *   color       the diffuse colour, which outputs with colour show; counts as 0 to 1
 *   from_above  the share that is shown of light that comes along the normal (RGB, finite)
 *   by_angle    what is added to from_above for light from other directions. The sum counts as 0 to
 *               16. */
typedef struct rb_shown {
    rb_part color;
    float from_above[3];
    rb_angle_factors by_angle;
} rb_shown;

/* How the shadowing and the masking of facets go together: both by the height of the facet, as in
 * Cycles from Blender 4.0 on, or each by itself. */
typedef enum rb_masking RB_INT { RB_MASKING_CORRELATED = 0, RB_MASKING_SEPARATE = 1 } rb_masking;

/* The part of the reflectance that is mirrored by facets, as GGX has it. With first shot GATHER and
 * solver LINE_REUSE its light goes where GGX sends it to, with others where diffuse light goes.
 *   part       for light from all directions; counts as 0 to the reflectance
 *   by_angle   what of rb_surface.reflectance_by_angle is mirrored
 *   roughness  0 to 1, whose square is the alpha of GGX. For where light goes less than 0.45 counts
 *              as 0.45. */
typedef struct rb_gloss {
    rb_part part;
    rb_angle_factors by_angle;
    float roughness;
    rb_masking masking;
} rb_gloss;

/* A part of the reflectance that has a lobe of its own. With first shot GATHER and solver LINE_REUSE
 * its light goes where the lobe sends it to, with others where diffuse light goes.
 *   reflectance  for light from all directions (RGB, finite); less than 0 counts as 0
 *   by_angle     what of rb_surface.reflectance_by_angle the lobe sends
 *   roughness    0 to 1 */
typedef struct rb_lobe {
    float reflectance[3];
    rb_angle_factors by_angle;
    float roughness;
} rb_lobe;

typedef enum rb_diffuse_model RB_INT {
    RB_DIFFUSE_LAMBERT = 0,
    RB_DIFFUSE_BURLEY = 1,
    RB_DIFFUSE_OREN_NAYAR = 2
} rb_diffuse_model;

/* Where the rest of the reflected light goes: what neither gloss nor a lobe sends.
 *   model      where light goes with first shot GATHER and solver LINE_REUSE; with others as by
 *              Lambert's law
 *   roughness  0 to 1; not used by Lambert's law
 *   leaving    how the rest leaves by angle, as from under a layer that lets less of it out at some
 *              angles: 1 plus the sum of these factors times their terms less the means of the
 *              terms, at the angle at which light leaves. Solver LINE_REUSE only. */
typedef struct rb_diffuse {
    rb_diffuse_model model;
    float roughness;
    rb_angle_factors leaving;
} rb_diffuse;

/* What one side of a material does with light. rb_init_surface sets all members to their defaults,
 * which are 0 where nothing else is named, no image and the first value of an enum.
 *   size          of this struct in the header of the caller, in bytes. Later versions have more
 *                 members at the end: a library that knows more than the caller takes their
 *                 defaults, one that knows less refuses the surface.
 *   reflectance   albedo; its constant is not negative. 1 or more is clamped to 0.999, with a
 *                 warning in the report. Default: 0.8
 *   emission      exitance in W/m^2, pi times the radiance; its constant is 0 to 1e15
 *   translucence  the share of the light that arrives at the other side of the material and leaves
 *                 this side, as if this side reflected it. Outputs with colour show it. Together
 *                 with the reflectance at most 0.999, else clamped. Solver LINE_REUSE only.
 *   reflectance_by_angle  how the reflectance depends on the angle of the light of the sources, with
 *                 first shot GATHER: light from one direction meets more than the reflectance, which
 *                 is for light from all directions, by the sum of these factors times their terms
 *                 less the means of the terms.
 *   shown         default: all of the reflectance is diffuse colour, and all light is shown alike
 *   microfibers   sheen as Cycles has it from Blender 4.0 on
 *   velvet        Cycles' velvet; its roughness is sigma
 *   burley_sheen  sheen as Cycles has it before Blender 4.0; its roughness is not used
 *   several_facets  what gloss reflects after several facets; its roughness is as that of gloss
 * Where the material lets light straight through (opacity of rb_add_material) all these are of the
 * whole surface, so that the reflectance is at most the opacity. */
typedef struct rb_surface {
    size_t size;
    rb_color reflectance;
    rb_color emission;
    rb_color translucence;
    rb_angle_factors reflectance_by_angle;
    rb_shown shown;
    rb_gloss gloss;
    rb_lobe microfibers;
    rb_lobe velvet;
    rb_lobe burley_sheen;
    rb_lobe several_facets;
    rb_diffuse diffuse;
} rb_surface;

/* Sets a surface to the defaults: matt grey that emits nothing. size is sizeof(rb_surface) of the
 * caller; no byte of *surface beyond it is written. */
RB_API rb_error rb_init_surface(rb_surface* surface, size_t size);

/* Adds a material with a surface on each side. back may be NULL: then both sides are as front.
 *   opacity        the share of the light that does not pass straight through, 0 to 1
 *   opacity_image  an image whose mean channel, averaged over each patch, multiplies the opacity, or
 *                  RB_NO_IMAGE
 * Meshes that use a material with images need UVs (rb_set_mesh_uvs). Id in *material. */
RB_API rb_error rb_add_material(rb_scene scene, const char* name, const rb_surface* front,
                                const rb_surface* back, float opacity, int32_t opacity_image,
                                int32_t* material);

/* Adds a mesh of planar or nearly planar n-gons, which may be concave.
 *   vertices         3 * vertex_count floats, object space, metres
 *   corner_vertices  corner_count vertex indices, face after face
 *   face_offsets     face_count + 1 ascending positions in corner_vertices, of 3 corners or more
 *   face_materials   face_count material ids, or NULL for a grey (0.8) default material
 *
 * Faces without area, or with none but by rounding, are left out with a warning in the report; their
 * corners get the light of the other corners at their vertices. Id in *mesh. */
RB_API rb_error rb_add_mesh(rb_scene scene, const char* name, const float* vertices,
                            size_t vertex_count, const int32_t* corner_vertices,
                            size_t corner_count, const int32_t* face_offsets, size_t face_count,
                            const int32_t* face_materials, int32_t* mesh);

/* Optional: 3 * corner_count floats, the unit shading normal at each corner. Corners of one vertex
 * whose normals agree across an edge belong to one smooth region and get one value. Without it two
 * faces are smooth where they are coplanar. */
RB_API rb_error rb_set_mesh_corner_normals(rb_scene scene, int32_t mesh, const float* normals,
                                           size_t corner_count);

/* Optional: 2 * edge_count vertex indices, the edges across which nothing is averaged although the
 * normals agree (marked sharp by the user). */
RB_API rb_error rb_set_mesh_sharp_edges(rb_scene scene, int32_t mesh, const int32_t* vertices,
                                        size_t edge_count);

/* Optional: 2 * corner_count floats, image coordinates at each corner. */
RB_API rb_error rb_set_mesh_uvs(rb_scene scene, int32_t mesh, const float* uvs,
                                size_t corner_count);

/* Optional: 3 * corner_count floats, linear RGB at each corner. */
RB_API rb_error rb_set_mesh_corner_colors(rb_scene scene, int32_t mesh, const float* rgb,
                                          size_t corner_count);

typedef enum rb_role RB_INT {
    RB_ROLE_BAKE = 0,   /* takes part in the light and gets a result */
    RB_ROLE_OCCLUDE = 1 /* takes part in the light, has no result */
} rb_role;

typedef enum rb_side RB_INT { RB_SIDE_FRONT = 0, RB_SIDE_BACK = 1 } rb_side;

/* Places a mesh in the world. transform holds 12 floats, the rows of a 3 x 4 matrix, object to
 * world; a matrix that mirrors keeps the front sides outside, as in Blender. side is the side whose
 * light is the result. Id in *instance. */
RB_API rb_error rb_add_instance(rb_scene scene, int32_t mesh, const char* name,
                                const float transform[12], rb_role role, rb_side side,
                                int32_t* instance);

/* What an instance is to light. Both are true without it.
 *   stops_direct   it blocks the light that the first shot gathers: lights and bright emission
 *   exchanges      it emits and reflects light to other surfaces, and blocks the world and what they
 *                  reflect; if not, it still receives (and with role RB_ROLE_BAKE has a result)
 * Emission too dim for the first shot travels with the reflected light; a warning names the
 * instances for which that makes a difference. */
RB_API rb_error rb_set_instance_visibility(rb_scene scene, int32_t instance, bool stops_direct,
                                           bool exchanges);

/* Optional, for an instance with role RB_ROLE_BAKE: which corners of its mesh have a result, as where
 * a mesh is finer than the one that the light is written to. The light of faces away from them is
 * computed no better than what it lights needs it, and counts in no stated error; corners without a
 * result get what is known there. Where a quarter of the corners at most have one, and half of those
 * on the faces that have any, these gather the light at their points (reconstruction LEAST_SQUARES
 * and POINT, final_gather 1, LINE_REUSE and GATHER). Without it all have one. */
RB_API rb_error rb_set_result_corners(rb_scene scene, int32_t instance, const int32_t* corners,
                                      size_t corner_count);

typedef enum rb_point_shape RB_INT {
    RB_POINT_DISK =
        0, /* a disk of the given radius that faces the receiver (Blender's soft falloff) */
    RB_POINT_SPHERE = 1 /* a sphere of the given radius */
} rb_point_shape;

/* Adds a point light. intensity is RGB in W/sr; radius may be 0. Id in *light. */
RB_API rb_error rb_add_point_light(rb_scene scene, const char* name, const float position[3],
                                   const float intensity[3], float radius, rb_point_shape shape,
                                   int32_t* light);

/* Makes a spot light of a point light: world_to_light holds 9 floats, rows of the 3 x 3 matrix into
 * the space in which the cone looks along -Z (a scaled light has an elliptic cone); angle is the
 * full opening in radians, blend in [0, 1] the soft share of it. dims_by_cosine: the intensity also
 * falls with the cosine to the axis, as in Blender up to 3.4. */
RB_API rb_error rb_set_light_cone(rb_scene scene, int32_t light, const float world_to_light[9],
                                  float angle, float blend, bool dims_by_cosine);

/* Adds a sun: direction points towards it, irradiance is RGB in W/m^2 at normal incidence, angle
 * the full angular diameter in radians. Id in *light. */
RB_API rb_error rb_add_sun_light(rb_scene scene, const char* name, const float direction[3],
                                 const float irradiance[3], float angle, int32_t* light);

typedef enum rb_area_shape RB_INT { RB_AREA_RECTANGLE = 0, RB_AREA_ELLIPSE = 1 } rb_area_shape;

/* Adds a one-sided area light that blocks no light itself: the parallelogram (or the ellipse in it)
 * centre +- axis_u +- axis_v, shining towards cross(axis_u, axis_v), with constant radiance (RGB).
 * Id in *light. */
RB_API rb_error rb_add_area_light(rb_scene scene, const char* name, const float centre[3],
                                  const float axis_u[3], const float axis_v[3],
                                  const float radiance[3], rb_area_shape shape, int32_t* light);

/* Narrows the light of an area light, as a grid before a softbox does: spread is the full opening
 * in radians, 0 to pi. The power is kept: the light is brighter along its axis. Without it: pi. */
RB_API rb_error rb_set_light_spread(rb_scene scene, int32_t light, float spread);

/* Whether surfaces stop the light of a light (they do unless this says no). Where they do not,
 * every surface that faces the light gets it; the energy balance then takes what arrives for
 * emitted. */
RB_API rb_error rb_set_light_shadows(rb_scene scene, int32_t light, bool casts_shadows);

/* Sets the constant radiance (RGB) of the world around the scene; black by default. */
RB_API rb_error rb_set_world(rb_scene scene, const float radiance[3]);

/* Sets what the world adds to its constant radiance, by direction: an equirectangular image of
 * width * height pixels, linear RGB in W/(m^2 sr), bottom row first. Cycles' mapping: the middle
 * column is +X, the one at 3/4 of the width -Y, the top row +Z. Its light comes with the lights',
 * by shadow rays from the receivers. */
RB_API rb_error rb_set_world_image(rb_scene scene, int32_t width, int32_t height, const float* rgb);

/* Adds a light set: a named group of lights whose light a bake also gives by itself. Names differ.
 * All sets are baked along the same lines, each solved by itself; only the solver LINE_REUSE can.
 * Id in *set. */
RB_API rb_error rb_add_light_set(rb_scene scene, const char* name, int32_t* set);

/* Put a light, the emission of an instance, or the world into a light set, or with RB_NO_LIGHT_SET,
 * as at first, into none: then it only counts in the light of all. Each is in one set at most. */
#define RB_NO_LIGHT_SET (-1)
RB_API rb_error rb_set_light_set(rb_scene scene, int32_t light, int32_t set);
RB_API rb_error rb_set_instance_light_set(rb_scene scene, int32_t instance, int32_t set);
RB_API rb_error rb_set_world_light_set(rb_scene scene, int32_t set);

/* ------------------------------------------------------------------------------------------------
 * Bake
 * --------------------------------------------------------------------------------------------- */

typedef struct rb_bake_impl* rb_bake;

/* Makes a bake with default settings in *bake; the caller releases it. */
RB_API rb_error rb_new_bake(rb_bake* bake);

/* Frees the bake, or lets the call that is at work with it do so. NULL is allowed. */
RB_API void rb_release_bake(rb_bake bake);

typedef enum rb_setting_type RB_INT {
    RB_SETTING_INT = 0,   /* rb_set_bake_int; with a range of 0 to 1 it is a switch */
    RB_SETTING_FLOAT = 1, /* rb_set_bake_float */
    RB_SETTING_CHOICE = 2 /* rb_set_bake_string, one of a list of names */
} rb_setting_type;

/* What there is to know of a setting. All text is UTF-8 in static memory. */
typedef struct rb_setting_info {
    size_t size; /* of this struct in the caller's header, in bytes, set before the call. The struct
                  * grows at its end: no more than size bytes are written, and a size of 0 or larger
                  * than that of the library's own is refused. */
    const char* name; /* as rb_set_bake_* takes it */
    const char* help; /* what it does, a line without a full stop at its end */
    const char* unit; /* "m", "MB", or "" for a number without one */
    rb_setting_type type;
    double least, most;         /* of a number: its range, both ends allowed; else 0 */
    double default_number;      /* of a number; else 0 */
    const char* default_choice; /* of a choice, one of choices; else NULL */
    size_t choice_count;        /* of a choice; else 0 */
    const char* const* choices; /* of a choice: choice_count names, whose order stays; else NULL */
    const char* const* choice_help; /* what each of them does, a line; else NULL */
} rb_setting_info;

/* Number of settings that a bake has. */
RB_API size_t rb_get_setting_count(void);

/* Describes setting number index, 0 to rb_get_setting_count() - 1, in *info, whose size the caller
 * has set. docs/c_api.md has all of them in a table. */
RB_API rb_error rb_get_setting_info(size_t index, rb_setting_info* info);

/* Give a setting a value, by the name of the setting. An unknown name, a function of another type,
 * and a value out of range are RB_ERROR_INVALID_ARGUMENT. docs/method.md says which methods work
 * together; rb_execute_bake refuses others with the reason. */
RB_API rb_error rb_set_bake_int(rb_bake bake, const char* name, int32_t value);
RB_API rb_error rb_set_bake_float(rb_bake bake, const char* name, float value);
RB_API rb_error rb_set_bake_string(rb_bake bake, const char* name, const char* value);

/* The present value of a setting, which before any rb_set_bake_* is the default. *value of a choice
 * is static memory. */
RB_API rb_error rb_get_bake_int(rb_bake bake, const char* name, int32_t* value);
RB_API rb_error rb_get_bake_float(rb_bake bake, const char* name, float* value);
RB_API rb_error rb_get_bake_string(rb_bake bake, const char* name, const char** value);

typedef enum rb_stage RB_INT {
    RB_STAGE_PATCHES = 0,
    RB_STAGE_FIRST_SHOT = 1,
    RB_STAGE_BUNDLES = 2,
    RB_STAGE_SOLVE = 3,
    RB_STAGE_RECONSTRUCTION = 4
} rb_stage;

/* Called from the thread that runs rb_execute_bake, with the share of the stage that is done (0 to
 * 1), whenever that changes and every 20 ms. Return false to cancel: the bake then ends within some
 * 10 ms, and for 300,000 faces some 100 ms, wherever it is. */
typedef bool (*rb_progress_function)(void* user, rb_stage stage, double fraction);

/* Sets (or with NULL removes) the progress function of a bake. */
RB_API rb_error rb_set_bake_progress(rb_bake bake, rb_progress_function function, void* user);

/* Bakes the scene. May be called again, also with another scene and after a cancel: when geometry
 * and the settings of the lines are unchanged, patches and traced lines are used again and only the
 * light is solved anew (relighting). On failure the results of the last successful run are kept. */
RB_API rb_error rb_execute_bake(rb_bake bake, rb_scene scene);

typedef enum rb_output RB_INT {
    RB_OUTPUT_COMBINED = 0, /* radiance that leaves: (emission + reflectance * irradiance) / pi */
    RB_OUTPUT_LIGHTING = 1, /* irradiance / pi: light on a white surface */
    RB_OUTPUT_DIRECT =
        2, /* the part of LIGHTING that comes straight from lights, emission and world */
    RB_OUTPUT_INDIRECT = 3 /* the rest of LIGHTING */
} rb_output;

/* Writes the result of an instance with role RB_ROLE_BAKE to rgb, 3 * count floats in the order of
 * the mesh's corners; count must be the number of corners. */
RB_API rb_error rb_get_corner_light(rb_bake bake, int32_t instance, rb_output output, float* rgb,
                                    size_t count);

/* The same per vertex: the mean of the vertex's corners, weighted by their angle. */
RB_API rb_error rb_get_vertex_light(rb_bake bake, int32_t instance, rb_output output, float* rgb,
                                    size_t count);

/* The same two by the lights of one light set alone. What rb_get_corner_light gives is the sum of
 * all sets and of what belongs to none. */
RB_API rb_error rb_get_set_corner_light(rb_bake bake, int32_t set, int32_t instance,
                                        rb_output output, float* rgb, size_t count);
RB_API rb_error rb_get_set_vertex_light(rb_bake bake, int32_t set, int32_t instance,
                                        rb_output output, float* rgb, size_t count);

/* Writes the stated error around each corner of an instance with role RB_ROLE_BAKE to error: count
 * floats, radiance of LIGHTING (RMS over RGB), from noise, discretisation and mesh together. */
RB_API rb_error rb_get_corner_error(rb_bake bake, int32_t instance, float* error, size_t count);

/* The report of the last successful rb_execute_bake as JSON (UTF-8) in *json; valid until the bake
 * runs again or is released. Keys: docs/c_api.md. */
RB_API rb_error rb_get_report(rb_bake bake, const char** json);

/* ------------------------------------------------------------------------------------------------
 * Conforming subdivision of a mesh, for callers whose mesh is too coarse for its light
 * --------------------------------------------------------------------------------------------- */

typedef struct rb_subdivision_impl* rb_subdivision;

/* Triangulates a mesh (arrays as in rb_add_mesh) and bisects longest edges until none is longer
 * than max_edge metres, without T-junctions. Result in *subdivision; the caller releases it. */
RB_API rb_error rb_new_subdivision(const float* vertices, size_t vertex_count,
                                   const int32_t* corner_vertices, size_t corner_count,
                                   const int32_t* face_offsets, size_t face_count, float max_edge,
                                   rb_subdivision* subdivision);

/* Frees the subdivision, or lets the call that is at work with it do so. NULL is allowed. */
RB_API void rb_release_subdivision(rb_subdivision subdivision);

/* Number of vertices and of triangles. */
RB_API rb_error rb_get_subdivision_size(rb_subdivision subdivision, size_t* vertex_count,
                                        size_t* triangle_count);

/* Copies the result: vertices (3 * vertex_count), triangles (3 * triangle_count vertex indices),
 * source_faces (triangle_count), and for each of the 3 * triangle_count new corners the three
 * corners of the source mesh it lies between (source_corners, 9 * triangle_count) and their
 * weights, which sum to 1 (source_weights, likewise). The counts must be those of
 * rb_get_subdivision_size. */
RB_API rb_error rb_get_subdivision(rb_subdivision subdivision, float* vertices, size_t vertex_count,
                                   int32_t* triangles, int32_t* source_faces,
                                   int32_t* source_corners, float* source_weights,
                                   size_t triangle_count);

#ifdef __cplusplus
}
#endif

#endif
