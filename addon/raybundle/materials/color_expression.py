# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of materials in the form constant + weighted image + weighted attribute.

The native library averages colours of this form over patches. Node trees are evaluated to this
form. An operation whose result does not have this form, such as the product of two images, replaces
one operand by its mean.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

BLACK = np.zeros(3)
WHITE = np.ones(3)

IDENTITY_UV = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


class Result(IntEnum):
    """How a colour depends on the result of an earlier bake (shown_results.py).

    A result is light. It does not contain the colour of the surface that shows it.
    """

    NONE = 0
    FACTOR = 1  # the colour is multiplied by a result, which counts as 1
    ALONE = 2  # the colour is a result or is mixed with one; the expression is only a guess


@dataclass(frozen=True)
class Texture:
    """An image on a surface, with the coordinates at which it is read."""

    image: object  # bpy.types.Image
    extension: str  # 'REPEAT', 'EXTEND' or 'CLIP'
    mean: np.ndarray  # (3,), linear RGB
    uv_layer: str = ""  # name of a UV map; "" is the active render UV map
    # (2, 3), affine map of the coordinates
    uv_matrix: np.ndarray = field(default_factory=lambda: IDENTITY_UV)

    def same_as(self, other: Texture) -> bool:
        """Returns whether both textures read the same image at the same coordinates with the same
        extension."""
        return (self.image == other.image and self.extension == other.extension
                and self.uv_layer == other.uv_layer
                and np.allclose(self.uv_matrix, other.uv_matrix))


@dataclass(frozen=True)
class ColorExpression:
    """The colour constant + texture_weight * texture + attribute_weight * attribute, in linear
    RGB."""

    constant: np.ndarray = field(default_factory=lambda: BLACK)  # (3,)
    texture: Texture | None = None
    texture_weight: np.ndarray = field(default_factory=lambda: BLACK)  # (3,)
    attribute: str | None = None  # name; "" is the render colour attribute
    attribute_weight: np.ndarray = field(default_factory=lambda: BLACK)  # (3,)
    result: Result = Result.NONE

    @property
    def is_constant(self) -> bool:
        return self.texture is None and self.attribute is None

    def scaled(self, factor: np.ndarray | float) -> ColorExpression:
        """Returns this colour times a constant, which is one number or (3,) by channel."""
        return ColorExpression(
            self.constant * factor, self.texture, self.texture_weight * factor,
            self.attribute, self.attribute_weight * factor,
            self.result if np.any(factor) else Result.NONE).simplified()

    def simplified(self) -> ColorExpression:
        """Returns this colour without an image or attribute whose weight is 0, so that the colour
        does not count as varying."""
        textured, attributed = np.any(self.texture_weight), np.any(self.attribute_weight)
        return ColorExpression(
            self.constant,
            self.texture if textured else None, self.texture_weight if textured else BLACK,
            self.attribute if attributed else None,
            self.attribute_weight if attributed else BLACK, self.result)

    def can_add(self, other: ColorExpression) -> bool:
        """Returns whether plus() is exact: the two colours have no different images and no
        different attributes."""
        return not ((self.texture and other.texture and not self.texture.same_as(other.texture))
                    or (self.attribute is not None and other.attribute is not None
                        and self.attribute != other.attribute))

    def plus(self, other: ColorExpression) -> ColorExpression:
        """Returns the sum of the two colours. If can_add() is False, the mean of the other colour
        is added."""
        if not self.can_add(other):
            other = ColorExpression(other.mean(), result=other.result)
        return ColorExpression(
            self.constant + other.constant,
            self.texture or other.texture, self.texture_weight + other.texture_weight,
            other.attribute if self.attribute is None else self.attribute,
            self.attribute_weight + other.attribute_weight, max(self.result, other.result))

    def mean(self) -> np.ndarray:
        """Returns the mean colour, (3,) linear RGB. The values of an attribute belong to a mesh and
        are not available here; 0.5, the middle of the range 0 to 1, is assumed for them."""
        mean = self.constant + 0.5 * self.attribute_weight
        return mean + self.texture_weight * self.texture.mean if self.texture else mean

    def same_variation(self, other: ColorExpression) -> bool:
        """Returns whether the two colours differ at most by a constant."""
        textures = (self.texture is None and other.texture is None) or (
            self.texture is not None and other.texture is not None
            and self.texture.same_as(other.texture))
        return (textures and self.attribute == other.attribute
                and np.allclose(self.texture_weight, other.texture_weight)
                and np.allclose(self.attribute_weight, other.attribute_weight))
