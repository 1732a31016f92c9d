# %% [markdown]
# # A data set
#
# A scene with a `vary` block describes many contacts. Each is drawn from a seed and simulated with its
# true forces; a run that was interrupted goes on where it stopped. The index is a Parquet table, which
# needs the extra `record`.

# %%
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pyarrow.parquet as pq

import gelslim
from gelslim.examples import example

folder = Path(mkdtemp())
for name, text in example("mini20").files("finger").items():
    (folder / name).write_text(text, encoding="utf-8")
(folder / "touches.yaml").write_text(
    """\
format: gelslim-scene/1
name: touches
sensor: {spec: finger.yaml}
indenters:
  - {shape: sphere, radius_mm: 6}
motion:
  waypoints:
    - {move: press, depth_mm: 0.4, steps: 2, duration_s: 0.1}
observe: [displacement, force]
vary:
  depth_factor: [0.5, 1.2]
  x_mm: [-3, 3]
  tilt_x_deg: [-5, 5, normal]    # 95 % of a normal distribution
  tools:
    - {shape: sphere, radius_mm: 6}
    - {shape: sphere, radius_mm: 4}
    - {shape: flat_punch, radius_mm: 3}
seed: 7
""",
    encoding="utf-8",
)

# %% [markdown]
# What the plan keeps, before anything is simulated:

# %%
plan = gelslim.plan(folder / "touches.yaml")
print([choice.effect for choice in plan.choices if choice.included])

# %%
out = folder / "out"
answer = gelslim.data_set(folder / "touches.yaml", out, count=6)
print(answer["samples"], "samples,", answer["frames"], "frames, splits:", answer["splits"])
assert gelslim.verify_data_set(out)["faults"] == []

# %% [markdown]
# The index has a row for each frame: what was drawn, the labels, and where the arrays are. No tool is in
# two splits.

# %%
rows = pq.read_table(out / "index.parquet").to_pylist()
for row in rows:
    print(row["id"], row["split"], row["tool"], f"{row['fz_n']:.3f} N", row["slip_state"])
assert len({round(row["fz_n"], 6) for row in rows}) == 6

# %%
row = rows[0]
force_n = np.load(out / row["file"] / "force_n.npy")[row["row"]]
print("nodes:", force_n.shape, "sum of their normal forces in N:", force_n[:, 2].sum())
assert abs(force_n[:, 2].sum() - row["fz_n"]) < 1e-4
