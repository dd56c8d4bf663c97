//! The device itself: opened, watched for failures, given work and waited for.

use super::adapter::{self, AdapterSummary};
use super::error::GpuError;
use super::pass::{Pass, Recording};
use super::resources::Kernels;
use super::self_test;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long a single wait may take: a hung driver must not hold a thread for ever.
const LONGEST_WAIT: Duration = Duration::from_secs(120);

/// One device and its queue.
pub(crate) struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) summary: AdapterSummary,
    pub(crate) kernels: Kernels,
    pub(crate) repeat: wgpu::Sampler,
    pub(crate) clamp: wgpu::Sampler,
    /// Repeats, and blends mip levels too.
    pub(crate) trilinear: wgpu::Sampler,
    /// For half floats, which every device filters.
    pub(crate) linear: wgpu::Sampler,
    /// The same that repeats across and ends above and below: volumes of the domain.
    pub(crate) around: wgpu::Sampler,
    /// The same that repeats in all directions.
    pub(crate) tiling: wgpu::Sampler,
    /// The passes that ran, while somebody wants to know.
    pub(crate) recording: Recording,
    failure: Arc<Failure>,
}

/// What the device's callbacks noted.
#[derive(Default)]
struct Failure {
    lost: AtomicBool,
    first: Mutex<Option<GpuError>>,
}

impl Failure {
    fn note(&self, error: GpuError) {
        let mut slot = self.first.lock().unwrap_or_else(PoisonError::into_inner);
        slot.get_or_insert(error);
    }
    fn take(&self) -> Option<GpuError> {
        self.first.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("Gpu").field("adapter", &self.summary).finish_non_exhaustive()
    }
}

