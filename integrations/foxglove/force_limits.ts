// The limits of the force: 1.96 standard deviations below and above what was measured, in N.
import { Input } from "./types";

export const inputs = ["/gelslim/force_field"];
export const output = "/gelslim/force_limits";

type Limits = {
  fx_low: number;
  fx_high: number;
  fy_low: number;
  fy_high: number;
  fz_low: number;
  fz_high: number;
};

const WIDTH_95 = 1.96;

export default function script(event: Input<"/gelslim/force_field">): Limits {
  const { force } = event.message.wrench;
  const covariance = event.message.wrench_covariance;
  const half = (k: number): number => WIDTH_95 * Math.sqrt(covariance[7 * k]);
  return {
    fx_low: force.x - half(0),
    fx_high: force.x + half(0),
    fy_low: force.y - half(1),
    fy_high: force.y + half(1),
    fz_low: force.z - half(2),
    fz_high: force.z + half(2),
  };
}
