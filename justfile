# What CI and CONTRIBUTING.md name. `just` lists the recipes.

_default:
    @just --list

# Builds the program as it is released.
build:
    cargo build --release

# Runs all tests. One that lacks something outside the repository says so, see CONTRIBUTING.md.
test *arguments:
    cargo test --release --workspace {{arguments}}

# Formats the code.
format:
    cargo fmt --all

# Checks everything that a change must pass.
check:
    bash .ci/run

# Checks the lints. Their settings lie in .ci/clippy.toml.
lint:
    CLIPPY_CONF_DIR={{justfile_directory()}}/.ci cargo clippy --release --workspace --all-targets -- -D warnings

# Checks the spelling. Needs `typos` (`pip install typos`).
spell:
    typos

# Writes docs/reference/scenario.md and docs/evidence/determinism.json from the code.
references:
    cargo run --release -p closecall-xtask -- write-references

# Writes the results that the documentation shows, in the sizes for a night (hours).
evidence: references build
    cargo run --release -p closecall-xtask -- write-evidence

# The same in the sizes for minutes (half an hour).
evidence-quick: references build
    cargo run --release -p closecall-xtask -- write-evidence -n 500 --member-samples 50

# Draws the pictures of docs/how-to/looking again, in the real viewer. Needs `pip install rerun-sdk==0.36.3 pillow`.
pictures *names: build
    python3 .ci/pictures.py {{names}}

# Measures the peak memory of each mode.
memory: build
    cargo run --release -p closecall-xtask -- validate-memory modes

# Measures the speed of each mode.
speed:
    cargo run --release -p closecall-xtask -- throughput

# Builds the book in target/book. Needs mdBook (`cargo install mdbook`).
book:
    mdbook build docs

# `xtask` depends on the whole program, so its dependencies have the features of `cargo build --release` and are not built again.

# Runs a task of the repository: `just xtask --help` lists them.
[positional-arguments]
xtask *arguments:
    cargo run --release -p closecall-xtask -- "$@"

# Runs a benchmark: camera, lidar or recording.
[positional-arguments]
bench *arguments:
    cargo bench -p closecall-xtask --bench "$@"
