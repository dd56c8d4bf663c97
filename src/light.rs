//! Stage `light`: what sun and sky give to cloud base and ground, and what these give each other.
//!
//! On a square, periodic grid of the domain. The sun's beam is marched through the thickness map; diffuse light between
//! the two planes is gathered by rings on mip levels. The exchange is iterated, each pass scaled so that the energy of
//! the mean balances, until what is left to change is below the tolerance.

mod plan;

use crate::gpu::layout::{Budget, Exchange, Frame};
use crate::gpu::{Bind, Gpu, GpuError, Target, shaders};
use crate::slice::DeviceTables;
use std::time::Instant;

pub(crate) use plan::{GridPlan, grid_plan};

/// Light between cloud base and ground at one moment.
pub(crate) struct Light {
    /// Diffuse light leaving the cloud base downwards: horizontal irradiance, all mip levels.
    pub(crate) down: Target,
    /// Light from the ground arriving at the cloud base: horizontal irradiance.
    pub(crate) upwelling: Target,
}

/// What the exchange works on. Levels above 0 of `up` and `down` are means of the level below.
pub(crate) struct Grid {
    pub(crate) uniform: wgpu::Buffer,
    pub(crate) albedo: Target,
    pub(crate) beam: Target,
    pub(crate) diffuse: Target,
    pub(crate) not_reflected: Target,
    pub(crate) source: Target,
    pub(crate) up: Target,
    pub(crate) arriving: Target,
    pub(crate) budget: wgpu::Buffer,
    pub(crate) down: Target,
    pub(crate) upwelling: Target,
    /// Where the exchange starts: even light. Its balance is that of the mean, so that under an even cloud, and under any
    /// cloud in even light that nothing absorbs, the first pass is already exact.
    pub(crate) even: Target,
    /// Irradiance of the ground after this pass and the one before, by turns.
    pub(crate) irradiance: [Target; 2],
    texels: u32,
}

/// More passes are never made: snow under thick cloud in a wide domain takes about 40.
const MAX_PASSES: u32 = 200;
/// Error that single precision leaves in any case: a finer tolerance would never be reached.
const LEAST_CHANGE: f64 = 2e-6;

impl Grid {
    pub(crate) fn new(gpu: &Gpu, exchange: &Exchange, albedo: Target) -> Self {
        let size = [exchange.texels; 2];
        let levels = exchange.texels.ilog2() + 1;
        let map = |label| gpu.texture(label, size, 4, 1);
        Self {
            uniform: gpu.uniform("exchange", exchange),
            albedo,
            beam: map("beam"),
            diffuse: map("diffuse"),
            not_reflected: map("not_reflected"),
            source: map("source"),
            up: gpu.texture("up", size, 4, levels),
            arriving: map("arriving"),
            budget: gpu.storage("budget", size_of::<Budget>() / 4),
            down: gpu.texture("down", size, 4, levels),
            upwelling: map("upwelling"),
            even: gpu.texture_from("even", size, 4, &vec![1.0; 4 * (exchange.texels * exchange.texels) as usize]),
            irradiance: [map("irradiance"), map("irradiance")],
            texels: exchange.texels,
        }
    }

    /// What shading needs of the grid.
    pub(crate) fn finish(self) -> Light {
        Light { down: self.down, upwelling: self.upwelling }
    }

    fn mips(&self, gpu: &Gpu, pass: &mut wgpu::ComputePass<'_>, target: &Target) {
        for level in 1..target.levels.len() {
            let binds = [Bind::View(&target.levels[level - 1]), Bind::View(&target.levels[level])];
            gpu.dispatch(pass, &shaders::DOWNSAMPLE, &binds, target.level_size(level));
        }
    }

    /// Light before any of it has met the ground, and the irradiance that it gives.
    pub(crate) fn start(
        &self,
        gpu: &Gpu,
        frame: &wgpu::Buffer,
        thickness: &Target,
        tables: &DeviceTables,
        deadline: Option<Instant>,
    ) -> Result<(), GpuError> {
        gpu.run("base_light", deadline, |pass| {
            let binds = [
                Bind::Buffer(frame),
                Bind::Buffer(&self.uniform),
                Bind::View(&thickness.view),
                Bind::View(&tables.transmittance.view),
                Bind::View(&tables.diffuse.view),
                Bind::Sampler(&gpu.repeat),
                Bind::Sampler(&gpu.clamp),
                Bind::View(&self.beam.levels[0]),
                Bind::View(&self.diffuse.levels[0]),
                Bind::View(&self.not_reflected.levels[0]),
            ];
            gpu.dispatch(pass, &shaders::BASE_LIGHT, &binds, [self.texels; 2]);
            // A budget of zeros: nothing has come back from the ground yet.
            self.send_down(gpu, pass, &self.source);
        })
    }

