# Two commands: `make variant` builds a finger, `make test` tests the project.
PYTHON ?= python3
SPEC ?= designs/gelslim2.yaml
OUT ?= out/$(basename $(notdir $(SPEC)))
VENV := .venv
BIN := $(VENV)/bin
PINS := requirements/constraints.txt

export OMP_NUM_THREADS ?= 1

.PHONY: variant test test-slow site lint stability designs bench docs pins clean

variant: $(VENV)/.installed
	$(BIN)/gelslim build "$(SPEC)" -o "$(OUT)"

test: lint $(VENV)/.installed-dev
	$(BIN)/pytest -n 2 --dist loadfile

test-slow: $(VENV)/.installed-dev
	$(BIN)/pytest -n 2 --dist loadfile -m slow

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

stability: $(VENV)/.installed-dev
	$(BIN)/python -m tests.stability.run --count 300

bench: $(VENV)/.installed-peers
	$(BIN)/python bench/run_all.py

bench-quick: $(VENV)/.installed-dev
	$(BIN)/python bench/run_all.py --quick

docs: $(VENV)/.installed-dev
	$(BIN)/gelslim schema -o docs/gelslim-spec-1.schema.json
	$(BIN)/gelslim schema --scene -o docs/gelslim-scene-1.schema.json
	$(BIN)/gelslim schema --markdown -o docs/spec_reference.md
	$(BIN)/gelslim schema --scene --markdown -o docs/scene_reference.md
	$(BIN)/python bench/accuracy_page.py
	$(BIN)/python tools/sensitivities.py
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

$(VENV)/.installed-docs: pyproject.toml $(PINS)
	PYTHON="$(PYTHON)" sh tools/install.sh "cad,view,vision,record,cluster,dev,docs"
	touch $@ $(VENV)/.installed-dev $(VENV)/.installed

$(VENV)/.installed-peers: pyproject.toml $(PINS)
	PYTHON="$(PYTHON)" sh tools/install.sh "cad,view,vision,record,cluster,dev,peers"
	touch $@ $(VENV)/.installed-dev $(VENV)/.installed

pins: $(VENV)/.installed-dev
	( echo "# Pinned versions for make variant, make test and CI. Renew with: make pins"; \
	  $(BIN)/pip freeze --exclude-editable | grep -vE '^(pip|setuptools|wheel)==' ) > $(PINS).new
	mv $(PINS).new $(PINS)

clean:
	rm -rf $(VENV) out build *.egg-info
