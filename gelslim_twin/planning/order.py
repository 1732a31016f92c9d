"""The order in which effects are applied, from what each takes, computes and refines."""

from __future__ import annotations

from collections.abc import Sequence

from gelslim_twin.effects.effect import Effect


def application_order(effects: Sequence[Effect]) -> tuple[str, ...]:
    """Names of effects in the order in which they are applied."""
    return tuple(effect.name for effect in ordered(effects))


def ordered(effects: Sequence[Effect]) -> list[Effect]:
    """Topological order: providers, their refinements, their users; `after` is respected.

    Effects that do not depend on each other keep the order of the registry. Raises ValueError
    where the declarations form a cycle.
    """
    before = {e.name: {o.name for o in effects if o is not e and _precedes(o, e)} for e in effects}
    left, order = list(effects), list[Effect]()
    done: set[str] = set()
    while left:
        ready = next((e for e in left if before[e.name] <= done), None)
        if ready is None:
            raise ValueError(f"the effects form a cycle: {', '.join(e.name for e in left)}")
        left.remove(ready)
        order.append(ready)
        done.add(ready.name)
    return order


def _precedes(one: Effect, other: Effect) -> bool:
    if one.name in other.after:
        return True
    if set(one.provides) & {*other.needs, *other.refines}:
        return True
    return bool(set(one.refines) & (set(other.needs) - set(other.refines)))
