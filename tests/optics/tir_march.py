"""Rays marched wall to wall through one side of a curved profile, with vectors, the slow way."""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from gelslim_optics.guide.profile import Arc, Edge, GuideProfile, Segment

LEAKED, RETURNED, ARRIVED, LOST = range(4)


def side(profile: GuideProfile) -> list[Edge]:
    """Right leg and bend of a curved profile, closed at the bend's end by an edge `exit`."""
    edges = [e for e in profile.edges if e.name.endswith(("_leg_right", "_bend_right"))]
    inner, outer = profile.edge("inner_bend_right"), profile.edge("outer_bend_right")
    gate = Edge("exit", Segment(inner.curve.start, outer.curve.end), "acrylic", "air")
    return [*edges, profile.edge("foot_right"), gate]


def leg(profile: GuideProfile) -> list[Edge]:
    """Right leg of a curved profile, closed at the bend's beginning by an edge `exit`."""
    edges = [e for e in profile.edges if e.name.endswith("_leg_right")]
    inner, outer = profile.edge("inner_leg_right"), profile.edge("outer_leg_right")
    gate = Edge("exit", Segment(inner.curve.start, outer.curve.end), "acrylic", "air")
    return [*edges, profile.edge("foot_right"), gate]


def launch(
    foot: Segment | Arc, na: float, count: int, index: float, *, plane: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Places (y, z) and unit directions (y, z, x) that fill foot and cone evenly; Sobol points."""
    u = qmc.Sobol(3, seed=7).random(count)
    start, end = np.array(foot.start), np.array(foot.end)
    along = (end - start) / np.linalg.norm(end - start)
    into = np.array([-along[1], along[0]])
    if plane:
        p, q = na * (2 * u[:, 1] - 1) / index, np.zeros(count)
    else:
        radius, angle = na * np.sqrt(u[:, 1]) / index, 2 * np.pi * u[:, 2]
        p, q = radius * np.cos(angle), radius * np.sin(angle)
    forward = np.sqrt(1 - p * p - q * q)
    way = np.column_stack([p[:, None] * along + forward[:, None] * into, q])
    return start + u[:, :1] * (end - start), way


def march(
    edges: list[Edge], place: np.ndarray, way: np.ndarray, index: float, outside: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Fate of each ray and its last direction. Walls reflect totally or the ray has leaked."""
    place, way = place.copy(), way.copy()
    fate = np.full(len(place), LOST)
    alive = np.arange(len(place))
    for _ in range(400):
        if alive.size == 0:
            break
        steps = np.stack([_step(e, place[alive], way[alive, :2]) for e in edges])
        which = steps.argmin(0)
        place[alive] += way[alive, :2] * steps.min(0)[:, None]
        for number, edge in enumerate(edges):
            met = alive[which == number]
            if edge.name == "exit" or edge.name.startswith("foot"):
                fate[met] = ARRIVED if edge.name == "exit" else RETURNED
                continue
            normal = _normal(edge, place[met])
            across = (way[met, :2] * normal).sum(1)
            out = index * np.sqrt(np.maximum(1 - across**2, 0)) < outside
            fate[met[out]] = LEAKED
            way[met, :2] -= np.where(out, 0, 2 * across)[:, None] * normal
        alive = alive[fate[alive] == LOST]
    return fate, way


def _step(edge: Edge, place: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Way to the edge in units of `way`; inf where it is missed."""
    c = edge.curve
    if isinstance(c, Segment):
        start, run = np.array(c.start), np.subtract(c.end, c.start)
        turn = way[:, 0] * run[1] - way[:, 1] * run[0]
        gap = start - place
        with np.errstate(divide="ignore", invalid="ignore"):
            step = (gap[:, 0] * run[1] - gap[:, 1] * run[0]) / turn
            part = (gap[:, 0] * way[:, 1] - gap[:, 1] * way[:, 0]) / turn
        return np.where((step > 1e-9) & (part >= -1e-12) & (part <= 1 + 1e-12), step, np.inf)
    gap = place - np.array(c.centre)
    a, b = (way**2).sum(1), (way * gap).sum(1)
    inside = b * b - a * ((gap**2).sum(1) - c.radius_mm**2)
    root = np.sqrt(np.maximum(inside, 0))
    best = np.full(len(place), np.inf)
    for step in ((-b + root) / a, (-b - root) / a):
        hit = gap + step[:, None] * way
        turned = np.arctan2(hit[:, 1], hit[:, 0]) - c.start_rad
        turned = np.mod(np.sign(c.sweep_rad) * turned + 1e-12, 2 * np.pi)
        good = (inside > 0) & (step > 1e-9) & (turned <= abs(c.sweep_rad) + 2e-12)
        best = np.where(good, np.minimum(best, step), best)
    return best


def _normal(edge: Edge, place: np.ndarray) -> np.ndarray:
    c = edge.curve
    if isinstance(c, Segment):
        run = np.subtract(c.end, c.start) / c.length_mm
        return np.broadcast_to([-run[1], run[0]], place.shape)
    return (place - np.array(c.centre)) / c.radius_mm
