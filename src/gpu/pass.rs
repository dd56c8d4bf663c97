//! Passes as values: what runs on the device can be looked at before and after it runs.

use super::device::Gpu;
use super::resources::Target;
use super::shaders::Shader;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// What is bound to a shader, in the order of its `@binding` numbers. Clones are the same resource.
#[derive(Clone)]
pub(crate) enum Bind {
    Buffer(wgpu::Buffer),
    View(wgpu::TextureView),
    Sampler(wgpu::Sampler),
}

impl From<&wgpu::Buffer> for Bind {
    fn from(buffer: &wgpu::Buffer) -> Self {
        Self::Buffer(buffer.clone())
    }
}

impl From<&wgpu::TextureView> for Bind {
    fn from(view: &wgpu::TextureView) -> Self {
        Self::View(view.clone())
    }
}

/// A texture to read, with all of its mip levels.
impl From<&Target> for Bind {
    fn from(target: &Target) -> Self {
        Self::View(target.view.clone())
    }
}

impl From<&wgpu::Sampler> for Bind {
    fn from(sampler: &wgpu::Sampler) -> Self {
        Self::Sampler(sampler.clone())
    }
}

/// A list of things to bind.
macro_rules! binds {
    ($($bind:expr),* $(,)?) => { vec![$($crate::gpu::Bind::from($bind)),*] };
}
pub(crate) use binds;

/// One dispatch: a shader, what is bound to it, and the invocations that are wanted.
pub(crate) struct Pass {
    pub(crate) shader: &'static Shader,
    pub(crate) binds: Vec<Bind>,
    pub(crate) size: [u32; 2],
}

impl Pass {
    pub(crate) fn new(shader: &'static Shader, size: [u32; 2], binds: Vec<Bind>) -> Self {
        Self { shader, binds, size }
    }

    /// Workgroups that cover its invocations.
    fn workgroups(&self) -> [u32; 2] {
        let [across, down, _] = self.shader.workgroup;
        [self.size[0].div_ceil(across), self.size[1].div_ceil(down)]
    }
}

/// A pass that ran.
#[derive(Debug, Clone, PartialEq)]
pub struct PassRecord {
    /// The stage that it belongs to.
    pub stage: String,
    /// Name of its shader.
    pub shader: &'static str,
    /// Workgroups across and down.
    pub workgroups: [u32; 2],
    /// Resources bound to it.
    pub binds: usize,
    /// From its submission until the device had finished it.
    pub time: Duration,
}

/// The passes that ran since a recording began.
#[derive(Default)]
pub(crate) struct Recording(Mutex<Option<Vec<PassRecord>>>);

impl Recording {
    fn lock(&self) -> MutexGuard<'_, Option<Vec<PassRecord>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins a recording, or drops the one that is kept.
    pub(crate) fn begin(&self) {
        *self.lock() = Some(Vec::new());
    }

    /// Ends the recording and gives it.
    pub(crate) fn end(&self) -> Vec<PassRecord> {
        self.lock().take().unwrap_or_default()
    }

    pub(super) fn is_kept(&self) -> bool {
        self.lock().is_some()
    }

    pub(super) fn note(&self, stage: &str, pass: &Pass, time: Duration) {
        if let Some(records) = self.lock().as_mut() {
            records.push(PassRecord {
                stage: stage.to_owned(),
                shader: pass.shader.label,
                workgroups: pass.workgroups(),
                binds: pass.binds.len(),
                time,
            });
        }
    }
}

impl Gpu {
    /// Puts one dispatch into a compute pass.
    pub(super) fn dispatch(&self, commands: &mut wgpu::ComputePass<'_>, pass: &Pass) {
        let kernel = self.kernels.get(pass.shader);
        let entries: Vec<_> = (0..)
            .zip(&pass.binds)
            .map(|(binding, bind)| wgpu::BindGroupEntry {
                binding,
                resource: match bind {
                    Bind::Buffer(buffer) => buffer.as_entire_binding(),
                    Bind::View(view) => wgpu::BindingResource::TextureView(view),
                    Bind::Sampler(sampler) => wgpu::BindingResource::Sampler(sampler),
                },
            })
            .collect();
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(pass.shader.label),
            layout: &kernel.layout,
            entries: &entries,
        });
        commands.set_pipeline(&kernel.pipeline);
        commands.set_bind_group(0, &group, &[]);
        let [across, down] = pass.workgroups();
        commands.dispatch_workgroups(across, down, 1);
    }
}
