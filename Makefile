# Two commands set everything up: `make render` and `make test`.
PYTHON ?= python3.11
BIN := .venv/bin
PYTEST_CORES := --numprocesses auto --dist loadfile
STAGE := tests/scenes/cornell_box/cornell-box.usda

.PHONY: install render describe references test test-rust test-loom test-python test-ray check lint bench ledger clean

$(BIN)/python:
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade pip 'maturin>=1.16,<2'

# Builds the engine and installs the `kilauea` command into .venv.
install: $(BIN)/python
	cd usd_bridge && ../$(BIN)/maturin develop --quiet --release --extras dev

render: install
	@mkdir -p out
	$(BIN)/kilauea render $(STAGE) -o out/cornell.exr,out/cornell.png -r 512 512 -p 64

# Writes what is generated from the shaders' declarations; a test fails where it is stale.
describe:
	cargo run --quiet -p shaders --example describe

# What the tests of `kilauea check` compare with, by Cycles: some minutes on all cores.
references: install
	$(BIN)/kilauea check tests/scenes/box_rect_light.usda -r 48 48 -p 8192 --write-reference tests/references/box_rect_light.exr
	$(BIN)/kilauea check tests/scenes/focused_disk.usda -r 48 48 -p 2048 --write-reference tests/references/focused_disk.exr
	$(BIN)/kilauea check tests/scenes/shader_balls.usda -r 72 36 -p 2048 --write-reference tests/references/shader_balls.exr

test: test-rust test-loom test-python

test-rust:
	cargo test --quiet

# Interleavings of what crosses between engine threads. Builds loom apart, once, and without
# optimising what it depends on, which would take longer than the test.
test-loom:
	RUSTFLAGS="--cfg loom" cargo test --quiet -p kilauea-spot --lib --target-dir target/loom \
		--config 'profile.dev.package."*".opt-level=0' --config 'profile.dev.package.loom.opt-level=2' \
		interleavings

# On all cores, a file of tests on one, so that what a file shares is made once.
test-python: install
	cd usd_bridge && ../$(BIN)/python -m pytest --quiet $(PYTEST_CORES)
	$(BIN)/python -m pytest --quiet $(PYTEST_CORES) -c usd_bridge/pyproject.toml --rootdir . pipeline/tests

# On a Ray cluster of three nodes on this machine. Installs Ray, which takes 0.5 GB.
test-ray: install
	$(BIN)/python -m pip install --quiet 'ray>=2.60,<2.70'
	cd usd_bridge && ../$(BIN)/python -m pytest --quiet -W default ray_tests

# Everything that CI runs.
check: lint test test-ray

lint: install
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --quiet -- -D warnings
	cd usd_bridge && ../$(BIN)/ruff check . ../pipeline ../shaders && ../$(BIN)/ruff format --check . ../pipeline ../shaders
	cd usd_bridge && ../$(BIN)/pyright

bench: install
	@mkdir -p out
	$(BIN)/kilauea bench samples tests/scenes/box_rect_light.usda -r 256 256 -p 64 --json out/samples.json

# Measures everything in docs/benchmarks.md again and rewrites the page. Takes hours; KILAUEA_ASSETS
# is the folder of the stages that are not ours.
LEDGER_STAGES := tests/scenes/box_rect_light.usda out/many_lights.usda $(addprefix $(KILAUEA_ASSETS)/, \
	02_kitchen/kitchen_day.usda 02_kitchen/kitchen_night.usda 03_window/window.usdc \
	04_mcusd/McUsd.usda 05_chess/chess_outdoor.usda 07_bmw27/bmw27_studio.usda \
	15_townhouse/townhouse.usda 16_caustic/caustic_dice.usdc)

ledger: install
	@mkdir -p out
	$(BIN)/python pipeline/many_lights.py out/many_lights.usda
	$(BIN)/kilauea bench error $(LEDGER_STAGES) -w 512 --json docs/ledger/error.json --pictures out/strips
	$(BIN)/kilauea bench samples $(LEDGER_STAGES) -r 320 180 -p 16 --json docs/ledger/samples.json
	$(BIN)/kilauea bench load $(KILAUEA_ASSETS)/07_bmw27/cars32_unique.usda --json docs/ledger/load.json
	$(BIN)/kilauea bench rays --json docs/ledger/rays.json
	$(BIN)/kilauea bench ledger

clean:
	rm -rf target .venv out
