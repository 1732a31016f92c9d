"""The report in a browser with the network off: the viewer draws, cuts, explodes, falls back."""

from __future__ import annotations

import html
import io
import json
import math
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import report_sample
import trimesh
from PIL import Image

from gelslim_cad.report.render import Picture, render_report

BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(
        BROWSER is None, reason="NO BROWSER: the page test did not run; apt-get install chromium"
    ),
]
SWITCHES = (
    "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--host-resolver-rules=MAP * ~NOTFOUND", "--hide-scrollbars",
    "--no-first-run", "--enable-logging=stderr", "--virtual-time-budget=3000",
)  # fmt: skip


def browse(folder: Path, page: bytes, *switches: str) -> subprocess.CompletedProcess[str]:
    path = folder / "report.html"
    path.write_bytes(page)
    command = [
        str(BROWSER), *SWITCHES, f"--user-data-dir={folder / 'profile'}", *switches, path.as_uri()
    ]  # fmt: skip
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


def complaints(stderr: str) -> list[str]:
    lines = [line for line in stderr.splitlines() if ":CONSOLE" in line]
    return [line for line in lines if "GPU stall due to ReadPixels" not in line]


def drive(folder: Path, page: bytes, steps: str, *switches: str) -> dict:
    """Run `steps` (which fill `out`) after the viewer `v` has started; returns `out`.

    The page's policy forbids a further script, so this copy goes without it.
    """
    free, count = re.subn(rb'<meta http-equiv="Content-Security-Policy"[^>]*>', b"", page)
    assert count == 1
    script = (
        "<script>addEventListener('load', async () => { const v = window.fingerViewer, out = {};"
        f"try {{ {steps} }} catch (e) {{ out.error = String(e); }}"
        "document.body.dataset.out = JSON.stringify(out); });</script></body>"
    )
    done = browse(folder, free.replace(b"</body>", script.encode()), "--dump-dom", *switches)
    found = re.search(r'data-out="([^"]*)"', done.stdout)
    assert found, done.stderr[-2000:]
    out = json.loads(html.unescape(found.group(1)))
    assert "error" not in out, out
    return out


READ = """
function still() { v.render();
  const g = v.painter.gl, w = g.drawingBufferWidth, h = g.drawingBufferHeight;
  const p = new Uint8Array(4 * w * h); g.readPixels(0, 0, w, h, g.RGBA, g.UNSIGNED_BYTE, p);
  return { p, w, h, at: (x, y) => [...p.subarray(4 * (Math.round(y) * w + Math.round(x)),
    4 * (Math.round(y) * w + Math.round(x)) + 3)] }; }
"""


@pytest.fixture(scope="module")
def page() -> bytes:
    return render_report(report_sample.report())


