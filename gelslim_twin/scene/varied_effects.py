"""Ranges of the parameters of effects: a block for each effect that has numbers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, get_args

from pydantic import Field, create_model, model_validator

from gelslim_core.yaml.base import Block
from gelslim_twin.effects.effect import Effect
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.scene.distribution import Range, require_ordered

OF_SENSOR = ("marker_print", "dirt", "defocus", "specular", "shading", "lens_distortion")
"""Effects whose parameters are those of a built sensor; others are drawn for every sample."""


class _RangesOfEffect(Block):
    """Ranges of the numbers of one effect. What has no range stays as the scene says."""

    @model_validator(mode="after")
    def _ordered(self) -> _RangesOfEffect:
        for name in type(self).model_fields:
            given = getattr(self, name)
            if given is not None:
                require_ordered(name, given)
        return self


def _numbers(effect: Effect) -> dict[str, type]:
    """The parameters of an effect that are numbers, with their kind."""
    found: dict[str, type] = {}
    for name, info in effect.parameters.model_fields.items():
        kinds = [k for k in (info.annotation, *get_args(info.annotation)) if k in (int, float)]
        if kinds and name != "use":
            found[name] = kinds[0]
    return found


def _block(effect: Effect) -> Any:
    known = effect.parameters.model_fields
    fields: dict[str, Any] = {
        name: (Range | None, Field(default=None, description=known[name].description))
        for name in _numbers(effect)
    }
    return create_model(
        f"Varied_{effect.name}",
        __base__=_RangesOfEffect,
        __module__=__name__,
        __doc__=_RangesOfEffect.__doc__,
        **fields,
    )


NUMBERS = {effect.name: found for effect in EFFECTS if (found := _numbers(effect))}
"""For each effect its parameters that are numbers, with their kind."""
_BLOCKS = {effect.name: _block(effect) for effect in EFFECTS if effect.name in NUMBERS}
# A block is pickled by its name in this module.
globals().update({block.__name__: block for block in _BLOCKS.values()})


class RangesOfEffects(Block):
    """Ranges of the parameters of effects."""

    def ranges(self) -> Iterator[tuple[str, str, Range]]:
        """Effect, parameter and range of everything that is drawn."""
        for effect, names in NUMBERS.items():
            block = getattr(self, effect)
            for name in names:
                given = None if block is None else getattr(block, name)
                if given is not None:
                    yield effect, name, given


if TYPE_CHECKING:
    VariedEffects = RangesOfEffects
else:
    VariedEffects = create_model(
        "VariedEffects",
        __base__=RangesOfEffects,
        __module__=__name__,
        __doc__=RangesOfEffects.__doc__,
        **{
            name: (
                block | None,
                Field(default=None, description=f"Ranges of the parameters of `{name}`"),
            )
            for name, block in _BLOCKS.items()
        },
    )
"""The block `vary.effects` of a scene."""
