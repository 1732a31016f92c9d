# Two commands: `make variant` builds a finger, `make test` tests the project.
PYTHON ?= python3
SPEC ?= designs/gelslim2.yaml
OUT ?= out/$(basename $(notdir $(SPEC)))
VENV := .venv
BIN := $(VENV)/bin
PINS := requirements/constraints.txt

export OMP_NUM_THREADS ?= 1

.PHONY: variant test test-cores test-slow mutants site lint stability designs bench docs pins clean

variant: $(VENV)/.installed
	$(BIN)/gelslim build "$(SPEC)" -o "$(OUT)"

test: lint $(VENV)/.installed-dev
	$(BIN)/pytest -n 2 --dist loadfile

# Tests that another processor's last bits could turn: contact solvers and active sets, fits,
# factors and operators, ray traces, searches and iterations that stop by a residual. Two and a
# half minutes of one core; the rest of the suite is left to `make test`.
CORE_NAMES := contact_inverse convolved_operator finite_strain solver_hard surface_operator \
	contact_balance contact_incompressible contact_ladder contact_limits contact_relief \
	contact_rungs contact_solver contact_walls calibration_fit contact_forces \
	crowned_sensor force_estimator lattice_registration low_pass back_projection \
	lens_distortion tir_certificate trace_balance fold_solver adjoint_fields
CORE_TESTS = $(foreach name,$(CORE_NAMES),$(or $(shell find tests -name "test_$(name).py"),\
	$(error no test file is called test_$(name).py)))

# OpenBLAS' kernels for an older processor, and loops compiled for a plain one: no AVX, no fused
# multiply-add. Where OpenBLAS does not have that processor it keeps its own kernels.
test-cores: $(VENV)/.installed-dev
	OPENBLAS_CORETYPE=Sandybridge NUMBA_CPU_NAME=generic \
	  NUMBA_CACHE_DIR="$(CURDIR)/build/numba-generic" \
	  $(BIN)/pytest -n 2 --dist loadfile $(CORE_TESTS)

test-slow: $(VENV)/.installed-dev
	$(BIN)/pytest -n 2 --dist worksteal -m slow

mutants: $(VENV)/.installed-mutants
	$(BIN)/python tools/mutants.py

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

stability: $(VENV)/.installed-dev
	$(BIN)/python -m tests.stability.run --count 300

bench: $(VENV)/.installed-peers
	$(BIN)/python -m bench.run_all

bench-quick: $(VENV)/.installed-dev
	$(BIN)/python -m bench.run_all --quick

docs: $(VENV)/.installed-dev
	$(BIN)/gelslim schema -o docs/gelslim-spec-1.schema.json
	$(BIN)/gelslim schema --scene -o docs/gelslim-scene-1.schema.json
	$(BIN)/gelslim schema --sensor -o docs/gelslim-sensor-1.schema.json
	$(BIN)/gelslim schema --markdown -o docs/spec_reference.md
	$(BIN)/gelslim schema --scene --markdown -o docs/scene_reference.md
	$(BIN)/gelslim schema --sensor --markdown -o docs/sensor_reference.md
	$(BIN)/python -m bench.accuracy_page
	$(BIN)/python tools/sensitivities.py
	$(BIN)/python -m bench.page_blocks
	$(BIN)/python tools/gallery.py
	$(MAKE) site

site: $(VENV)/.installed-docs
	$(BIN)/python tools/api_pages.py docs/api
	$(BIN)/sphinx-build -q -b html docs out/site

designs: $(VENV)/.installed
	for spec in designs/*.yaml; do $(BIN)/gelslim build "$$spec" -o "out/$$(basename "$$spec" .yaml)" || exit $$?; done

$(VENV)/.installed: pyproject.toml $(PINS)
	PYTHON="$(PYTHON)" sh tools/install.sh "cad,view,vision"
	touch $@

$(VENV)/.installed-dev: pyproject.toml $(PINS)
	PYTHON="$(PYTHON)" sh tools/install.sh "cad,view,vision,record,cluster,dev"
	touch $@ $(VENV)/.installed

$(VENV)/.installed-mutants: pyproject.toml $(PINS)
	PYTHON="$(PYTHON)" sh tools/install.sh "cad,view,vision,record,cluster,dev,mutants"
	touch $@ $(VENV)/.installed-dev $(VENV)/.installed

$(VENV)/.installed-docs: pyproject.toml $(PINS)
	PYTHON="$(PYTHON)" sh tools/install.sh "cad,view,vision,record,cluster,dev,docs"
	touch $@ $(VENV)/.installed-dev $(VENV)/.installed

$(VENV)/.installed-peers: pyproject.toml $(PINS)
	PYTHON="$(PYTHON)" sh tools/install.sh "cad,view,vision,record,cluster,dev,peers"
	touch $@ $(VENV)/.installed-dev $(VENV)/.installed

# Adds what is missing and drops what nothing needs; `make pins RENEW=1` takes the newest versions.
pins:
	$(PYTHON) tools/pins.py $(if $(RENEW),--renew)

clean:
	rm -rf $(VENV) out build *.egg-info
