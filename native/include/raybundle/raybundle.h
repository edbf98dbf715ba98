/* SPDX-License-Identifier: GPL-3.0-or-later
 * Raybundle computes the diffuse global illumination of a scene by bundles of parallel global lines
 * and bakes it to the corners and vertices of the scene's meshes.
 *
 * This header is the whole C99 interface. It is ordered as a caller needs it:
 *   1. a scene: images, materials, meshes, instances, lights, world;
 *   2. a bake: settings, progress, execution, and runs in the background;
 *   3. results: light per corner or per vertex, stated error, report.
 *
 * Conventions
 * - Units are metres, W/m^2 (emission, irradiance), W/(m^2 sr) (radiance) and W/sr (intensity).
 *   Every colour is linear RGB in three floats.
 * - A light value above 1e15 in its unit (for an area light: radiance times area) is rejected with
 *   RB_ERROR_INVALID_ARGUMENT, and so is geometry or a light that reaches further than 1e12 m from
 *   the origin. Meshes are checked for this distance in rb_execute_bake, where their transforms are
 *   applied.
 * - Every function that can fail returns an rb_error. rb_get_error_message() then explains the last
 *   failure in the calling thread and names the object concerned. Output parameters are not changed
 *   on failure.
 * - An array is passed as a pointer and a count. The library reads or writes it only during the
 *   call. The array belongs to the caller; the library keeps no pointer to it.
 * - Ids (of images, materials, meshes, instances, lights, light sets) count from 0 per scene and
 *   kind.
 * - Names are UTF-8 and appear in messages and in the report. A NULL name is an empty name.
 * - Different handles may be used from different threads at the same time. A call fails with
 *   RB_ERROR_INVALID_OPERATION if another call on the same handle is still running, in another
 *   thread or as the caller of the progress function.
 * - Handles are numbers, not addresses, and no number is used twice. A released handle, or a handle
 *   of another kind, fails with RB_ERROR_INVALID_ARGUMENT. Releasing it again does nothing. */
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

/* C++ assumes that an enum holds no value outside its range unless its underlying type is fixed. A
 * caller may pass any value, so the underlying type is fixed here for C++. */