@pytest.mark.slow
def test_viewer_draws_every_triangle_and_the_page_is_silent(tmp_path, page):
    done = browse(tmp_path, page, "--dump-dom", "--window-size=1280,900")
    viewer = re.search(r'<div id="viewer"[^>]*>', done.stdout).group()
    assert 'data-state="ready"' in viewer
    assert f'data-triangles="{report_sample.triangles()}"' in viewer
    assert f'data-parts="{len(report_sample.pieces())}"' in viewer
    assert complaints(done.stderr) == []


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1280, 1000), (500, 900)])
def test_screenshot_shows_the_coloured_parts(tmp_path, page, size):
    shot = tmp_path / "shot.png"
    browse(tmp_path, page, f"--screenshot={shot}", f"--window-size={size[0]},{size[1] + 600}")
    image = np.asarray(Image.open(io.BytesIO(shot.read_bytes())).convert("RGB")).astype(int)
    stage = np.abs(image - (238, 241, 245)).max(axis=2) <= 1
    rows, columns = np.nonzero(stage)
    top, bottom, left, right = rows.min(), rows.max(), columns.min(), columns.max()
    area = image[top:bottom, left:right]
    drawn = ~stage[top:bottom, left:right]
    assert drawn.mean() > 0.12
    assert len(np.unique(area[drawn] // 4, axis=0)) > 100
    blue = (area[..., 2] > area[..., 0] + 25) & drawn  # the bezel
    assert blue.sum() > 300


@pytest.mark.slow
def test_hiding_exploding_and_picking(tmp_path, page):
    out = drive(
        tmp_path, page,
        READ + """
        out.all = Number(v.root.dataset.triangles);
        const f = v.canvas.getBoundingClientRect();
        const middle = { clientX: f.left + f.width / 2, clientY: f.top + f.height / 2 };
        v.setView("top"); v.render(); out.top = v.pick(middle)?.name;
        v.show(v.parts.find((p) => p.name === "gel pad"), false);
        v.render(); out.under = v.pick(middle)?.name; out.less = Number(v.root.dataset.triangles);
        out.corner = v.pick({ clientX: f.left + 2, clientY: f.top + 2 });
        v.control("all").click(); v.setView("side"); v.render(); const low = v.camera.height;
        v.setExplode(1); v.render(); out.grown = v.camera.height / low;
        v.canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "e" })); out.back = v.explode;
        v.canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" }));
        out.yaw = v.camera.yaw;
        """,
        "--window-size=1280,900",
    )  # fmt: skip
    assert out["all"] == report_sample.triangles()
    assert out["top"] == "gel pad"
    assert out["under"] == "light guide"
    assert out["less"] == out["all"] - 12
    assert out["corner"] is None
    assert out["grown"] > 1.5
    assert out["back"] == 0
    assert out["yaw"] == pytest.approx(-82.5)


@pytest.mark.slow
def test_a_lost_graphics_context_comes_back(tmp_path, page):
    out = drive(
        tmp_path, page,
        READ + """
        const wait = (ms) => new Promise((done) => setTimeout(done, ms));
        const colours = () => new Set(new Uint32Array(still().p.buffer)).size;
        out.before = colours();
        const extension = v.painter.gl.getExtension("WEBGL_lose_context");
        extension.loseContext(); await wait(200); v.render();
        out.lost = Number(v.root.dataset.triangles);
        extension.restoreContext(); await wait(600);
        out.after = colours(); out.drawn = Number(v.root.dataset.triangles);
        """,
    )  # fmt: skip
    assert out["before"] > 50
    assert out["lost"] == 0
    assert out["after"] == out["before"]
    assert out["drawn"] == report_sample.triangles()


@pytest.mark.slow
def test_section_caps_exactly_the_cut_material(tmp_path):
    """A hollow box 40 x 30 x 20 with a cavity 24 x 16 x 8: the cut covers 800 - 192 mm2 of 800."""
    solid = report_sample.block((40, 30, 20), (0, 0, 0)).difference(
        [report_sample.block((24, 16, 8), (0, 0, 0))]
    )
    model = report_sample.glb((("box", solid, (0.8, 0.1, 0.1, 1.0), (0.0, 0.0, 0.0)),))
    page = render_report(replace(report_sample.report(), glb=model))
    out = drive(
        tmp_path, page,
        READ + """
        v.setView("section"); v.setSection(1, 0.01);
        const s = still(), perMm = s.h / (2 * v.camera.height), x0 = s.w / 2, y0 = s.h / 2;
        const cap = [0.8, 0.1, 0.1].map((c) => Math.round(255 * (0.1 + 0.9 * c) ** 0.4545));
        const near = (c, d) => c.every((value, k) => Math.abs(value - d[k]) <= 2);
        let wall = 0, wallCap = 0, hole = 0, holeCap = 0, outside = 0;
        for (let x = -22; x <= 22; x += 0.25) for (let z = -12; z <= 12; z += 0.25) {
          const c = s.at(x0 + x * perMm, y0 + z * perMm);
          const [a, b] = [Math.abs(x), Math.abs(z)];
          if (a < 11.5 && b < 3.5) { hole++; if (near(c, cap)) holeCap++; }
          else if (a < 19.5 && b < 9.5 && (a > 12.5 || b > 4.5)) {
            wall++;
            if (near(c, cap)) wallCap++;
          }
          else if ((a > 20.5 || b > 10.5) && !near(c, s.at(2, 2))) outside++;
        }
        Object.assign(out, { wall, hole, outside, wallShare: wallCap / wall, holeCap,
          segments: v.painter.items[0].cut / 2 });
        """,
        "--window-size=1280,900",
    )  # fmt: skip
    assert out["wall"] > 1000
    assert out["hole"] > 1000
    assert out["wallShare"] > 0.6  # the rest are hatch lines
    assert out["holeCap"] == 0
    assert out["outside"] == 0
    assert out["segments"] >= 8


@pytest.mark.slow
def test_reads_models_of_another_writer(tmp_path):
    """Trimesh writes a parent node, a matrix per node, and leaves the normals to the reader."""
    scene = trimesh.Scene()
    turned = trimesh.transformations.rotation_matrix(math.pi / 2, (0, 0, 1))
    for number, size in enumerate(((40, 30, 20), (10, 6, 4))):
        solid = report_sample.block(size, (0, 0, 0))
        solid.apply_scale(0.001)
        scene.add_geometry(solid, node_name=f"box {number}", transform=turned)
    page = render_report(replace(report_sample.report(), glb=scene.export(file_type="glb")))
    out = drive(
        tmp_path, page,
        """out.parts = v.parts.map((p) => [p.name, p.box.low.concat(p.box.high), p.explode]);
        out.edges = v.painter.items.map((item) => item.edges / 2);
        out.drawn = Number(v.root.dataset.triangles);""",
    )  # fmt: skip
    assert [part[0] for part in out["parts"]] == ["box 0", "box 1"]
    assert out["parts"][0][1] == pytest.approx([-15, -20, -10, 15, 20, 10], abs=1e-4)
    assert out["parts"][1][1] == pytest.approx([-3, -5, -2, 3, 5, 2], abs=1e-4)
    assert out["parts"][0][2] == [0, 0, 0]
    assert out["edges"] == [12, 12]  # a box has 12 edges, its faces' diagonals are none
    assert out["drawn"] == 24


@pytest.mark.slow
def test_without_webgl_a_picture_and_a_word_take_its_place(tmp_path):
    picture = io.BytesIO()
    Image.new("RGB", (60, 40), (200, 0, 200)).save(picture, "PNG")
    pictures = (Picture("Whole", "", picture.getvalue()),)
    page = render_report(report_sample.report(pictures=pictures))
    shot = tmp_path / "shot.png"
    switches = ("--disable-3d-apis", "--window-size=1280,900")
    done = browse(tmp_path, page, "--dump-dom", *switches)
    assert 'data-state="failed"' in done.stdout
    assert "WebGL 2 is not available." in done.stdout
    browse(tmp_path, page, f"--screenshot={shot}", *switches)
    image = np.asarray(Image.open(shot).convert("RGB")).reshape(-1, 3)
    assert (image == (200, 0, 200)).all(axis=1).sum() >= 60 * 40


def test_a_broken_model_is_told_and_the_rest_still_works(tmp_path):
    page = render_report(replace(report_sample.report(), glb=b"glTF but not really, is it?!"))
    done = browse(tmp_path, page, "--dump-dom")
    assert 'data-state="failed"' in done.stdout
    assert "17 dimensions" in done.stdout


@pytest.mark.slow
def test_search_jump_and_filters(tmp_path, page):
    out = drive(
        tmp_path, page,
        """
        const search = document.getElementById("dimension-search");
        const all = (s) => [...document.querySelectorAll(s)];
        const visible = (s) => all(s).filter((e) => e.offsetParent).length;
        out.before = visible(".dimension");
        search.value = "SPACING led.x1"; search.dispatchEvent(new Event("input"));
        out.found = visible(".dimension"); out.groups = visible(".group");
        out.said = document.getElementById("dimension-count").textContent;
        search.value = ""; search.dispatchEvent(new Event("input"));
        document.querySelector("input[value=open]").click(); out.rules = visible(".rule");
        out.wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
        document.getElementById("by-size").click();
        const dots = [...document.querySelectorAll(".s0")];
        out.fill = getComputedStyle(dots[0]).fill;
        """,
        "--window-size=500,900",
    )  # fmt: skip
    assert out["before"] == 17
    assert out["found"] == 3  # led.x1, led.x10, led.x11
    assert out["groups"] == 1
    assert out["said"] == "3 of 17 dimensions"
    assert out["rules"] == 2
    assert out["wide"] <= 0
    assert out["fill"] == "rgb(68, 56, 160)"
