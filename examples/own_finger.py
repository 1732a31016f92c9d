# %% [markdown]
# # A finger of my own
#
# A spec is a YAML file. Everything else follows from it: dimensions, design rules, parts. This page
# changes one finger and looks at what the change does; nothing is written but one spec.

# %%
from pathlib import Path
from tempfile import mkdtemp

import gelslim
from gelslim.examples import example

folder = Path(mkdtemp())
text = example("mini20").files("mine")["mine.yaml"]
spec_file = folder / "mine.yaml"
spec_file.write_text(text, encoding="utf-8")

# %% [markdown]
# The dependent dimensions, by name:

# %%
before = gelslim.derive(spec_file)
print(f"thickness {before['finger.thickness_mm']:.2f} mm")

# %% [markdown]
# A shorter gel makes a thinner finger. A spec is frozen, so a change is a new spec:

# %%
spec = gelslim.read_spec(spec_file).spec
gel = spec.design.gel.model_copy(update={"length_mm": 18.0})
shorter = spec.model_copy(update={"design": spec.design.model_copy(update={"gel": gel})})
after = gelslim.derive(shorter)
print(f"thickness {after['finger.thickness_mm']:.2f} mm with a gel of 18 mm")

# %% [markdown]
# The design rules say whether it can be built, with value, limit and margin:

# %%
checks = gelslim.check(shorter)
for rule in sorted(checks, key=lambda rule: rule.status)[:5]:
    print(rule.status, rule.id, rule.value, rule.unit)
assert all(rule.status != "fail" for rule in checks)

# %% [markdown]
# `gelslim.build(spec_file)` writes all files of the finger, as `gelslim build` does: parts as STEP and
# STL, the marker print, the mould, the report. It takes about 30 s and needs the extra `cad`.
