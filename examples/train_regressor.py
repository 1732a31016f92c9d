# %% [markdown]
# # Train on twin data
#
# A data set of pictures with true forces is made for a few built sensors, which differ from one another as
# fingers of one design do. A small network learns where a ball touches and how hard it pushes. It is judged
# on other sensors.
#
# The libraries are in the extras `record` and `vision`, and scikit-learn. The numbers of samples and the folder are
# arguments: `python train_regressor.py 1600 300 .` trains on the data sets `out/touches` and `out/other_sensors`
# of this folder, and makes what they lack.

# %%
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pyarrow.parquet as pq
from PIL import Image
from sklearn.decomposition import PCA
from sklearn.ensemble import BaggingRegressor
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

import gelslim
from gelslim.examples import example

arguments = sys.argv[1:]
train_count, other_count = (int(a) for a in (*arguments[:2], *("150", "40")[len(arguments[:2]) :]))
folder = Path(arguments[2] if len(arguments) > 2 else mkdtemp())
folder.mkdir(parents=True, exist_ok=True)

# %% [markdown]
# The ranges below `vary` are what the network cannot know in advance. The place of the camera is drawn for each
# built sensor, all else for each sample, and the seed decides what: so another seed has other sensors.

# %%
SCENE = """\
format: gelslim-scene/1
name: {name}
sensor: {{spec: finger.yaml}}
indenters:
  - {{shape: sphere, radius_mm: 6}}
motion:
  waypoints:
    - {{move: press, depth_mm: 0.5, steps: 2, duration_s: 0.2}}
contact: {{friction: 0.5}}
observe: [force, image]
tolerance: {{force_n: 0.05, image_px: 0.3}}
vary:
  x_mm: [-5, 5]
  y_mm: [-5, 5]
  depth_factor: [0.4, 1.4]
  size_factor: [0.5, 1.6]
  friction: [0.3, 0.8]
  light_gain: [0.9, 1.1]
  gel: {{youngs_modulus_factor: [0.85, 1.15]}}
  camera: {{along_mm: [-0.1, 0.1], across_mm: [-0.1, 0.1], turn_deg: [-0.5, 0.5]}}
  sensors: {sensors}
  split: {{by: sample, validation_share: 0, test_share: 0}}
seed: {seed}
"""
for name, text in example("mini20").files("finger").items():
    (folder / name).write_text(text, encoding="utf-8")
for name, sensors, seed, count in (
    ("touches", 4, 1, train_count),
    ("other_sensors", 3, 2, other_count),
):
    scene = folder / f"{name}.yaml"
    scene.write_text(SCENE.format(name=name, sensors=sensors, seed=seed), encoding="utf-8")
    gelslim.data_set(scene, folder / "out" / name, count=count)

# %% [markdown]
# The network sees a picture as cells of 16 x 12 px: how much brighter or darker each is than in the picture of the
# same sensor at rest. The labels are columns of `index.parquet`.


# %%
def cells(picture: Path) -> np.ndarray:
    """Means over the cells of a picture, (40, 40, 3)."""
    values = np.asarray(Image.open(picture), dtype=np.float32)
    return values.reshape(40, 12, 40, 16, 3).mean(axis=(1, 3)) + 5


def read(data_set: Path) -> tuple[np.ndarray, np.ndarray]:
    """Changes of the cells (n, 4800), and x and y of the contact in mm and F_z in N, (n, 3)."""
    rows = pq.read_table(data_set / "index.parquet").to_pylist()
    sensors = {row["sensor"] for row in rows}
    rest = {k: cells(data_set / "sensors" / f"sensor_{k:02d}.png") for k in sensors}
    with ThreadPoolExecutor() as pool:
        seen = pool.map(cells, [data_set / row["file"] for row in rows])
        changes = [(s / rest[r["sensor"]] - 1).ravel() for s, r in zip(seen, rows, strict=True)]
    truth = [(r["contact_x_mm"], r["contact_y_mm"], r["fz_n"]) for r in rows]
    return np.array(changes), np.array(truth)


def learned(changes: np.ndarray, truth: np.ndarray) -> tuple[BaggingRegressor, StandardScaler]:
    """Five small networks on the principal components of the changes, and the scale of the truth."""
    network = make_pipeline(
        PCA(min(30, len(changes) // 3), random_state=0),
        StandardScaler(),
        MLPRegressor(hidden_layer_sizes=(128, 64), alpha=1.0, max_iter=1500, random_state=0),
    )
    scale = StandardScaler().fit(truth)
    model = BaggingRegressor(network, 5, bootstrap=False, n_jobs=-1, random_state=0)
    return model.fit(changes, scale.transform(truth)), scale


train, other = read(folder / "out" / "touches"), read(folder / "out" / "other_sensors")
model, scale = learned(*train)
found = scale.inverse_transform(model.predict(other[0]))

# %% [markdown]
# The error on the other sensors, beside that of an answer that is always the mean:


# %%
def errors(found: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    """Median and 95 % of the distance in mm and of the error of the normal force in N."""
    place = np.hypot(*(found - truth)[:, :2].T)
    force = np.abs(found - truth)[:, 2]
    return {
        "place_mm": float(np.median(place)),
        "place_95_mm": float(np.quantile(place, 0.95)),
        "force_n": float(np.median(force)),
        "force_95_n": float(np.quantile(force, 0.95)),
        "force_share": float(np.median(force / np.abs(truth[:, 2]))),
    }


network, constant = errors(found, other[1]), errors(train[1].mean(axis=0), other[1])
for text, e in (("network", network), ("mean", constant)):
    print(
        f"{text}: place {e['place_mm']:.2f} mm (95 %: {e['place_95_mm']:.2f} mm), "
        f"normal force {e['force_n']:.3f} N (95 %: {e['force_95_n']:.3f} N), "
        f"{e['force_share']:.0%} of it"
    )
enough = network["place_mm"] < constant["place_mm"] / 2
assert enough, f"{train_count} samples are too few to learn from: take 150 or more"
assert network["force_n"] < constant["force_n"] / 2