    /// What leaves the base, and the irradiance of the ground that it gives together with the beam.
    fn send_down(&self, gpu: &Gpu, pass: &mut wgpu::ComputePass<'_>, irradiance: &Target) {
        let size = [self.texels; 2];
        let binds = [
            Bind::Buffer(&self.budget),
            Bind::View(&self.diffuse.view),
            Bind::View(&self.not_reflected.view),
            Bind::View(&self.arriving.view),
            Bind::View(&self.down.levels[0]),
            Bind::View(&self.upwelling.levels[0]),
        ];
        gpu.dispatch(pass, &shaders::EXCHANGE_DOWN, &binds, size);
        self.mips(gpu, pass, &self.down);
        let binds = [
            Bind::Buffer(&self.uniform),
            Bind::View(&self.beam.view),
            Bind::View(&self.down.view),
            Bind::Sampler(&gpu.repeat),
            Bind::View(&irradiance.levels[0]),
        ];
        gpu.dispatch(pass, &shaders::EXCHANGE_RETURN, &binds, size);
    }

    /// One pass ground - cloud - ground, from the irradiance `now`; `before` is the one it came from.
    pub(crate) fn pass(
        &self,
        gpu: &Gpu,
        now: &Target,
        before: &Target,
        next: &Target,
        deadline: Option<Instant>,
    ) -> Result<Budget, GpuError> {
        let size = [self.texels; 2];
        gpu.run("exchange", deadline, |pass| {
            let binds = [Bind::View(&self.albedo.view), Bind::View(&now.view), Bind::View(&self.up.levels[0])];
            gpu.dispatch(pass, &shaders::EXCHANGE_EMIT, &binds, size);
            self.mips(gpu, pass, &self.up);
            let binds = [
                Bind::Buffer(&self.uniform),
                Bind::View(&self.up.view),
                Bind::Sampler(&gpu.repeat),
                Bind::View(&self.arriving.levels[0]),
            ];
            gpu.dispatch(pass, &shaders::EXCHANGE_REFLECT, &binds, size);
            let binds = [
                Bind::View(&self.source.view),
                Bind::View(&now.view),
                Bind::View(&before.view),
                Bind::View(&self.albedo.view),
                Bind::View(&self.arriving.view),
                Bind::View(&self.not_reflected.view),
                Bind::Buffer(&self.budget),
            ];
            gpu.dispatch(pass, &shaders::EXCHANGE_BUDGET, &binds, [1, 1]);
            self.send_down(gpu, pass, next);
        })?;
        let numbers = gpu.read(&self.budget, size_of::<Budget>() / 4, deadline)?;
        Ok(*bytemuck::from_bytes(bytemuck::cast_slice(&numbers)))
    }

    /// Passes until what is left to change is below `settled`, relative. Returns how many were made.
    pub(crate) fn exchange(&self, gpu: &Gpu, settled: f64, deadline: Option<Instant>) -> Result<u32, GpuError> {
        let wanted = settled.max(LEAST_CHANGE);
        let mut last_change: Option<f64> = None;
        for done in 0..MAX_PASSES {
            let (now, before, next) = match done {
                0 => (&self.even, &self.even, &self.irradiance[0]),
                1 => (&self.irradiance[0], &self.even, &self.irradiance[1]),
                _ => {
                    let (now, next) = ((done as usize + 1) % 2, done as usize % 2);
                    // Two textures by turns: the next irradiance overwrites the one before, which was read by then.
                    (&self.irradiance[now], &self.irradiance[next], &self.irradiance[next])
                }
            };
            let budget = self.pass(gpu, now, before, next, deadline)?;
            if done == 0 {
                continue;
            }
            let change: f64 = budget.change[..3].iter().copied().fold(0.0, f32::max).into();
            // Changes shrink by a steady factor, so what is left is a geometric sum.
            let ratio: f64 = last_change.map_or(0.9, |last| (change / last).clamp(0.0, 0.99));
            let left = change * ratio / (1.0 - ratio);
            if change <= LEAST_CHANGE || left <= wanted {
                return Ok(done + 1);
            }
            last_change = Some(change);
        }
        tracing::warn!(passes = MAX_PASSES, "light between cloud and ground did not settle within the tolerance");
        Ok(MAX_PASSES)
    }
}

/// Computes the light of a moment. `albedo`: of the ground, on the exchange grid; `dark_ground`: it is 0 everywhere, so
/// there is nothing to exchange.
pub(crate) struct LightInputs<'a> {
    pub(crate) frame: &'a Frame,
    pub(crate) frame_uniform: &'a wgpu::Buffer,
    pub(crate) thickness: &'a Target,
    pub(crate) tables: &'a DeviceTables,
    pub(crate) plan: &'a GridPlan,
    pub(crate) albedo: Target,
    pub(crate) dark_ground: bool,
    /// Relative change at which the exchange is taken as settled.
    pub(crate) settled: f64,
}

/// Runs the stage.
pub(crate) fn light(gpu: &Gpu, inputs: LightInputs<'_>, deadline: Option<Instant>) -> Result<Light, GpuError> {
    let exchange = inputs.plan.exchange(inputs.frame);
    let grid = Grid::new(gpu, &exchange, inputs.albedo);
    grid.start(gpu, inputs.frame_uniform, inputs.thickness, inputs.tables, deadline)?;
    if !inputs.dark_ground {
        let passes = grid.exchange(gpu, inputs.settled, deadline)?;
        tracing::debug!(passes, texels = exchange.texels, "light between cloud and ground");
    }
    Ok(grid.finish())
}