impl Gpu {
    /// Opens the best adapter (or the one whose name contains `wanted`), compiles and runs every kernel once, and tests
    /// the driver. `filtering` false refuses filtered float textures although the adapter has them, which tests the
    /// path of devices without.
    pub(crate) fn open(wanted: Option<&str>, filtering: bool) -> Result<Self, GpuError> {
        let (adapter, summary) = adapter::choose(wanted)?;
        let filtering = filtering && adapter.features().contains(wgpu::Features::FLOAT32_FILTERABLE);
        let features = if filtering { wgpu::Features::FLOAT32_FILTERABLE } else { wgpu::Features::empty() };
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("skyloom"),
            required_features: features,
            required_limits: wgpu::Limits::default(),
            ..Default::default()
        }))
        .map_err(|e| GpuError::NoAdapter(format!("{} gave no device: {e}", summary.name)))?;

        let failure = Arc::new(Failure::default());
        let noted = Arc::clone(&failure);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let text = error.to_string();
            let no_memory = matches!(error, wgpu::Error::OutOfMemory { .. });
            noted.note(if no_memory { GpuError::OutOfMemory(text) } else { GpuError::Failed(text) });
        }));
        let noted = Arc::clone(&failure);
        device.set_device_lost_callback(move |reason, text| {
            noted.lost.store(true, Ordering::Release);
            noted.note(GpuError::Lost(format!("{reason:?} {text}")));
        });

        let kernels = Kernels::new(&device, filtering);
        let sampler = |label, mode, filtering, levels| {
            let filter = if filtering { wgpu::FilterMode::Linear } else { wgpu::FilterMode::Nearest };
            device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some(label),
                address_mode_u: mode,
                address_mode_v: mode,
                mag_filter: filter,
                min_filter: filter,
                mipmap_filter: levels,
                ..Default::default()
            })
        };
        let volume = |label, upwards| {
            device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some(label),
                address_mode_u: wgpu::AddressMode::Repeat,
                address_mode_v: wgpu::AddressMode::Repeat,
                address_mode_w: upwards,
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            })
        };
        let (one, blended) = (wgpu::MipmapFilterMode::Nearest, wgpu::MipmapFilterMode::Linear);
        let gpu = Self {
            summary,
            kernels,
            repeat: sampler("repeat", wgpu::AddressMode::Repeat, filtering, one),
            trilinear: sampler(
                "trilinear",
                wgpu::AddressMode::Repeat,
                filtering,
                if filtering { blended } else { one },
            ),
            clamp: sampler("clamp", wgpu::AddressMode::ClampToEdge, filtering, one),
            linear: sampler("linear", wgpu::AddressMode::ClampToEdge, true, one),
            around: volume("around", wgpu::AddressMode::ClampToEdge),
            tiling: volume("tiling", wgpu::AddressMode::Repeat),
            recording: Recording::default(),
            failure,
            device,
            queue,
        };
        gpu.check()?;
        self_test::run(&gpu)?;
        Ok(gpu)
    }

    /// Fails if the device was lost or an error was noted since the last check.
    pub(crate) fn check(&self) -> Result<(), GpuError> {
        let first = self.failure.take();
        if first.is_some() {
            // That the device is lost is told when it is asked next: what it refused before that follows from it.
            self.device.poll(wgpu::PollType::Poll).ok();
        }
        if !self.failure.lost.load(Ordering::Acquire) {
            return first.map_or(Ok(()), Err);
        }
        // What went wrong first says why.
        Err(match first {
            Some(error @ GpuError::Lost(_)) => error,
            other => GpuError::Lost(other.map_or_else(String::new, |error| error.to_string())),
        })
    }

    /// Runs passes one after the other and waits for them. While a recording is kept they are submitted one by one, so that
    /// each has a time of its own.
    pub(crate) fn run(&self, label: &str, deadline: Option<Instant>, passes: &[Pass]) -> Result<(), GpuError> {
        if !self.recording.is_kept() {
            return self.submit(label, deadline, passes);
        }
        for pass in passes {
            let start = Instant::now();
            self.submit(label, deadline, std::slice::from_ref(pass))?;
            self.recording.note(label, pass, start.elapsed());
        }
        Ok(())
    }

    fn submit(&self, label: &str, deadline: Option<Instant>, passes: &[Pass]) -> Result<(), GpuError> {
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) });
        let descriptor = wgpu::ComputePassDescriptor { label: Some(label), timestamp_writes: None };
        let mut commands = encoder.begin_compute_pass(&descriptor);
        passes.iter().for_each(|pass| self.dispatch(&mut commands, pass));
        drop(commands);
        self.wait(self.queue.submit([encoder.finish()]), deadline)
    }

    fn wait(&self, submission: wgpu::SubmissionIndex, deadline: Option<Instant>) -> Result<(), GpuError> {
        // What was submitted cannot be recalled: past the deadline it is waited for all the same, so that the device is free
        // for the next job. Only one that takes absurdly long counts as hung.
        let poll = wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(LONGEST_WAIT) };
        match self.device.poll(poll) {
            Ok(_) if deadline.is_some_and(|end| Instant::now() >= end) => self.check().and(Err(GpuError::Late)),
            Ok(_) => self.check(),
            Err(wgpu::PollError::Timeout) => Err(GpuError::Timeout),
            // What kept it from being submitted says more than that it was not.
            Err(error) => self.check().and(Err(GpuError::Failed(error.to_string()))),
        }
    }

    /// Copies the first `count` floats of a buffer to the host.
    pub(crate) fn read(
        &self,
        buffer: &wgpu::Buffer,
        count: usize,
        deadline: Option<Instant>,
    ) -> Result<Vec<f32>, GpuError> {
        let bytes = 4 * count as u64;
        let copy = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("readback"),
            size: bytes,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder =
            self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("readback") });
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, bytes);
        let submission = self.queue.submit([encoder.finish()]);
        let mapped = Arc::new(AtomicBool::new(false));
        let done = Arc::clone(&mapped);
        copy.map_async(wgpu::MapMode::Read, .., move |result| done.store(result.is_ok(), Ordering::Release));
        self.wait(submission, deadline)?;
        if !mapped.load(Ordering::Acquire) {
            return Err(GpuError::Failed("a result could not be mapped".to_owned()));
        }
        let view = copy.get_mapped_range(..).map_err(|e| GpuError::Failed(e.to_string()))?;
        Ok(bytemuck::pod_collect_to_vec(&view[..]))
    }

    /// Copies the first `count` floats of each of some buffers to the host, all at once.
    pub(crate) fn read_each(
        &self,
        buffers: &[wgpu::Buffer],
        count: usize,
        deadline: Option<Instant>,
    ) -> Result<Vec<f32>, GpuError> {
        let (joined, bytes) = (self.storage("joined", count * buffers.len()), 4 * count as u64);
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("joined") });
        for (number, buffer) in buffers.iter().enumerate() {
            encoder.copy_buffer_to_buffer(buffer, 0, &joined, number as u64 * bytes, bytes);
        }
        self.queue.submit([encoder.finish()]);
        self.read(&joined, count * buffers.len(), deadline)
    }
}
