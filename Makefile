# Two commands set everything up: `make render` and `make test`.
PYTHON ?= python3.11
BIN := .venv/bin
STAGE := tests/scenes/cornell_box/cornell-box.usda

.PHONY: install render test test-rust test-python check lint bench clean

$(BIN)/python:
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade pip 'maturin>=1.16,<2'

# Builds the engine and installs the `kilauea` command into .venv.
install: $(BIN)/python
	cd usd_bridge && ../$(BIN)/maturin develop --quiet --release --extras dev

render: install
	@mkdir -p out
	$(BIN)/kilauea render $(STAGE) -o out/cornell.exr,out/cornell.png -r 512 512 -p 64

test: test-rust test-python

test-rust:
	cargo test --quiet

test-python: install
	cd usd_bridge && ../$(BIN)/python -m pytest --quiet
	$(BIN)/python -m pytest --quiet -c usd_bridge/pyproject.toml --rootdir . pipeline/tests

# Everything that CI runs.
check: lint test

lint: install
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --quiet -- -D warnings
	cd usd_bridge && ../$(BIN)/ruff check . ../pipeline && ../$(BIN)/ruff format --check . ../pipeline
	cd usd_bridge && ../$(BIN)/pyright

bench: install
	@mkdir -p out
	$(BIN)/kilauea bench samples tests/scenes/box_rect_light.usda -r 256 256 -p 64 --json out/samples.json

clean:
	rm -rf target .venv out
