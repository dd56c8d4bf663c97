# Two commands do everything on a fresh machine: `make run` and `make test`.
CARGO ?= cargo
# The Mesa layer that picks a default device asks for a desktop and complains on a server; skyloom picks its own.
export NODEVICE_SELECT = 1
# Property tests draw the same cases every time; set another seed to search further.
export PROPTEST_RNG_SEED ?= 20060101
LISTEN ?= 127.0.0.1:8080
# One profile for running, testing and measuring: dependencies are compiled once.
FLAGS := --release --locked

.PHONY: help run test attack load halves rates replicas ktx2 examples deploy-check fuzz driver fmt bench bench-baseline pictures charts figures audit

help:
	@echo "make run       start the server with its viewer on http://$(LISTEN) (LISTEN=ADDR:PORT for another place)"
	@echo "make test      format check, lints as errors, every test"
	@echo "make attack    call everything that docs/openapi.json has, thousands of times (with schemathesis too, which is installed for it); kill servers fifty times"
	@echo "make load      64 clients for a minute, and for another one beside large textures and new droplets; then crowds that wait for nothing (five minutes)"
	@echo "make halves    small renders a second of a server with all cores beside two with half of them each, on a software device (Linux; ten minutes of an idle machine)"
	@echo "make rates     cached replies a second beside nginx's for the same files (installs nginx and wrk; two minutes of an idle machine)"
	@echo "make replicas  three servers on an S3 bucket behind nginx, one of them killed (installs nginx, builds an S3 server; some minutes)"
	@echo "make ktx2      textures of KTX2 through Khronos' own reader and validator (builds them; a minute)"
	@echo "make examples  the examples and the viewer, in Chromium, Blender and Python, as far as they are installed; says what was not run"
	@echo "make deploy-check  the files of deploy through docker-compose, nginx and systemd, without running them (installs them)"
	@echo "make fuzz      a million broken scenes, 100,000 images, queries, settings and jobs (some minutes)"
	@echo "make bench     time of each stage, per texel, and how it stands to the committed baseline"
	@echo "make bench-baseline  the same, written as the new baseline (docs/benches)"
	@echo "make pictures  draw the pictures of README.md anew (docs/pictures)"
	@echo "make charts    measure every method and draw the charts anew (docs/charts; some minutes)"
	@echo "make figures   draw the figures of docs/method.md anew (docs/figures; needs Python 3)"
	@echo "make audit     documentation, least Rust version, licences and known faults of the dependencies"
	@echo "make fmt       format the code"

# Finds a Vulkan driver, or installs the distribution's software one.
driver:
	@.ci/driver

run: driver
	$(CARGO) build $(FLAGS)
	target/release/skyloom serve --listen $(LISTEN)

test:
	@.ci/driver --required
	$(CARGO) fmt --all --check
	$(CARGO) clippy $(FLAGS) --workspace --all-targets -- -D warnings
	@CARGO="$(CARGO)" .ci/test

attack: driver
	SKYLOOM_ATTACK_CALLS=20000 $(CARGO) test $(FLAGS) --workspace --test api -- attack:: --nocapture
	$(CARGO) build $(FLAGS)
	@.ci/attack target/release/skyloom
	SKYLOOM_KILLS=50 $(CARGO) test $(FLAGS) --workspace --test api -- kill --nocapture

load: driver
	SKYLOOM_LOAD_S=60 $(CARGO) test $(FLAGS) --workspace --test api -- load:: --nocapture
	SKYLOOM_LOAD_S=60 $(CARGO) test $(FLAGS) --workspace --test api -- crowds:: --nocapture --test-threads 1

halves: driver
	$(CARGO) build $(FLAGS)
	@.ci/halves target/release/skyloom

rates: driver
	$(CARGO) build $(FLAGS)
	@.ci/rates target/release/skyloom

replicas:
	@.ci/driver --required
	@CARGO="$(CARGO)" .ci/replicas

ktx2: driver
	$(CARGO) build $(FLAGS)
	@CARGO="$(CARGO)" .ci/ktx2 target/release/skyloom

examples: driver
	$(CARGO) build $(FLAGS)
	@.ci/examples target/release/skyloom

deploy-check: driver
	$(CARGO) build $(FLAGS)
	@.ci/deploy target/release/skyloom

fuzz:
	SKYLOOM_FUZZ_CASES=1000000 $(CARGO) test $(FLAGS) --workspace --test fuzz -- --nocapture

bench: driver
	@CARGO="$(CARGO)" .ci/bench

bench-baseline: driver
	@CARGO="$(CARGO)" .ci/bench --baseline

pictures: driver
	$(CARGO) build $(FLAGS)
	docs/pictures/draw target/release/skyloom

charts: driver
	$(CARGO) build $(FLAGS)
	target/release/skyloom chart

figures:
	docs/figures/draw.py

audit:
	@CARGO="$(CARGO)" .ci/audit

fmt:
	$(CARGO) fmt --all
