# Two commands do everything: "make lab" and "make test". Each first sets up
# what it needs in .venv and does nothing when that is already there.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PORT   ?= 8888
# Containers often run as root, which JupyterLab refuses unless it is told.
ROOT   := $(if $(filter 0,$(shell id -u 2>/dev/null)),--allow-root)

.DEFAULT_GOAL := help
.PHONY: help lab test browser check format weights notebooks assignments clean

help:  ## show this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "  make %-11s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

# torch first: pip takes a CPU build where it knows one. Otherwise uv, which
# knows where the CPU builds are kept, installs it.
$(BIN)/.torch: constraints.txt
	@echo "setting up .venv; this takes some minutes, once"
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -q -c constraints.txt torch || \
	  ( echo "pip knows no CPU build of torch; asking uv for one" && \
	    $(BIN)/python -m pip install -q uv && \
	    $(BIN)/uv pip install --python $(BIN)/python --torch-backend cpu -c constraints.txt torch )
	touch $@

$(BIN)/.lab: $(BIN)/.torch pyproject.toml
	$(BIN)/python -m pip install -q -c constraints.txt -e '.[lab]'
	touch $@

$(BIN)/.dev: $(BIN)/.torch pyproject.toml
	$(BIN)/python -m pip install -q -c constraints.txt -e '.[dev]'
	touch $@ $(BIN)/.lab

lab: $(BIN)/.lab  ## set up, then open the notebooks in JupyterLab
	$(BIN)/jupyter lab $(ROOT) --port $(PORT) --ServerApp.root_dir=notebooks \
	  --LabApp.default_url=/lab/tree/00_start_here.ipynb

test: $(BIN)/.dev check  ## set up, then run every check, test and notebook
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile --nbval-lax \
	  --nbval-cell-timeout=120 --nbval-sanitize-with tests/nbval_sanitize.cfg tests notebooks

# Debian's own Chromium where we may install it, otherwise the one that Playwright brings.
browser: $(BIN)/.dev  ## add what the browser tests need, which are skipped without it
	$(BIN)/python -m pip install -q -c constraints.txt -e '.[browser]'
	command -v chromium || command -v chromium-browser || command -v google-chrome || \
	  ( test "$$(id -u)" = 0 && apt-get update -qq && \
	    apt-get install -y -qq --no-install-recommends chromium ) || \
	  $(BIN)/playwright install chromium

check: $(BIN)/.dev  ## lint, format and types only
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(BIN)/.dev  ## let ruff format the code
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

weights: $(BIN)/.lab  ## train the shipped weights anew, on the clips in MOCAPLAB_DATA/cmu
	$(BIN)/python -m data_tools.fit_motion_model "$(MOCAPLAB_DATA)/cmu"
	$(BIN)/mocaplab train "$(MOCAPLAB_DATA)/cmu" -o mocaplab/data/blend.safetensors --seed 0
	$(BIN)/mocaplab train "$(MOCAPLAB_DATA)/cmu" -o mocaplab/data/ebf.safetensors --seed 0 \
	  --network ebf
	$(BIN)/python -m data_tools.gap_models "$(MOCAPLAB_DATA)/cmu" -o mocaplab/data/gaps.safetensors
	$(BIN)/python -m data_tools.gap_models "$(MOCAPLAB_DATA)/cmu" -o mocaplab/data/ebd.safetensors \
	  --model ebd
	$(BIN)/python -m data_tools.stream_model "$(MOCAPLAB_DATA)/cmu" \
	  -o mocaplab/data/stream.safetensors --seed 0
	$(BIN)/python -m data_tools.paper_b_models "$(MOCAPLAB_DATA)/cmu" \
	  -o mocaplab/data/fusion.safetensors --seed 0
	$(BIN)/python -m data_tools.paper_b_models "$(MOCAPLAB_DATA)/cmu" --network plain \
	  -o mocaplab/data/two_sources.safetensors --seed 0
	$(BIN)/python -m data_tools.paper_b_models "$(MOCAPLAB_DATA)/cmu" --network prediction \
	  -o mocaplab/data/prediction.safetensors --seed 0

notebooks: $(BIN)/.dev  ## run the notebooks and store them with their outputs
	$(BIN)/python -m data_tools.draw_cleaning -o notebooks/images/cleaning.png
	$(BIN)/python -m data_tools.draw_bvh_kinematics -o notebooks/images/bvh_kinematics.png
	$(BIN)/python -m data_tools.draw_lab -o notebooks/images/lab.png
	$(BIN)/python -m data_tools.run_notebooks
	$(BIN)/python -m data_tools.course_pictures

assignments: $(BIN)/.dev  ## make the editions of the graded assignments, and try the grading
	$(BIN)/python -m data_tools.assignments
	$(BIN)/python -m data_tools.student_edition notebooks/assignments/build/course

clean:  ## remove .venv and caches
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis
