# %% [markdown]
# # A grasp in MuJoCo
#
# Two fingers close on a ball, lift it, and let it slip. MuJoCo moves the bodies; the contact between ball and
# gels comes from the twin, at 500 steps a second. A video shows the scene beside what both sensors see.
#
#     pip install 'gelslim-cad[sim,vision]'
#     python examples/mujoco_grasp.py                # fingers drawn as boxes, sensor of a shipped design
#     python examples/mujoco_grasp.py out/gelslim2   # the fingers and the sensor that `gelslim build` wrote there
#
# The names of joints, actuators and sites are those of `robot/gripper.xml`, which `gelslim build` writes with the
# fingers as solids.

# %%
import sys
import time
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

import gelslim
from gelslim.examples import example
from gelslim_core.errors import GelslimError
from gelslim_core.optional_library import load

mujoco = load("mujoco", "the physics of this example")
RADIUS_MM, MASS_KG, GRIP_N, LOOSE_N, LIFT_M = 9.0, 0.1, 0.9, 0.4, 0.03
DT_S, FRAME_EVERY, GAP_M = 0.002, 20, 0.003
BUILT = Path(sys.argv[1]) if len(sys.argv) == 2 and not sys.argv[1].startswith("-") else None

SCENE = f"""
<mujoco model="grasp">
  <option timestep="{DT_S}"/>
  <visual><global offwidth="640" offheight="480"/></visual>
  <asset><texture type="skybox" builtin="gradient" rgb1="1 1 1" rgb2="0.8 0.85 0.9" width="64" height="384"/></asset>
  <worldbody>
    <light pos="0.1 -0.4 0.6" dir="-0.1 0.4 -0.5"/>
    <camera name="front" pos="0 -0.13 0.14" xyaxes="1 0 0 0 0.15 1"/>
    <geom type="plane" size="0.3 0.3 0.01" rgba="0.75 0.78 0.8 1"/>
    <geom name="post" type="cylinder" size="0.004 0.05" pos="0 0 0.05" rgba="0.5 0.5 0.5 1"/>
    <body name="object" pos="0 0 {0.1 + RADIUS_MM / 1000}">
      <freejoint name="object"/>
      <geom name="object" type="sphere" size="{RADIUS_MM / 1000}" mass="{
    MASS_KG
}" rgba="0.9 0.55 0.2 1"/>
    </body>
    <body name="hand" pos="0 0 {0.1 + RADIUS_MM / 1000}" gravcomp="1">
      <joint name="lift" type="slide" axis="0 0 1" range="0 0.2" damping="20"/>
      <geom type="box" size="0.05 0.01 0.005" pos="0 0 0.05" mass="0.5" contype="0" conaffinity="0"/>
      {
    "".join(
        f'''
      <body name="{side}_jaw" pos="{sign * (RADIUS_MM / 1000 + GAP_M)} 0 0" gravcomp="1">
        <joint name="{side}_jaw" type="slide" axis="{-sign} 0 0" range="0 0.02" damping="30"/>
        <geom type="box" size="0.004 0.01 0.012" pos="{sign * 0.006} 0 0" mass="0.1" contype="0" conaffinity="0"
              rgba="0.3 0.35 0.4 1"/>
        <geom type="box" size="0.001 0.009 0.009" pos="{sign * 0.001} 0 0" mass="0" contype="0" conaffinity="0"
              rgba="0.85 0.3 0.5 0.6"/>
        <site name="{side}_gel" xyaxes="0 0 -1 0 {-sign} 0" size="0.001"/>
      </body>'''
        for side, sign in (("left", -1), ("right", 1))
    )
}
    </body>
  </worldbody>
  <equality><joint joint1="left_jaw" joint2="right_jaw" polycoef="0 1 0 0 0"/></equality>
  <actuator>
    <motor name="left_grip" joint="left_jaw"/>
    <motor name="right_grip" joint="right_jaw"/>
    <position name="lift" joint="lift" kp="2000" kv="60"/>
  </actuator>
</mujoco>
"""

