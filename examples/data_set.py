# %% [markdown]
# # A data set
#
# A scene with a `vary` block describes many contacts. Each is drawn from a seed and simulated with its
# true forces, in a folder of its own; a run that was interrupted goes on where it stopped.

# %%
import csv
from pathlib import Path
from tempfile import mkdtemp

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
answer = gelslim.simulate(folder / "touches.yaml", folder / "out", count=3)
print(answer["scenes"], "scenes,", answer["poses_solved"], "poses solved")

# %%
forces_n = []
for truth_file in sorted((folder / "out").glob("scene_*/truth.csv")):
    with open(truth_file, newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(line for line in stream if not line.startswith("#")))
    forces_n.append(float(rows[-1]["fz_n"]))
print("normal forces in N:", [round(force, 3) for force in forces_n])
assert len(set(forces_n)) == 3
