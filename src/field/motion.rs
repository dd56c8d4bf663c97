//! Displacement of a field by its eddies, on the device: two layers, each carried along from its birth, half a life apart.
//!
//! Advecting a field itself loses its small scales in minutes; a displacement is smooth, loses nothing, and is replayed
//! from its birth for any time at the same cost. What was computed last stays on the device as a checkpoint: the next
//! frame takes only the steps in between, and gets the same bits, because every step is the same sequence of operations.

use super::clock::{self, Clock, Instant};
use super::eddies::{BANDS, Eddies, GRID};
use crate::gpu::layout::Step;
use crate::gpu::{Gpu, GpuError, Pass, Target, binds, shaders};

/// The eddies of a field, and how far they have been followed.
pub(crate) struct Motion {
    pub(crate) eddies: Eddies,
    pub(crate) clock: Clock,
    pub(crate) bands: [Target; BANDS],
    pub(crate) velocity: Target,
    /// The displacement before the step that [`Motion::followed`] names, and room for the one after it.
    states: [Target; 2],
    followed: Option<i64>,
    /// The displacement at the moment asked for last.
    pub(crate) displacement: Target,
    /// Domains that the root mean square of speed covers in a second.
    speed_per_s: f64,
}

/// Displacement at a moment.
pub(crate) struct Displaced {
    /// Weights of its two layers.
    pub(crate) weights: [f64; 2],
    /// Steps that were taken for it, besides the last part of one.
    pub(crate) steps: u32,
    /// The last, partial step, for tests.
    pub(crate) last: Step,
}

impl Motion {
    /// Eddies of a root mean square speed above 0.
    pub(crate) fn new(gpu: &Gpu, seed: u32, speed_m_s: f64, extent_m: f64) -> Self {
        let eddies = Eddies::new(seed);
        let speed_per_s = speed_m_s / extent_m;
        let size = [GRID; 2];
        let map = |label| gpu.texture(label, size, 4, 1);
        Self {
            clock: Clock::new(eddies.gradient * speed_per_s),
            bands: eddies.bands.each_ref().map(|texels| gpu.texture_from("eddies", size, 4, texels)),
            eddies,
            velocity: map("velocity"),
            states: [map("displacement"), map("displacement")],
            followed: None,
            displacement: map("displacement"),
            speed_per_s,
        }
    }

    /// Bytes on the device.
    pub(crate) fn size(&self) -> u64 {
        let maps = self.bands.iter().chain(&self.states).chain([&self.velocity, &self.displacement]);
        maps.map(Target::size).sum()
    }

    /// Spread of the difference of the two layers' displacements on one axis, domains: nearly the same at all times.
    pub(crate) fn spread(&self) -> f64 {
        SPREAD_PER_WAY * self.speed_per_s * self.clock.life_s
    }

    /// Way of the eddies by a time at the root mean square of their speed, domains.
    pub(crate) fn way(&self, time_s: f64) -> f64 {
        self.speed_per_s * time_s
    }

    /// The displacement before the next step, as it lies on the device.
    pub(crate) fn state(&self) -> &Target {
        &self.states[0]
    }

    /// Brings [`Motion::displacement`] to a time.
    pub(crate) fn follow(
        &mut self,
        gpu: &Gpu,
        time_s: f64,
        deadline: Option<std::time::Instant>,
    ) -> Result<Displaced, GpuError> {
        let Instant { step, part, weights } = self.clock.at(time_s);
        let first = clock::first_step(step);
        let from = self.followed.filter(|followed| (first..=step).contains(followed)).unwrap_or(first);
        // Lost if something fails on the way: the next call replays.
        self.followed = None;
        let steps = (step - from) as u32;
        let last = self.length(step, part);
        let mut passes = Vec::new();
        for number in from..step {
            let [before, after] = &self.states;
            passes.extend(self.advance(gpu, number, 1.0, before, after));
            self.states.swap(0, 1);
        }
        passes.extend(self.advance(gpu, step, part, &self.states[0], &self.displacement));
        gpu.run("displacement", deadline, &passes)?;
        self.followed = Some(step);
        Ok(Displaced { weights, steps, last })
    }

    fn length(&self, step: i64, part: f64) -> Step {
        let [first, second] = clock::born(step).map(|born| if born { 0.0 } else { 1.0 });
        let length_uv = (part * self.clock.step_s() * self.speed_per_s) as f32;
        Step { keep: [first, first, second, second], length_uv, ..Step::default() }
    }

    /// Phases of the eddies in the middle of a step or part of it.
    pub(crate) fn phases(&self, step: i64, part: f64) -> crate::gpu::layout::Eddies {
        self.eddies.phases((step as f64 + 0.5 * part) * self.clock.step_s() * self.speed_per_s)
    }

    fn advance(&self, gpu: &Gpu, step: i64, part: f64, before: &Target, after: &Target) -> [Pass; 2] {
        let phases = gpu.uniform("phases", &self.phases(step, part));
        let [a, b, c, d] = &self.bands;
        let velocity = binds![&phases, a, b, c, d, &self.velocity.levels[0]];
        let length = gpu.uniform("step", &self.length(step, part));
        let displace = binds![&length, &self.velocity, before, &after.levels[0]];
        [
            Pass::new(&shaders::FIELD_VELOCITY, [GRID; 2], velocity),
            Pass::new(&shaders::FIELD_DISPLACE, [GRID; 2], displace),
        ]
    }
}

/// See [`Motion::spread`]: per axis and per way at the root mean square of speed in a life; mean over seeds and phases.
const SPREAD_PER_WAY: f64 = 0.316;
