# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours that a material may have: a constant, plus a weighted image, plus a weighted attribute.

This is what the native library averages over patches. Node trees are evaluated to this form; an
operation that leaves it (image times image, say) replaces one operand by its mean.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

BLACK = np.zeros(3)
WHITE = np.ones(3)

IDENTITY_UV = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


class Result(IntEnum):
    """What a colour has of the result of a bake (shown_results.py), which is no colour."""

    NONE = 0
    FACTOR = 1  # is multiplied by it, which counts as 1
    ALONE = 2  # is it, or is mixed of it: the rest of the expression is a guess


@dataclass(frozen=True)
class Texture:
    """An image on a surface, and the coordinates that it is read at."""

    image: object  # bpy.types.Image
    extension: str  # 'REPEAT', 'EXTEND' or 'CLIP'
    mean: np.ndarray  # (3,), linear RGB
    uv_layer: str = ""  # "" is the active render UV map
    uv_matrix: np.ndarray = field(default_factory=lambda: IDENTITY_UV)  # (2, 3), affine

    def same_as(self, other: Texture) -> bool:
        return (self.image == other.image and self.extension == other.extension
                and self.uv_layer == other.uv_layer
                and np.allclose(self.uv_matrix, other.uv_matrix))


@dataclass(frozen=True)
class ColorExpression:
    """constant + texture_weight * texture + attribute_weight * attribute, each linear RGB."""

    constant: np.ndarray = field(default_factory=lambda: BLACK)  # (3,)
    texture: Texture | None = None
    texture_weight: np.ndarray = field(default_factory=lambda: BLACK)  # (3,)
    attribute: str | None = None  # "" is the render colour attribute
    attribute_weight: np.ndarray = field(default_factory=lambda: BLACK)  # (3,)
    result: Result = Result.NONE

    @property
    def is_constant(self) -> bool:
        return self.texture is None and self.attribute is None

    def scaled(self, factor: np.ndarray | float) -> ColorExpression:
        """This colour times a constant, per channel."""
        return ColorExpression(
            self.constant * factor, self.texture, self.texture_weight * factor,
            self.attribute, self.attribute_weight * factor,
            self.result if np.any(factor) else Result.NONE).simplified()

    def simplified(self) -> ColorExpression:
        """Without terms of weight 0, so that they raise no needless questions later."""
        textured, attributed = np.any(self.texture_weight), np.any(self.attribute_weight)
        return ColorExpression(
            self.constant,
            self.texture if textured else None, self.texture_weight if textured else BLACK,
            self.attribute if attributed else None,
            self.attribute_weight if attributed else BLACK, self.result)

    def can_add(self, other: ColorExpression) -> bool:
        """Whether plus() is exact."""
        return not ((self.texture and other.texture and not self.texture.same_as(other.texture))
                    or (self.attribute is not None and other.attribute is not None
                        and self.attribute != other.attribute))

    def plus(self, other: ColorExpression) -> ColorExpression:
        """The sum; where can_add() is False, the other's varying terms count with their mean."""
        if not self.can_add(other):
            other = ColorExpression(other.mean(), result=other.result)
        return ColorExpression(
            self.constant + other.constant,
            self.texture or other.texture, self.texture_weight + other.texture_weight,
            other.attribute if self.attribute is None else self.attribute,
            self.attribute_weight + other.attribute_weight, max(self.result, other.result))

    def mean(self) -> np.ndarray:
        """(3,); of an attribute, whose values belong to a mesh, half its range is assumed."""
        mean = self.constant + 0.5 * self.attribute_weight
        return mean + self.texture_weight * self.texture.mean if self.texture else mean

    def same_variation(self, other: ColorExpression) -> bool:
        """Whether the two differ by a constant at most."""
        textures = (self.texture is None and other.texture is None) or (
            self.texture is not None and other.texture is not None
            and self.texture.same_as(other.texture))
        return (textures and self.attribute == other.attribute
                and np.allclose(self.texture_weight, other.texture_weight)
                and np.allclose(self.attribute_weight, other.attribute_weight))
