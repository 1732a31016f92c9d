// The force field as arrows on the gel, its resultant, and the outline of the gel, for the 3D panel.
import { Input, Message } from "./types";

export const inputs = ["/gelslim/force_field"];
export const output = "/gelslim/scene";

type Vector = { x: number; y: number; z: number };

const METRES_PER_PASCAL = 2e-7; // 10 kPa are 2 mm
const METRES_PER_NEWTON = 0.01;
const LEAST_PASCAL = 300;
const RED = { r: 0.85, g: 0.2, b: 0.15, a: 1 };
const BLUE = { r: 0.1, g: 0.35, b: 0.75, a: 1 };
const GREY = { r: 0.55, g: 0.55, b: 0.55, a: 1 };
const AT_ORIGIN = { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };

// What is not known is NaN in the messages, and has no arrow.
const known = (value: number): number => (Number.isFinite(value) ? value : 0);

// The rotation that turns the x axis into a direction of length 1.
function turned(d: Vector): { x: number; y: number; z: number; w: number } {
  const w = 1 + d.x;
  const size = Math.hypot(w, d.z, d.y);
  return size < 1e-9
    ? { x: 0, y: 0, z: 1, w: 0 }
    : { x: 0, y: -d.z / size, z: d.y / size, w: w / size };
}

export default function script(
  event: Input<"/gelslim/force_field">,
): Message<"foxglove.SceneUpdate"> {
  const { header, points, traction, wrench, centre_of_pressure: centre } = event.message;
  const arrows: Vector[] = [];
  const least: Vector = { x: 0, y: 0, z: 0 };
  const most: Vector = { x: 0, y: 0, z: 0 };
  for (let k = 0; k + 2 < points.length; k += 3) {
    const start = { x: points[k], y: points[k + 1], z: points[k + 2] };
    least.x = Math.min(least.x, start.x);
    least.y = Math.min(least.y, start.y);
    most.x = Math.max(most.x, start.x);
    most.y = Math.max(most.y, start.y);
    const t = { x: known(traction[k]), y: known(traction[k + 1]), z: known(traction[k + 2]) };
    if (Math.hypot(t.x, t.y, t.z) > LEAST_PASCAL) {
      arrows.push(start, {
        x: start.x + METRES_PER_PASCAL * t.x,
        y: start.y + METRES_PER_PASCAL * t.y,
        z: start.z + METRES_PER_PASCAL * t.z,
      });
    }
  }
  const force = { x: known(wrench.force.x), y: known(wrench.force.y), z: known(wrench.force.z) };
  const size = Math.hypot(force.x, force.y, force.z);
  const direction = { x: force.x / size, y: force.y / size, z: force.z / size };
  const resultant = {
    pose: {
      position: { x: known(centre[0]), y: known(centre[1]), z: 0 },
      orientation: size > 0 ? turned(direction) : AT_ORIGIN.orientation,
    },
    shaft_length: 0.8 * METRES_PER_NEWTON * size,
    shaft_diameter: 0.0006,
    head_length: 0.2 * METRES_PER_NEWTON * size,
    head_diameter: 0.0014,
    color: BLUE,
  };
  const line = { pose: AT_ORIGIN, scale_invariant: true, colors: [], indices: [] };
  const corners = [
    { x: least.x, y: least.y, z: 0 },
    { x: most.x, y: least.y, z: 0 },
    { x: most.x, y: most.y, z: 0 },
    { x: least.x, y: most.y, z: 0 },
  ];
  return {
    deletions: [],
    entities: [
      {
        timestamp: header.stamp,
        frame_id: header.frame_id,
        id: "force field",
        lifetime: { sec: 0, nsec: 0 },
        frame_locked: true,
        metadata: [],
        arrows: size > 0 ? [resultant] : [],
        cubes: [],
        spheres: [],
        cylinders: [],
        lines: [
          { ...line, type: 2, thickness: 2, points: arrows, color: RED },
          { ...line, type: 1, thickness: 1, points: corners, color: GREY },
        ],
        triangles: [],
        texts: [],
        models: [],
      },
    ],
  };
}
