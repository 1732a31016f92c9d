# %% [markdown]
# # Frames to forces
#
# A sensor is its bundle and one picture of the untouched gel. Then each camera frame gives a wrench and
# a force at every node of the gel's surface. The frames of this page are drawn by the digital twin, whose
# true forces are known; yours come from a camera.

# %%
import csv
from pathlib import Path
from tempfile import mkdtemp

import gelslim
from gelslim.examples import example

folder = Path(mkdtemp())
for name, text in example("press_sphere").files("press").items():
    (folder / name).write_text(text, encoding="utf-8")

# %% [markdown]
# The scene presses a ball 0.8 mm into the gel in 16 steps. Here it goes half as deep in three steps:

# %%
scene_file = folder / "press.yaml"
scene = scene_file.read_text(encoding="utf-8")
scene = scene.replace("steps: 16", "steps: 3").replace("depth_mm: 0.8", "depth_mm: 0.4")
scene_file.write_text(scene, encoding="utf-8")
gelslim.simulate(scene_file, folder / "run")
pictures = sorted((folder / "run" / "frames").glob("*.png"))

# %% [markdown]
# The bundle of this finger, and the sensor opened with the first picture, which shows no contact.
# Because the ball's radius is known, the normal force is too.

# %%
made = gelslim.make_bundle(folder / "gelslim2.yaml", measure=False)
sensor = gelslim.open_sensor(made.bundle, reference=pictures[0], indenter="sphere:10")
with gelslim.open_frames(folder / "run" / "frames") as frames:
    wrenches = [sensor.process(frame).wrench for frame in frames]

# %%
with open(folder / "run" / "truth.csv", newline="", encoding="utf-8") as stream:
    truth = list(csv.DictReader(line for line in stream if not line.startswith("#")))
true_n = float(truth[-1]["fz_n"])
found_n = float(wrenches[-1].force_n[2])
print(f"normal force {found_n:.2f} N, true {true_n:.2f} N")
assert abs(found_n - true_n) < 0.15 * abs(true_n)