# %% [markdown]
# With built fingers the scene is their `robot/gripper.xml`: a ball takes the place of its box. The gels no longer
# collide, because their contact comes from the twin, nor do the cases, whose convex hulls fill the window of the gel.


# %%
def built_model(folder):
    """The gripper of a build with a ball as its object."""
    spec = mujoco.MjSpec.from_file(str(folder / "robot" / "gripper.xml"))
    spec.option.timestep = DT_S
    for name in (
        f"{side}_collision_{part}" for side in ("left", "right") for part in ("gel", "case")
    ):
        piece = spec.geom(name)
        piece.contype = piece.conaffinity = 0
    ball, post = spec.geom("object"), spec.geom("post")
    ball.type, ball.mass = mujoco.mjtGeom.mjGEOM_SPHERE, MASS_KG
    ball.size = [RADIUS_MM / 1000, 0, 0]
    post.type, post.size = mujoco.mjtGeom.mjGEOM_CYLINDER, [0.004, post.size[2], 0]
    spec.body("object").pos = [0, 0, post.pos[2] + post.size[1] + RADIUS_MM / 1000]
    spec.worldbody.add_camera(
        name="front", pos=[0, -0.3, 0.09], xyaxes=[1, 0, 0, 0, 0.2, 1], fovy=35
    )
    return spec.compile()


def started(model):
    """The scene at its start, the gels a gap away from the ball."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for side in ("left", "right"):
        away_m = abs(data.site(f"{side}_gel").xpos[0]) - RADIUS_MM / 1000
        data.joint(f"{side}_jaw").qpos = away_m - GAP_M
    mujoco.mj_forward(model, data)
    return data


# %% [markdown]
# The sensor of the build, or of a shipped finger. The gel relaxes a little, which takes the energy out of vibrations. The twin is told to
# stay with the linear gel; `step.excess` says what that costs.

# %%
folder = Path(mkdtemp())
bundle = folder / "bundle" if BUILT is None else BUILT / "bundle"
if BUILT is None:
    for name, text in example("mini20").files("finger").items():
        (folder / name).write_text(text, encoding="utf-8")
    gelslim.write_bundle(bundle, gelslim.make_bundle(folder / "finger.yaml", measure=False).bundle)
left = gelslim.Twin(
    bundle,
    observe=("force", "image"),
    tolerance={"force": "2%"},
    friction=0.8,
    effects={
        "nonlinearity": "off",
        "relaxation": {"terms": [{"fraction": 0.3, "time_s": 0.01}]},
    },
)
left.add(gelslim.Body.sphere(RADIUS_MM, name="ball"))
left.prepare()
twins = {"left": left, "right": left.clone()}  # of one sensor: they share what was prepared


# %% [markdown]
# One coupled step. The pose of the ball in the frame of each sensor goes to its twin; the reaction comes back as a force
# on the ball and its opposite on the finger. MuJoCo takes forces at the centre of mass of a body, in m and N.


# %%
def coupled_step(model, data):
    """Advance the scene by one step; returns the twins' answers."""
    mujoco.mj_step1(model, data)  # poses as of now; after mj_step they are one step old
    data.xfrc_applied[:] = 0.0
    ball = model.body("object").id
    steps = {}
    for side, twin in twins.items():
        site = model.site(f"{side}_gel")
        turn = data.site_xmat[site.id].reshape(3, 3)
        pose = np.eye(4)
        pose[:3, :3] = turn.T @ data.xmat[ball].reshape(3, 3)
        pose[:3, 3] = 1000 * turn.T @ (data.xpos[ball] - data.site_xpos[site.id])
        steps[side] = step = twin.step(pose, DT_S)
        force, torque = turn @ step.reactions[0, :3], turn @ step.reactions[0, 3:] / 1000
        for body, sign in ((ball, 1.0), (int(site.bodyid[0]), -1.0)):
            arm = data.xpos[ball] - data.xipos[body]
            data.xfrc_applied[body] += sign * np.concatenate([force, torque + np.cross(arm, force)])
    mujoco.mj_step2(model, data)
    return steps