#ifdef __cplusplus
#define RB_INT : int32_t
extern "C" {
#else
#define RB_INT
#endif

/* ------------------------------------------------------------------------------------------------
 * Version and errors
 * --------------------------------------------------------------------------------------------- */

/* Version of the binary interface. It is raised by one whenever a signature or a meaning in this
 * header changes. A caller that was compiled for another version must not use the library. */
#define RB_ABI_VERSION 3

/* Returns the RB_ABI_VERSION of the loaded library. */
RB_API int32_t rb_get_abi_version(void);

/* Returns the release of the loaded library as "major.minor.patch". The string is static memory. */
RB_API const char* rb_get_version(void);

typedef enum rb_error RB_INT {
    RB_ERROR_NONE = 0,
    RB_ERROR_UNKNOWN = 1,
    RB_ERROR_INVALID_ARGUMENT = 2, /* the message names the argument or the object */
    /* The call came at the wrong time, such as a request for results before a bake. */
    RB_ERROR_INVALID_OPERATION = 3,
    RB_ERROR_OUT_OF_MEMORY = 4, /* there is none left, or a bake reached its memory_limit */
    RB_ERROR_UNSUPPORTED_HARDWARE = 5,
    RB_ERROR_CANCELLED = 6 /* the progress function returned false, or rb_cancel_run was called */
} rb_error;

/* Returns the message of the last failing call of the calling thread: UTF-8, cut after 2047 bytes,
 * "" if no call has failed yet. The string is valid until the next failing call of this thread. */
RB_API const char* rb_get_error_message(void);

/* ------------------------------------------------------------------------------------------------
 * Scene: a copy of everything the caller describes
 * --------------------------------------------------------------------------------------------- */

typedef struct rb_scene_impl* rb_scene;

/* Creates an empty scene and writes its handle to *scene. The caller releases it. */
RB_API rb_error rb_new_scene(rb_scene* scene);

/* Frees a scene. If another call is using the scene, the scene is freed when that call ends. A NULL
 * handle is ignored. A bake keeps what it needs, so its scene may be released before the bake. */
RB_API void rb_release_scene(rb_scene scene);

/* How an image continues outside the UV square from 0 to 1. */
typedef enum rb_image_extension RB_INT {
    RB_IMAGE_REPEAT = 0,
    RB_IMAGE_EXTEND = 1, /* repeats the border pixels */
    RB_IMAGE_CLIP = 2    /* is black outside */
} rb_image_extension;

/* Adds an image of width * height linear RGB pixels, bottom row first as in Blender, and writes its
 * id to *image. Pixels that are negative or not finite count as black, with a warning in the
 * report. */
RB_API rb_error rb_add_image(rb_scene scene, const char* name, int32_t width, int32_t height,
                             const float* rgb, rb_image_extension extension, int32_t* image);

/* Stands for "no image" in a material. */
#define RB_NO_IMAGE (-1)

/* An RGB colour that may vary over a mesh. Its value is
 *   constant + image_weight * image + corner_color_weight * corner colours
 * averaged over each patch. A negative sum counts as 0. Weights must be finite and may be negative.
 *   image                id from rb_add_image, or RB_NO_IMAGE. The image is sampled at the UVs of
 *                        the mesh (rb_set_mesh_uvs). It counts as black on a mesh without UVs.
 *   image_weight         factor of the image; ignored if there is no image
 *   corner_color_weight  factor of the colours of rb_set_mesh_corner_colors. They count as black on
 *                        a mesh that has none. */
typedef struct rb_color {
    float constant[3];
    int32_t image;
    float image_weight[3];
    float corner_color_weight[3];
} rb_color;

/* Describes how a share of light depends on c, the cosine of the angle between the normal and the
 * direction of the light: the sum of four terms, each multiplied by a factor (RGB, finite). "Mean"
 * below is the mean of a term under uniform light from all directions of the hemisphere, weighted
 * by the cosine. */
typedef struct rb_angle_factors {
    float linear[3];       /* factor of 1 - c; mean 1/3 */
    float square[3];       /* factor of (1 - c)^2; mean 1/6 */
    float fifth[3];        /* factor of (1 - c)^5; mean 1/21 */
    float cosine_fifth[3]; /* factor of c (1 - c)^5; mean 1/84 */
} rb_angle_factors;

/* A part of the reflectance of a side: scale * reflectance + offset (RGB, finite). It varies over
 * the mesh where the reflectance does. */
typedef struct rb_part {
    float scale[3];
    float offset[3];
} rb_part;

/* What the outputs of a bake show of a side.
 *   color       the diffuse colour, used by outputs that include colour; clamped to 0 to 1
 *   from_above  the share that is shown of light that arrives along the normal (RGB, finite)
 *   by_angle    added to from_above for light from other directions; the sum is clamped to 0 to 16
 */
typedef struct rb_shown {
    rb_part color;
    float from_above[3];
    rb_angle_factors by_angle;
} rb_shown;

/* How the shadowing and the masking of microfacets depend on each other. CORRELATED: both depend on
 * the height of the facet, as in Cycles since Blender 4.0. SEPARATE: they are independent. */
typedef enum rb_masking RB_INT { RB_MASKING_CORRELATED = 0, RB_MASKING_SEPARATE = 1 } rb_masking;

/* The part of the reflectance that is mirrored by microfacets with the GGX distribution. With first
 * shot GATHER and solver LINE_REUSE its light leaves in the directions of GGX, with other methods
 * as diffuse light.
 *   part       the mirrored reflectance for light from all directions; clamped to 0 to the
 *              reflectance
 *   by_angle   the mirrored part of rb_surface.reflectance_by_angle
 *   roughness  0 to 1; its square is the alpha of GGX. A roughness below 0.45 counts as 0.45 for
 *              the directions in which light leaves.
 *   masking    see rb_masking */
typedef struct rb_gloss {
    rb_part part;
    rb_angle_factors by_angle;
    float roughness;
    rb_masking masking;
} rb_gloss;

/* A part of the reflectance that is scattered by a lobe of its own. With first shot GATHER and
 * solver LINE_REUSE its light leaves in the directions of the lobe, with other methods as diffuse
 * light.
 *   reflectance  for light from all directions (RGB, finite); a negative value counts as 0
 *   by_angle     the lobe's part of rb_surface.reflectance_by_angle
 *   roughness    0 to 1 */
typedef struct rb_lobe {
    float reflectance[3];
    rb_angle_factors by_angle;
    float roughness;
} rb_lobe;

/* The model of diffuse reflection, as Blender's shaders have it. */
typedef enum rb_diffuse_model RB_INT {
    RB_DIFFUSE_LAMBERT = 0,
    RB_DIFFUSE_BURLEY = 1,
    RB_DIFFUSE_OREN_NAYAR = 2
} rb_diffuse_model;

/* How the rest of the reflected light is scattered: the part that belongs to neither gloss nor a
 * lobe.
 *   model      directions in which the light leaves with first shot GATHER and solver LINE_REUSE;
 *              other methods use Lambert's law
 *   roughness  0 to 1; ignored by Lambert's law
 *   leaving    how the light that leaves depends on the angle, such as below a layer that lets less
 *              light out at some angles. The factor at an angle is 1 plus the sum of these factors
 *              times the difference of their terms from the means of the terms. Solver LINE_REUSE
 *              only. */
typedef struct rb_diffuse {
    rb_diffuse_model model;
    float roughness;
    rb_angle_factors leaving;
} rb_diffuse;

/* What one side of a material does with light. rb_init_surface sets every member to its default.
 * Where no default is named below, it is 0, RB_NO_IMAGE, or the first value of the enum.
 *   size          size of this struct in the caller's header, in bytes. Later versions have more
 *                 members at the end. A library newer than the caller uses their defaults; a
 *                 library older than the caller rejects the surface.
 *   reflectance   albedo. Its constant must not be negative. A value above 0.999 is clamped to
 *                 0.999, with a warning in the report. Default: 0.8.
 *   emission      exitance in W/m^2, which is pi times the radiance. Its constant is 0 to 1e15.
 *   translucence  the share of the light arriving at the other side that passes through diffusely
 *                 and leaves this side, as if this side reflected it. Outputs that include colour
 *                 show it. Translucence and reflectance together are clamped to at most 0.999.
 *                 Solver LINE_REUSE only.
 *   reflectance_by_angle  how the reflectance depends on the angle of light from the sources, with
 *                         first shot GATHER. The member `reflectance` is for light from all
 *                         directions. Light from one direction is reflected with that value plus
 *                         the sum of these factors times the difference of their terms from the
 *                         means of the terms.
 *   shown         what outputs show. Default: the whole reflectance is diffuse colour, and light
 *                 from every angle is shown in full.
 *   gloss         the part that microfacets mirror
 *   microfibers   sheen as in Cycles since Blender 4.0
 *   velvet        velvet as in Cycles; its roughness is sigma
 *   burley_sheen  sheen as in Cycles before Blender 4.0; its roughness is ignored
 *   several_facets  the part of gloss that is reflected by several microfacets in turn; its
 *                   roughness is that of gloss
 *   diffuse       how the rest is scattered
 * If part of the light passes straight through the material (opacity of rb_add_material), all of
 * these values describe the whole surface. The reflectance is then at most the opacity. */
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

/* Sets *surface to the defaults: matt grey without emission. `size` is the caller's
 * sizeof(rb_surface). No byte of *surface beyond `size` is written. */
RB_API rb_error rb_init_surface(rb_surface* surface, size_t size);

/* Adds a material with a surface on each side and writes its id to *material.
 *   back           the surface of the back, or NULL to use `front` for both sides
 *   opacity        the share of the light that does not pass straight through, 0 to 1
 *   opacity_image  id of an image that multiplies the opacity by the mean of its three channels,
 *                  averaged over each patch; or RB_NO_IMAGE
 * A mesh whose material has images needs UVs (rb_set_mesh_uvs). */
RB_API rb_error rb_add_material(rb_scene scene, const char* name, const rb_surface* front,
                                const rb_surface* back, float opacity, int32_t opacity_image,
                                int32_t* material);

/* Adds a mesh of planar or nearly planar polygons and writes its id to *mesh. Faces may be concave.
 *   vertices         3 * vertex_count floats, object space, metres
 *   corner_vertices  the vertex index of each corner, face after face; corner_count values
 *   face_offsets     face_count + 1 ascending positions in corner_vertices. Face f has the corners
 *                    face_offsets[f] to face_offsets[f + 1] - 1, at least 3.
 *   face_materials   the material id of each face, face_count values; or NULL for the default
 *                    material, grey of reflectance 0.8
 *
 * Faces whose area is zero, or no larger than rounding errors, are left out with a warning in the
 * report. Their corners get the light of the other corners at their vertices. */
RB_API rb_error rb_add_mesh(rb_scene scene, const char* name, const float* vertices,
                            size_t vertex_count, const int32_t* corner_vertices,
                            size_t corner_count, const int32_t* face_offsets, size_t face_count,
                            const int32_t* face_materials, int32_t* mesh);

/* Optional. Sets the unit shading normal at each corner: 3 * corner_count floats, object space.
 * Corners of one vertex whose normals agree across an edge belong to one smooth region and get one
 * value. Without shading normals two faces belong to one smooth region if they are coplanar. */
RB_API rb_error rb_set_mesh_corner_normals(rb_scene scene, int32_t mesh, const float* normals,
                                           size_t corner_count);

/* Optional. Sets the edges marked sharp by the user: 2 * edge_count vertex indices. Nothing is
 * averaged across a sharp edge, even if the normals on both sides agree. */
RB_API rb_error rb_set_mesh_sharp_edges(rb_scene scene, int32_t mesh, const int32_t* vertices,
                                        size_t edge_count);

/* Optional. Sets the image coordinates at each corner: 2 * corner_count floats. */
RB_API rb_error rb_set_mesh_uvs(rb_scene scene, int32_t mesh, const float* uvs,
                                size_t corner_count);

/* Optional. Sets a colour at each corner: 3 * corner_count floats, linear RGB. */
RB_API rb_error rb_set_mesh_corner_colors(rb_scene scene, int32_t mesh, const float* rgb,
                                          size_t corner_count);

/* What an instance does in a bake. Both roles take part in the light. */
typedef enum rb_role RB_INT {
    RB_ROLE_BAKE = 0,   /* gets a result */
    RB_ROLE_OCCLUDE = 1 /* gets no result */
} rb_role;

/* A side of a face. The front is the side from which the corners run counter-clockwise. */
typedef enum rb_side RB_INT { RB_SIDE_FRONT = 0, RB_SIDE_BACK = 1 } rb_side;

/* Places a mesh in the world and writes the id of the instance to *instance. `transform` holds the
 * 12 floats of a 3 x 4 matrix from object space to world space, row by row. If the matrix mirrors,
 * the front sides stay outside, as in Blender. `side` selects the side of the faces whose light is
 * the result. */
RB_API rb_error rb_add_instance(rb_scene scene, int32_t mesh, const char* name,
                                const float transform[12], rb_role role, rb_side side,
                                int32_t* instance);

/* Sets how an instance takes part in the light. Both switches are true by default.
 *   stops_direct   the instance blocks the light that the first shot gathers: lamps, bright
 *                  emission and the world image
 *   exchanges      the instance emits and reflects light to other surfaces, and blocks the constant
 *                  light of the world and the light that other surfaces reflect. If false, the
 *                  instance still receives light and, with role RB_ROLE_BAKE, has a result.
 * Emission too dim for the first shot is distributed together with the reflected light, so
 * `exchanges` decides about it. A warning in the report names the instances for which that makes a
 * difference. */
RB_API rb_error rb_set_instance_visibility(rb_scene scene, int32_t instance, bool stops_direct,
                                           bool exchanges);

/* Sets how exactly the light of an instance is computed compared with the rest of the scene. Both
 * factors are 1 by default, and must be from 0.01 to 100.
 *   noise        factor on target_error for this instance. Solvers other than LINE_REUSE follow it
 *                for the light that the first shot gathers only.
 *   patch_size   factor on the edge length of the patches of this instance */
RB_API rb_error rb_set_instance_quality(rb_scene scene, int32_t instance, float noise,
                                        float patch_size);

/* Optional, for an instance with role RB_ROLE_BAKE. Selects the corners of its mesh that need a
 * result: corner_count corner indices. It serves meshes that are finer than the mesh to which the
 * light is written. By default all corners need one.
 * - Faces away from the selected corners are computed only as well as the light they reflect
 *   requires. They do not count in the stated error. Corners without a result get the light
 *   computed there.
 * - If at most a quarter of all corners are selected, and at most half of the corners of the faces
 *   that have a selected corner, the selected corners gather the light at their own positions
 *   (reconstruction LEAST_SQUARES or POINT, final_gather 1, solver LINE_REUSE, first shot GATHER).
 */
RB_API rb_error rb_set_result_corners(rb_scene scene, int32_t instance, const int32_t* corners,
                                      size_t corner_count);

/* The shape of the surface of a point light. */
typedef enum rb_point_shape RB_INT {
    /* A disk of the given radius that faces the receiver (Blender's "soft falloff"). */
    RB_POINT_DISK = 0,
    RB_POINT_SPHERE = 1 /* a sphere of the given radius */
} rb_point_shape;

/* Adds a point light and writes its id to *light. `position` is in metres, `intensity` is RGB in
 * W/sr, `radius` is in metres and may be 0. */
RB_API rb_error rb_add_point_light(rb_scene scene, const char* name, const float position[3],
                                   const float intensity[3], float radius, rb_point_shape shape,
                                   int32_t* light);

/* Turns a point light into a spot light. Fails if the light is not a point light.
 *   world_to_light  9 floats, the rows of the 3 x 3 matrix from world space to the space in which
 *                   the cone points along -Z. The cone of a scaled light is elliptic.
 *   angle           full opening angle, radians
 *   blend           the share of the cone with a soft edge, 0 to 1
 *   dims_by_cosine  the intensity also falls with the cosine of the angle to the axis, as in
 *                   Blender up to 3.4 */
RB_API rb_error rb_set_light_cone(rb_scene scene, int32_t light, const float world_to_light[9],
                                  float angle, float blend, bool dims_by_cosine);

/* Adds a sun and writes its id to *light. `direction` points towards the sun and need not be a unit
 * vector. `irradiance` is RGB in W/m^2 at normal incidence. `angle` is the full angular diameter in
 * radians. */
RB_API rb_error rb_add_sun_light(rb_scene scene, const char* name, const float direction[3],
                                 const float irradiance[3], float angle, int32_t* light);

/* The shape of an area light. */
typedef enum rb_area_shape RB_INT { RB_AREA_RECTANGLE = 0, RB_AREA_ELLIPSE = 1 } rb_area_shape;

/* Adds an area light and writes its id to *light. The light is the parallelogram centre +- axis_u
 * +- axis_v, or the ellipse inscribed in it (metres). It shines from one side, towards
 * cross(axis_u, axis_v), with constant radiance (RGB, W/(m^2 sr)). It blocks no light. */
RB_API rb_error rb_add_area_light(rb_scene scene, const char* name, const float centre[3],
                                  const float axis_u[3], const float axis_v[3],
                                  const float radiance[3], rb_area_shape shape, int32_t* light);

/* Narrows the beam of an area light, like the grid of a softbox. `spread` is the full opening angle
 * in radians, 0 to pi; the default is pi. The power stays the same, so the light is brighter along
 * its axis. Fails if the light is not an area light. */
RB_API rb_error rb_set_light_spread(rb_scene scene, int32_t light, float spread);

/* Sets whether surfaces block the light of a lamp. They do by default. If `casts_shadows` is false,
 * every surface that faces the lamp receives its light, and the energy balance counts the arriving
 * light as emitted. */
RB_API rb_error rb_set_light_shadows(rb_scene scene, int32_t light, bool casts_shadows);

/* Removes all lights, whose ids are then given to lights that are added. All else of the scene
 * stays, so that a scene whose lights have moved need not be made anew. */
RB_API rb_error rb_remove_lights(rb_scene scene);

/* Sets the constant radiance of the world around the scene: RGB, W/(m^2 sr), black by default.
 * Negative values count as 0. */
RB_API rb_error rb_set_world(rb_scene scene, const float radiance[3]);

/* Sets the radiance that the world adds to its constant radiance, by direction: an equirectangular
 * image of width * height pixels, linear RGB in W/(m^2 sr), bottom row first. Pixels must be finite
 * and not negative. Its directions are those of Cycles: the middle column is +X, the column at 3/4
 * of the width is -Y, the top row is +Z. Like the light of lamps, its light is gathered by shadow
 * rays from the receivers. */
RB_API rb_error rb_set_world_image(rb_scene scene, int32_t width, int32_t height, const float* rgb);

/* Adds a light set and writes its id to *set. A light set is a named group of lights whose light a
 * bake also returns separately. Its name must be unique. All sets use the same traced lines and are
 * solved one by one. Solver LINE_REUSE only. */
RB_API rb_error rb_add_light_set(rb_scene scene, const char* name, int32_t* set);

/* These three functions put a light, the emission of an instance, or the world into a light set.
 * Each belongs to at most one set. RB_NO_LIGHT_SET, the default, stands for no set: the light then
 * counts only in the light of all sources. */
#define RB_NO_LIGHT_SET (-1)
RB_API rb_error rb_set_light_set(rb_scene scene, int32_t light, int32_t set);
RB_API rb_error rb_set_instance_light_set(rb_scene scene, int32_t instance, int32_t set);
RB_API rb_error rb_set_world_light_set(rb_scene scene, int32_t set);

/* ------------------------------------------------------------------------------------------------
 * Bake
 * --------------------------------------------------------------------------------------------- */

typedef struct rb_bake_impl* rb_bake;

/* Creates a bake with default settings and writes its handle to *bake. The caller releases it. */
RB_API rb_error rb_new_bake(rb_bake* bake);

/* Frees a bake. If another call is using the bake, the bake is freed when that call ends. A NULL
 * handle is ignored. */
RB_API void rb_release_bake(rb_bake bake);

/* The type of a setting, which decides the function that sets it. */
typedef enum rb_setting_type RB_INT {
    RB_SETTING_INT = 0,   /* set by rb_set_bake_int; a range of 0 to 1 is a switch */
    RB_SETTING_FLOAT = 1, /* set by rb_set_bake_float */
    RB_SETTING_CHOICE = 2 /* set by rb_set_bake_string to one of a list of names */
} rb_setting_type;

/* Describes a setting. All strings are UTF-8 in static memory. */
typedef struct rb_setting_info {
    /* Size of this struct in the caller's header, in bytes, set by the caller before the call. The
     * struct grows at its end: the library writes at most `size` bytes. A size of 0, or larger than
     * the library's own, is rejected. */
    size_t size;
    const char* name; /* name as rb_set_bake_int, _float and _string take it */
    const char* help; /* what the setting does: one line without a full stop */
    const char* unit; /* "m", "MB", or "" for a number without unit */
    rb_setting_type type;
    double least, most;         /* range of a number, both ends included; else 0 */
    double default_number;      /* default of a number; else 0 */
    const char* default_choice; /* default of a choice, one of `choices`; else NULL */
    size_t choice_count;        /* number of values of a choice; else 0 */
    /* The names of the values of a choice: choice_count strings in an order that never changes;
     * else NULL. */
    const char* const* choices;
    /* What each value of a choice does: choice_count lines; else NULL. */
    const char* const* choice_help;
    /* The choice setting that decides whether this setting has an effect; NULL if it always has. */
    const char* used_with;
    /* Bit k is set if this setting has an effect with value k of the choice `used_with`. */
    uint32_t used_with_choices;
} rb_setting_info;

/* Returns the number of settings of a bake. */
RB_API size_t rb_get_setting_count(void);

/* Describes the setting with index 0 to rb_get_setting_count() - 1 in *info. The caller must have
 * set info->size. docs/c_api.md lists all settings in a table. */
RB_API rb_error rb_get_setting_info(size_t index, rb_setting_info* info);

/* These three functions set a setting by its name. They fail with RB_ERROR_INVALID_ARGUMENT if the
 * name is unknown, if the setting has another type, or if the value is out of range.
 * rb_execute_bake rejects combinations of methods that do not work together and gives the reason;
 * docs/method.md lists them. */
RB_API rb_error rb_set_bake_int(rb_bake bake, const char* name, int32_t value);
RB_API rb_error rb_set_bake_float(rb_bake bake, const char* name, float value);
RB_API rb_error rb_set_bake_string(rb_bake bake, const char* name, const char* value);

/* These three functions write the present value of a setting to *value. It is the default until it
 * is set. The string of a choice is static memory. */
RB_API rb_error rb_get_bake_int(rb_bake bake, const char* name, int32_t* value);
RB_API rb_error rb_get_bake_float(rb_bake bake, const char* name, float* value);
RB_API rb_error rb_get_bake_string(rb_bake bake, const char* name, const char** value);

/* The stages of a bake, in the order in which they first run. */
typedef enum rb_stage RB_INT {
    RB_STAGE_PATCHES = 0,
    RB_STAGE_FIRST_SHOT = 1,
    RB_STAGE_BUNDLES = 2,
    RB_STAGE_SOLVE = 3,
    RB_STAGE_RECONSTRUCTION = 4
} rb_stage;

/* Reports the progress of a bake. The library calls it in the thread that runs rb_execute_bake,
 * with the finished share of a stage (0 to 1), whenever the share changes and every 20 ms. `user`
 * is the pointer given to rb_set_bake_progress. Return false to cancel: the bake then ends within
 * about 10 ms at any point, or about 100 ms in a scene of 300,000 faces. It still succeeds if
 * nothing was left to do. */
typedef bool (*rb_progress_function)(void* user, rb_stage stage, double fraction);

/* Sets the progress function of a bake, or removes it if `function` is NULL. `user` is passed on to
 * it. */
RB_API rb_error rb_set_bake_progress(rb_bake bake, rb_progress_function function, void* user);

/* Bakes a scene. A bake may be executed again, also with another scene and after it was cancelled.
 * If the geometry and the settings of the lines are unchanged, the patches and the traced lines are
 * used again and only the light is solved anew (relighting). On failure the results of the last
 * successful execution remain. */
RB_API rb_error rb_execute_bake(rb_bake bake, rb_scene scene);

/* The quantity that a bake returns, as radiance in W/(m^2 sr). */
typedef enum rb_output RB_INT {
    RB_OUTPUT_COMBINED = 0, /* leaving radiance: (emission + reflectance * irradiance) / pi */
    RB_OUTPUT_LIGHTING = 1, /* irradiance / pi: the radiance of a white surface */
    /* The part of LIGHTING that comes directly from lamps, emission and the world. */
    RB_OUTPUT_DIRECT = 2,
    RB_OUTPUT_INDIRECT = 3 /* the rest of LIGHTING */
} rb_output;

/* Writes the light at each corner of an instance with role RB_ROLE_BAKE to `rgb`: 3 * count floats
 * in the order of the mesh's corners, W/(m^2 sr). `count` must be the number of corners. Fails with
 * RB_ERROR_INVALID_OPERATION before the first successful bake. */
RB_API rb_error rb_get_corner_light(rb_bake bake, int32_t instance, rb_output output, float* rgb,
                                    size_t count);

/* Writes the light at each vertex of an instance with role RB_ROLE_BAKE to `rgb`: 3 * count floats,
 * W/(m^2 sr). `count` must be the number of vertices. The light of a vertex is the mean of its
 * corners, weighted by their angles. */
RB_API rb_error rb_get_vertex_light(rb_bake bake, int32_t instance, rb_output output, float* rgb,
                                    size_t count);

/* These two functions write the light of one light set alone, per corner and per vertex, as
 * rb_get_corner_light and rb_get_vertex_light do for all sources. The light of all sources is the
 * sum of the light of all sets and of the sources that belong to no set. */
RB_API rb_error rb_get_set_corner_light(rb_bake bake, int32_t set, int32_t instance,
                                        rb_output output, float* rgb, size_t count);
RB_API rb_error rb_get_set_vertex_light(rb_bake bake, int32_t set, int32_t instance,
                                        rb_output output, float* rgb, size_t count);

/* Writes the stated error around each corner of an instance with role RB_ROLE_BAKE to `error`:
 * `count` floats, one per corner, as radiance of LIGHTING in W/(m^2 sr) (RMS over RGB). It combines
 * noise, discretisation and mesh error. */
RB_API rb_error rb_get_corner_error(rb_bake bake, int32_t instance, float* error, size_t count);

/* These two functions return the adapted mesh of an instance with role RB_ROLE_BAKE, after a bake
 * with the setting adapt_meshes: the mesh at whose corners and vertices the functions above return
 * the light. It has the faces of the instance's mesh, its source, and triangles in place of those
 * faces that were divided. Fail with RB_ERROR_INVALID_OPERATION if the last successful execution
 * had adapt_meshes off.
 *
 * The first writes the numbers of vertices, corners and faces. The second copies the mesh into
 * arrays of the caller, whose counts must be these.
 *   vertices         3 * vertex_count floats, object space, metres; those of the source come first
 *   corner_vertices  the vertex index of each corner, face after face; corner_count values
 *   source_corners   the three corners of the source between which each corner lies,
 *                    3 * corner_count corner indices
 *   source_weights   the weights of the three corners, which sum to 1; 3 * corner_count floats
 *   source_edges     if the edge from a corner to the next of its face lies on an edge of the
 *                    source: the corner at which this edge begins in the source's face; otherwise
 *                    -1; corner_count values
 *   face_offsets     as in rb_add_mesh, face_count + 1 values
 *   source_faces     the face of the source that contains each face, face_count values */
RB_API rb_error rb_get_adapted_mesh_size(rb_bake bake, int32_t instance, size_t* vertex_count,
                                         size_t* corner_count, size_t* face_count);
RB_API rb_error rb_get_adapted_mesh(rb_bake bake, int32_t instance, float* vertices,
                                    size_t vertex_count, int32_t* corner_vertices,
                                    int32_t* source_corners, float* source_weights,
                                    int32_t* source_edges, size_t corner_count,
                                    int32_t* face_offsets, int32_t* source_faces,
                                    size_t face_count);

/* Writes a pointer to the report of the last successful rb_execute_bake to *json: JSON in UTF-8.
 * The string is valid until the bake runs again or is released. docs/c_api.md lists the keys. */
RB_API rb_error rb_get_report(rb_bake bake, const char** json);

/* ------------------------------------------------------------------------------------------------
 * Runs: bakes in the background, for callers that must not wait
 * --------------------------------------------------------------------------------------------- */

typedef struct rb_run_impl* rb_run;

/* Begins rb_execute_bake(bake, scene) in a thread of the library, and writes the handle of the run
 * to *run at once. The caller releases it. Until the run has ended, other calls on the bake and the
 * scene fail with RB_ERROR_INVALID_OPERATION; releasing them is allowed and takes effect when the
 * run ends. The bake's own progress function is not called. Results are fetched from the bake after
 * rb_finish_run. */
RB_API rb_error rb_start_bake(rb_bake bake, rb_scene scene, rb_run* run);

/* What a run is doing. */
typedef struct rb_run_state {
    size_t size; /* size of this struct in the caller's header, in bytes; set by the caller */
    bool is_running;
    rb_stage stage;  /* the present or the last stage */
    double fraction; /* finished share of the stage, 0 to 1; estimated where a target decides */
    /* The noise so far, relative to the light: what target_error bounds. -1 until bundles have been
     * looked at for the first time. */
    double noise;
    /* Number of times that interim light was made. It rises only after rb_get_run_light has read
     * the last one, so that light that nobody reads takes no time. A bake with the setting draft
     * makes none. */
    int32_t interim;
} rb_run_state;

/* Describes a run in *state. The caller must have set state->size. */
RB_API rb_error rb_get_run_state(rb_run run, rb_run_state* state);

/* Writes the interim light of a run at each corner of an instance with role RB_ROLE_BAKE to `rgb`,
 * as rb_get_corner_light does: light that is computed while the run goes on. At first it is the
 * direct light alone, from a few shadow rays; it gets better with each look at the bundles. Fails
 * with RB_ERROR_INVALID_OPERATION while state.interim is 0. */
RB_API rb_error rb_get_run_light(rb_run run, int32_t instance, rb_output output, float* rgb,
                                 size_t count);

/* Asks a run to end. It ends within about 10 ms, or about 100 ms in a scene of 300,000 faces. The
 * results of the bake's last successful execution remain. Does nothing if the run has ended. */
RB_API rb_error rb_cancel_run(rb_run run);

/* Waits until a run has ended, and returns what rb_execute_bake would have returned:
 * RB_ERROR_CANCELLED after rb_cancel_run. */
RB_API rb_error rb_finish_run(rb_run run);

/* Frees a run. A run that has not ended is cancelled, and the call waits for its end. A NULL handle
 * is ignored. */
RB_API void rb_release_run(rb_run run);

/* ------------------------------------------------------------------------------------------------
 * Conforming subdivision of a mesh, for callers whose mesh is too coarse for its light
 * --------------------------------------------------------------------------------------------- */

typedef struct rb_subdivision_impl* rb_subdivision;

/* Triangulates a mesh (arrays as in rb_add_mesh) and bisects the longest edges until none is longer
 * than max_edge, in the unit of the vertices. The result has no T-junctions. Slivers and copies of
 * faces are left out. Writes the handle of the result to *subdivision; the caller releases it.
 * Fails with RB_ERROR_INVALID_ARGUMENT if more than 2^26 triangles would be needed. */
RB_API rb_error rb_new_subdivision(const float* vertices, size_t vertex_count,
                                   const int32_t* corner_vertices, size_t corner_count,
                                   const int32_t* face_offsets, size_t face_count, float max_edge,
                                   rb_subdivision* subdivision);

/* Frees a subdivision. If another call is using the subdivision, it is freed when that call ends. A
 * NULL handle is ignored. */
RB_API void rb_release_subdivision(rb_subdivision subdivision);

/* Writes the number of vertices and of triangles of a subdivision. */
RB_API rb_error rb_get_subdivision_size(rb_subdivision subdivision, size_t* vertex_count,
                                        size_t* triangle_count);

/* Copies a subdivision into arrays of the caller. The counts must be those of
 * rb_get_subdivision_size.
 *   vertices        3 * vertex_count floats
 *   triangles       3 * triangle_count vertex indices
 *   source_faces    the face of the source mesh of each triangle, triangle_count values
 *   source_corners  the three corners of the source mesh between which each corner of a triangle
 *                   lies, 9 * triangle_count corner indices
 *   source_weights  the weights of the three corners, which sum to 1; 9 * triangle_count floats */
RB_API rb_error rb_get_subdivision(rb_subdivision subdivision, float* vertices, size_t vertex_count,
                                   int32_t* triangles, int32_t* source_faces,
                                   int32_t* source_corners, float* source_weights,
                                   size_t triangle_count);

/* ------------------------------------------------------------------------------------------------
 * Simplification of a mesh, for callers whose mesh has more vertices than its light and shape need
 * --------------------------------------------------------------------------------------------- */

typedef struct rb_simplification_impl* rb_simplification;

/* Removes vertices of a mesh (arrays as in rb_add_mesh) as long as, at each removed vertex, no value
 * changes by more than its tolerance, and the surface moves by at most `distance`, in the unit of
 * the vertices. Values that differ across an edge, such as light across a sharp one, stay apart. At
 * edges with more than two faces nothing is removed. Writes the handle of the result to
 * *simplification; the caller releases it.
 *   face_kinds  one number per face, such as its material: faces of different kinds stay apart;
 *               NULL: all are alike
 *   kept_edges  per corner, whether the edge to the next corner of its face stays an edge, with
 *               vertices removed at most along it; NULL: none
 *   values      value_count values per corner: light, texture coordinates, normals
 *   tolerances  the tolerance of each value, positive
 *   distance    positive */
RB_API rb_error rb_new_simplification(const float* vertices, size_t vertex_count,
                                      const int32_t* corner_vertices, size_t corner_count,
                                      const int32_t* face_offsets, size_t face_count,
                                      const int32_t* face_kinds, const int32_t* kept_edges,
                                      const float* values, const float* tolerances,
                                      size_t value_count, float distance,
                                      rb_simplification* simplification);

/* Frees a simplification. If another call is using it, it is freed when that call ends. A NULL
 * handle is ignored. */
RB_API void rb_release_simplification(rb_simplification simplification);

/* Writes the number of corners and of faces of a simplified mesh. */
RB_API rb_error rb_get_simplification_size(rb_simplification simplification, size_t* corner_count,
                                           size_t* face_count);

/* Copies a simplified mesh into arrays of the caller. The counts must be those of
 * rb_get_simplification_size and rb_new_simplification. Faces from which no vertex was removed are
 * those of the source; the others are triangles.
 *   source_corners  the corner of the source with the vertex and the values of each corner,
 *                   corner_count corner indices
 *   source_edges    if the edge from a corner to the next of its face lies on an edge of the source
 *                   that stays one: a corner at which such an edge begins in its face; otherwise -1;
 *                   corner_count values
 *   face_offsets    as in rb_add_mesh, face_count + 1 values
 *   source_faces    a face of the source with the kind of each face, face_count values
 *   changes         per value, RMS over the vertices of its change, value_count floats */
RB_API rb_error rb_get_simplification(rb_simplification simplification, int32_t* source_corners,
                                      int32_t* source_edges, size_t corner_count,
                                      int32_t* face_offsets, int32_t* source_faces,
                                      size_t face_count, float* changes, size_t value_count);

#ifdef __cplusplus
}
#endif

#endif
