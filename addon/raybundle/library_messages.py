# SPDX-License-Identifier: GPL-3.0-or-later
"""The texts of the native library that the report of a bake shows, and the errors that scenes and
settings of a user can cause: recognised by their templates, so that they can be translated.

The library makes its texts in English and passes no templates. A text that is not listed here, as
of another release of the library, is shown in English.
"""

from __future__ import annotations

import re
from functools import lru_cache
from string import Formatter

from .messages import Message

# Warnings. {object}, {objects} and the like are names in quotes, several after grouping.
WARNINGS = (
    "image {image}: pixels that are negative or not finite count as black ({count} of {all} "
    "pixels); correct them in the image",
    "material {material}: its reflectance was clamped to 0.999, because every surface must absorb "
    "some light; choose a darker base colour",
    "object {object}: {count} faces were left out, because their area is zero or no larger than "
    "rounding errors; remove them (Degenerate Dissolve)",
    "object {object}: {count} faces lie on others that face the same way, and get the light of "
    "those faces; merge them (Merge by Distance), or delete the object if it lies on another "
    "object",
    "faces intersect in so many places that the smaller faces were not cut there. Some light may "
    "leak through walls; delete or hide the unseen parts of objects that intersect",
    "the system allows only {count} of {wanted} threads, so that the bake takes longer; free "
    "memory, or raise the system's limit of threads",
    "the scene has no faces with an area, so that there is nothing to bake",
    "no light reaches any surface, so that the result is black; add a lamp, an emissive material "
    "or a world that is not black",
    "light set {set}: no light of the set reaches any surface, so that its result is black; check "
    "which lights belong to the set",
    "object {object}: the Ray Visibility settings Shadow and Diffuse differ. The object blocks the "
    "light of dim emission as it blocks reflected light, not as it blocks the light of lamps; "
    "switch both settings on or both off to avoid this",
    "object {object}: it does not exchange light with other surfaces. Solver {solver} therefore "
    "leaves out the light that other surfaces and a constant world send to it; choose solver "
    "LINE_REUSE",
    "material {material}: solver {solver} does not send the light that passes through this "
    "material on to other surfaces, which are too dark; choose solver LINE_REUSE",
    "{method} ignores the angle at which light arrives. Materials whose reflectance depends on "
    "this angle, such as Principled and rough materials, reflect as if light arrived equally from "
    "all directions, an error of up to some percent; choose {remedy}",
    "the scene needs {patches} patches, more than max_patches ({most}), so that the bake takes more "
    "time and memory. Small faces share patches if they are opaque and not translucent, and with "
    "the default methods and the topology KEEP; simplify the meshes, or increase max_patches",
    "{count} patches lie beside gaps that are much narrower than a patch, such as below cutlery on "
    "a table. The light in these gaps is too bright; choose solver LINE_REUSE and first_shot "
    "GATHER, with which such patches are cut",
    "fewer than {count} lines meet each patch of {objects}, so that the noise there may be higher "
    "than stated. Solver {solver} has equally dense lines everywhere; choose solver LINE_REUSE, "
    "whose lines are denser where patches are small",
    "the noise is {noise}, above the target of {target}. The largest part of the noise of direct "
    "light is in the light of {source} on object {object}. More bundles do not reduce it; use "
    "smaller patches there (patch_size), or move nearby lamps away from the object",
    *(stopped + noise + "; the target is {target}. " + remedy for stopped, remedy in (
        ("max_bundles was reached at {count} bundles: ",
         "Increase max_bundles to reach the target"),
        ("the bake stopped at {count} bundles because it cannot count the lines of more bundles: ",
         "Reduce lines_per_bundle, or increase target_error"))
      for noise in ("the noise is {noise}", "the noise of light set {set} is {noise}",
                    "the noise is {noise}, and at least {most} on the noisiest parts",
                    "the noise of light set {set} is {noise}, and at least {most} on the noisiest "
                    "parts")),
    "the half of memory_limit that lines may take was full at {count} bundles. The other {others} "
    "bundles were used once and discarded. The result is therefore less precise, and relighting "
    "has to trace these bundles again; increase memory_limit",
    "{count} times, patches covered each other in a cycle, which no drawing order can solve. Some "
    "lines therefore meet surfaces in the wrong order; choose projector AUTO, which needs no "
    "drawing order",
    "{share} of the lines met surfaces in a wrong order or passed through surfaces. The error of "
    "the light is about {error}, and more bundles do not reduce it; choose projector AUTO and "
    "small_patches CENTRE_SAMPLING",
    "the exchange of light did not converge, because some surfaces reflect or transmit nearly all "
    "light. The result may be wrong; reduce the reflectance and the translucence of surfaces that "
    "enclose light to at most 0.9",
    "the energy balance is off by {share}: this share of the emitted light is lost or added, and "
    "the result may be wrong by as much. Look for lamps that are inside other surfaces or touch "
    "them, and compare with a bake of smaller patches (patch_size)",
    "object {object}: the reconstruction LEAST_SQUARES did not converge, so that the vertices get "
    "the mean of the light around them; merge vertices (Merge by Distance), or choose the "
    "reconstruction AREA_AVERAGE",
    "object {object}: almost no light reaches the baked sides of the faces, but the other sides "
    "are lit; flip the normals, or bake the other side",
    "some objects are noisier than twice the target of {target}: object {objects}; lower "
    "target_error, or increase max_bundles if the bake reached it",
    "some objects are noisier than twice the target of {target}: object {objects} (the report "
    "lists the noise of each object); lower target_error, or increase max_bundles if the bake "
    "reached it",
    "some objects are noisier than twice the target of {target}: object {objects}. Only few lines "
    "bring light to these objects, so that a lower target_error takes long and gains little; add "
    "lamps, or accept the noise",
    "some objects are noisier than twice the target of {target}: object {objects} (the report "
    "lists the noise of each object). Only few lines bring light to these objects, so that a lower "
    "target_error takes long and gains little; add lamps, or accept the noise",
    "object {object}: its faces, {edge} wide on average, are too coarse for its light. "
    "Interpolation over the faces causes an error of {error}. Edges of about {wanted} would reduce "
    "the error to {limit}; subdivide the mesh, or choose the topology ADAPTIVE",
    "object {object}: its faces, {edge} wide on average, are too coarse for its light. "
    "Interpolation over the faces causes an error of {error}. Edges of about {wanted} would reduce "
    "the error to {limit}; lower target_error, or raise max_vertices if it was reached",
    "max_vertices ({count}) was reached before the meshes could follow the light to the target; "
    "raise max_vertices, or raise target_error",
    "max_vertices ({count}) is not more than the {vertices} vertices that the meshes have, so that "
    "none is added for the light; raise max_vertices",
    "{count} more objects are too coarse for their light; the report lists the error of each "
    "object",
)
_TOO_BRIGHT = " is too bright; reduce it to at most 1e15 (W/m^2, W/sr or W/(m^2 sr))"
# Errors. {what} is a name in the interface of the library.
ERRORS = (
    "the bake was cancelled", "out of memory",
    "the bake needs more than three quarters of this computer's memory ({size} MB); set "
    "memory_limit to allow more, reduce max_patches, or bake fewer objects or simpler meshes at "
    "once",
    "the bake needs more memory than memory_limit allows ({size} MB); raise memory_limit, reduce "
    "max_patches, or bake fewer objects or simpler meshes at once",
    "this processor does not support SSE 4.2 and POPCNT, which Raybundle requires",
    "the ray tracer Embree could not {what}: out of memory",
    "the ray tracer Embree could not {what}: it does not support this processor",
    "the ray tracer Embree could not {what}",
    "the scene has too many faces: it needs at least {count} patches, and only {most} are "
    "possible; simplify meshes, or hide objects in renders",
    "object {object}: its light is too bright to be stored; reduce the strength of the lights, or "
    "move them away from the object",
    "object {object} reaches further than 1e12 m from the origin",
    "light {light} reaches further than 1e12 m from the origin",
    "light {light}" + _TOO_BRIGHT, "material {material}: its emission" + _TOO_BRIGHT,
    "the world radiance" + _TOO_BRIGHT, "a pixel of the world image" + _TOO_BRIGHT,
    "light {light}: its strength must be finite and not negative",
    "light {light}: its position, direction and size must be finite, and its size not negative",
    "light {light}: its direction must not be zero",
    "material {material}: reflectance and emission must be finite and not negative",
    "object {object}: its transform is not finite",
    "mesh {mesh}: {what} {index} is not a finite number",
    "the world radiance must be finite",
    "the pixels of the world image must be finite and not negative",
    "solver {solver} does not work with {what}: {why}; choose {instead}",
    "thesis_literal does not work with {what}: {why}; choose {instead}",
    "lines_per_bundle 1 does not work with {what}: {why}; choose {instead}",
    # {why}
    "it moves no light while it traces, so that directions cannot adapt to the light",
    "it passes light from one bundle to the next, so that directions must be independent",
    "it passes all light from one bundle to the next, so that directions must be independent and "
    "of equal weight",
    "it does not converge with exchanges that are found with a small probability, because their "
    "weights have no bound",
    "it follows random local rays and has no bundles",
    "it follows local rays and has no bundles to project",
    "the pseudo-code of the thesis has no weights", "local rays have no pixels",
    "single lines are traced without a projector", "it is a variant of another solver",
    "it moves the light of all sets together and cannot separate them",
)
# What was skipped, and why.
SKIPS = (
    "bundles and solve", "no light reaches any surface",
    "no surface reflects light, and lines carry no other light", "patches and lines",
    "the geometry is unchanged since the last bake", "first shot",
    "the lights are unchanged since the last bake",
    "only the strengths of lights have changed since the last bake; their light was scaled",
    "these lights are as before, or have only changed their strengths; only the others were "
    "gathered",
    "all stages",
    "nothing or only the strengths of lights have changed since the last draft; its light was "
    "scaled",
    "the second pass", "no mesh needed more vertices for its light",
    "faces", "their area is zero or no larger than rounding errors", "projection of faces",
    "neighbouring faces of equal shape in one plane were projected together", "corners",
    "no result is needed there", "patches",
    "they are not shown and finer than needed; they exchanged light in clusters", "emission",
    "it is inside closed surfaces that contain nothing else", "shadow rays",
    "the side and the source cannot face each other", "noise of direct light",
    "the source is fully visible; a closed form gives its light", "most shadow rays",
    "the source contributes little of the light", "the side is the inside of a solid",
    "the sides are not shown and finer than tiles; other sides gathered for them", "bundles",
    "the light that a few bright sides reflect was gathered instead",
    "few lines meet the noisy sides; these sides cast rays instead", "bundles on small patches",
    "too few lines met the patches; they gathered light with local rays",
    "the noise has reached its target", "iterations of a solve",
    "the solve started from the last solution", "final gather",
    "interpolation gives the light at these corners", "light on patches",
    "only few corners need a result; they gathered the light themselves",
    "the mesh is dense; light from around was gathered at some vertices and interpolated between",
    "reconstruction", "the objects only occlude",
)
_NAMES_AND_MORE = re.compile(r'(?P<names>.*") and (?P<count>\d+) more')


def _pattern(template: str) -> re.Pattern:
    return re.compile("".join(
        re.escape(literal) + (f"(?P<{name}>.+?)" if name else "")
        for literal, name, *_ in Formatter().parse(template)))


# Longer templates first: a value of a shorter one could contain a part of a longer one.
_PATTERNS = {template: _pattern(template)
             for template in sorted((*WARNINGS, *ERRORS), key=len, reverse=True)}


# Panels are drawn at every movement of the mouse.
@lru_cache(maxsize=256)
def recognised(text: str) -> str:
    """Returns a text of the library as a message, or as it is if its template is unknown."""
    if text in SKIPS:
        return Message(text)
    for template, pattern in _PATTERNS.items():
        if match := pattern.fullmatch(text):
            return Message(template, **{name: recognised(value) if name == 'why' else _value(value)
                                        for name, value in match.groupdict().items()})
    return text


def _value(text: str) -> str:
    more = _NAMES_AND_MORE.fullmatch(text)
    return Message("{names} and {count} more", **more.groupdict()) if more else text