def commands(time_s):
    """Grip in N and lift in m: close, lift, hold, loosen."""
    grip = GRIP_N if time_s < 1.6 else LOOSE_N
    return grip, LIFT_M * float(np.clip((time_s - 0.4) / 0.6, 0.0, 1.0))


# %%
model = mujoco.MjModel.from_xml_string(SCENE) if BUILT is None else built_model(BUILT)
data = started(model)
try:
    renderer = mujoco.Renderer(model, 480, 640)
except Exception as error:  # no display and no EGL: MuJoCo raises what its loader raises
    print(f"The scene is not drawn ({error}); the video shows the tactile frames alone")
    renderer = None
log, pictures, spent_s = [], [], []
for number in range(1100):
    grip, lift = commands(data.time)
    data.ctrl[:] = grip, grip, lift
    begun = time.process_time()
    try:
        steps = coupled_step(model, data)
    except GelslimError as error:
        raise SystemExit(f"at {data.time:.3f} s: {error}") from error
    spent_s.append(time.process_time() - begun)
    normal = [-steps[side].wrench[2] for side in twins]
    upward = data.xfrc_applied[model.body("object").id][2]
    log.append((data.time, data.body("object").xpos[2], *normal, upward))
    if number % FRAME_EVERY == 0:
        row = [steps[side].image() for side in twins]
        if renderer is not None:
            renderer.update_scene(data, camera="front")
            row.insert(0, renderer.render().copy())
        pictures.append(np.concatenate(row, axis=1))
time_s, height_m, left_n, right_n, upward_n = np.array(log).T

# %% [markdown]
# While the ball is held, each gel bears the force of its drive and both together the weight. With the weak grip,
# friction holds 2 µ F = 0.64 N of the 0.98 N, and the ball slides down.

# %%
holding = (time_s > 1.3) & (time_s < 1.6)
weight_n = 9.81 * MASS_KG
rise_mm = 1000 * (height_m - height_m[0])
in_contact = [s for s, f in zip(spent_s, left_n, strict=True) if f > 0]
print(
    f"normal force while holding: {left_n[holding].mean():.3f} and {right_n[holding].mean():.3f} N"
)
print(f"friction bears {upward_n[holding].mean():.3f} N of {weight_n:.3f} N")
print(f"lifted by {rise_mm[holding].mean():.2f} mm, then down to {rise_mm[-1]:.1f} mm")
print(f"both twins and MuJoCo: {1000 * np.median(in_contact):.1f} ms a step in contact (CPU)")
assert np.isfinite(np.array(log)).all()
assert abs(left_n[holding].mean() / GRIP_N - 1) < 0.03
assert abs(right_n[holding].mean() / GRIP_N - 1) < 0.03
assert abs(upward_n[holding].mean() / weight_n - 1) < 0.02
assert 0.9 * 1000 * LIFT_M < rise_mm[holding].mean() < 1000 * LIFT_M + 0.5
assert np.ptp(rise_mm[holding]) < 0.3
assert rise_mm[-1] < rise_mm[holding].mean() - 5.0

# %%
try:
    cv2 = load("cv2", "the video")
except GelslimError as error:
    print(error)
else:
    height, width = pictures[0].shape[:2]
    video = cv2.VideoWriter(
        str(folder / "grasp.mp4"), cv2.VideoWriter_fourcc(*"mp4v"), 25, (width, height)
    )
    for picture in pictures:
        video.write(np.ascontiguousarray(picture[..., ::-1]))
    video.release()
    print(f"{len(pictures)} frames in {folder / 'grasp.mp4'}")
