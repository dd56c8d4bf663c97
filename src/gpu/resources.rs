//! Kernels (compiled entry points) and the textures and buffers they work on.

use super::device::Gpu;
use super::error::GpuError;
use super::shaders::{self, Shader};
use half::f16;
use std::collections::HashMap;
use std::sync::OnceLock;
use std::time::Instant;

/// A host table: rows of texels of 1, 2 or 4 channels.
#[derive(Debug, Clone, PartialEq)]
pub struct HostMap {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Floats in a texel.
    pub channels: u32,
    /// The texels, row 0 first.
    pub data: Vec<f32>,
}

/// A compiled entry point.
pub(crate) struct Kernel {
    pub(super) pipeline: wgpu::ComputePipeline,
    pub(super) layout: wgpu::BindGroupLayout,
}

/// Every kernel, by the name of its shader.
pub(crate) struct Kernels {
    device: wgpu::Device,
    filtering: bool,
    all: HashMap<&'static str, Kernel>,
    /// Those of [`shaders::GROWING`] and [`shaders::PLAIN`], compiled when the first scene wants them: few do.
    special: HashMap<&'static str, OnceLock<Kernel>>,
}

impl Kernels {
    pub(super) fn new(device: &wgpu::Device, filtering: bool) -> Self {
        let special = shaders::GROWING.iter().chain(shaders::PLAIN);
        let special = special.map(|shader| (shader.label, OnceLock::new())).collect();
        let all = shaders::ALL.iter().map(|shader| (shader.label, Kernel::new(device, filtering, shader))).collect();
        Self { device: device.clone(), filtering, all, special }
    }

    /// The kernel of a shader. Every shader of [`shaders::ALL`], [`shaders::GROWING`] and [`shaders::PLAIN`] has one.
    pub(crate) fn get(&self, shader: &Shader) -> &Kernel {
        match self.special.get(shader.label) {
            Some(kernel) => kernel.get_or_init(|| Kernel::new(&self.device, self.filtering, shader)),
            None => &self.all[shader.label],
        }
    }
}

impl Kernel {
    fn new(device: &wgpu::Device, filtering: bool, shader: &Shader) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(shader.label),
            source: wgpu::ShaderSource::Wgsl(shader.source(filtering).into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(shader.label),
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        });
        let layout = pipeline.get_bind_group_layout(0);
        Self { pipeline, layout }
    }
}

/// A 2-D texture of floats or halves with its views. Clones are the same texture.
#[derive(Clone)]
pub(crate) struct Target {
    texture: wgpu::Texture,
    /// All mip levels, for sampling.
    pub(crate) view: wgpu::TextureView,
    /// One level each, for writing.
    pub(crate) levels: Vec<wgpu::TextureView>,
    pub(crate) width: u32,
    pub(crate) height: u32,
    channels: u32,
}

impl Target {
    /// Width and height of a mip level.
    pub(crate) fn level_size(&self, level: usize) -> [u32; 2] {
        [(self.width >> level).max(1), (self.height >> level).max(1)]
    }

    /// Bytes that it takes on the device.
    pub(crate) fn size(&self) -> u64 {
        texture_bytes(&self.texture)
    }

    fn is_half(&self) -> bool {
        self.texture.format() == wgpu::TextureFormat::Rgba16Float
    }

    /// Bytes of so many texels.
    fn bytes(&self, texels: u32) -> u32 {
        texels * self.channels * if self.is_half() { 2 } else { 4 }
    }
}

/// Bytes of a texture's mip levels.
fn texture_bytes(texture: &wgpu::Texture) -> u64 {
    let (size, texel) = (texture.size(), u64::from(texture.format().block_copy_size(None).unwrap_or(0)));
    let level = |level: u32| {
        let side = |side: u32| u64::from((side >> level).max(1));
        let layers = match texture.dimension() {
            wgpu::TextureDimension::D3 => side(size.depth_or_array_layers),
            _ => u64::from(size.depth_or_array_layers),
        };
        side(size.width) * side(size.height) * layers
    };
    texel * (0..texture.mip_level_count()).map(level).sum::<u64>()
}

/// Bytes of what a view shows of a texture, and the rest of that.
pub(crate) fn view_bytes(view: &wgpu::TextureView) -> u64 {
    texture_bytes(view.texture())
}

impl Gpu {
    /// A texture of one (`R32Float`), two (`Rg32Float`) or four (`Rgba32Float`) floats a texel.
    pub(crate) fn texture(&self, label: &str, size: [u32; 2], channels: u32, levels: u32) -> Target {
        let format = match channels {
            1 => wgpu::TextureFormat::R32Float,
            2 => wgpu::TextureFormat::Rg32Float,
            _ => wgpu::TextureFormat::Rgba32Float,
        };
        self.target(label, size, format, levels)
    }

    /// A texture of four half floats a texel, of half the memory.
    pub(crate) fn half(&self, label: &str, size: [u32; 2]) -> Target {
        self.target(label, size, wgpu::TextureFormat::Rgba16Float, 1)
    }

    fn target(&self, label: &str, size: [u32; 2], format: wgpu::TextureFormat, levels: u32) -> Target {
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: levels,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::COPY_DST
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let level = |i| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                base_mip_level: i,
                mip_level_count: Some(1),
                ..Default::default()
            })
        };
        let (view, levels) = (texture.create_view(&Default::default()), (0..levels).map(level).collect());
        Target { texture, view, levels, width: size[0], height: size[1], channels: format.components().into() }
    }

    /// A texture filled from the host: rows of `size[0]` texels of 1 or 4 floats.
    pub(crate) fn texture_from(&self, label: &str, size: [u32; 2], channels: u32, data: &[f32]) -> Target {
        let target = self.texture(label, size, channels, 1);
        self.queue.write_texture(
            target.texture.as_image_copy(),
            bytemuck::cast_slice(data),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(4 * channels * size[0]),
                rows_per_image: Some(size[1]),
            },
            wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        );
        target
    }

    /// A texture of four half floats a texel, filled from the host: those are filtered on every device.
    pub(crate) fn half_from(&self, label: &str, size: [u32; 2], texels: &[[f16; 4]]) -> wgpu::TextureView {
        let extent = wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 };
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: extent,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(8 * size[0]), rows_per_image: Some(size[1]) };
        self.queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(texels), layout, extent);
        texture.create_view(&Default::default())
    }

    /// A volume of texels of a format that every device filters, or of whole numbers, filled from the host.
    pub(crate) fn volume_from(
        &self,
        label: &str,
        size: [u32; 3],
        format: wgpu::TextureFormat,
        data: &[impl bytemuck::NoUninit],
    ) -> wgpu::TextureView {
        let extent = wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: size[2] };
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: extent,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let slice = bytes.len() / size[2].max(1) as usize;
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some((slice / size[1].max(1) as usize) as u32),
            rows_per_image: Some(size[1]),
        };
        self.queue.write_texture(texture.as_image_copy(), bytes, layout, extent);
        texture.create_view(&Default::default())
    }

    /// A uniform buffer holding one host struct.
    pub(crate) fn uniform(&self, label: &str, value: &impl bytemuck::NoUninit) -> wgpu::Buffer {
        self.filled(label, bytemuck::bytes_of(value), wgpu::BufferUsages::UNIFORM)
    }

    /// A buffer that holds some bytes. They are written and not mapped: to map a buffer that a lost or full device did not give is a panic.
    fn filled(&self, label: &str, bytes: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let whole = bytes.len() - bytes.len() % wgpu::COPY_BUFFER_ALIGNMENT as usize;
        let (begin, end) = bytes.split_at(whole);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: (bytes.len() as u64).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT),
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        if !begin.is_empty() {
            self.queue.write_buffer(&buffer, 0, begin);
        }
        if !end.is_empty() {
            let mut padded = [0; wgpu::COPY_BUFFER_ALIGNMENT as usize];
            padded[..end.len()].copy_from_slice(end);
            self.queue.write_buffer(&buffer, whole as u64, &padded);
        }
        buffer
    }

    /// A zeroed storage buffer of `count` floats.
    pub(crate) fn storage(&self, label: &str, count: usize) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: 4 * count as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// A storage buffer that holds the given numbers.
    pub(crate) fn storage_from<T: bytemuck::NoUninit>(&self, label: &str, data: &[T]) -> wgpu::Buffer {
        self.filled(label, bytemuck::cast_slice(data), wgpu::BufferUsages::STORAGE)
    }

    /// Copies one mip level to the host.
    pub(crate) fn read_map(
        &self,
        target: &Target,
        level: usize,
        deadline: Option<Instant>,
    ) -> Result<HostMap, GpuError> {
        let mut maps = self.read_maps(&[(target, level)], deadline)?;
        maps.pop().ok_or_else(|| GpuError::Failed("a texture was not read".to_owned()))
    }

    /// Copies mip levels of textures to the host, all at once.
    pub(crate) fn read_maps(
        &self,
        wanted: &[(&Target, usize)],
        deadline: Option<Instant>,
    ) -> Result<Vec<HostMap>, GpuError> {
        // Rows are padded as copies want it.
        let row = |target: &Target, width: u32| {
            let bytes = target.bytes(width);
            (bytes, bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT))
        };
        let sizes = wanted.iter().map(|(target, level)| {
            let [width, height] = target.level_size(*level);
            (row(target, width).1 * height) as usize
        });
        let total: usize = sizes.sum();
        // The maps of a few layers of the finest resolution are more than one buffer may hold.
        if total as u64 > self.device.limits().max_buffer_size && wanted.len() > 1 {
            let (first, second) = wanted.split_at(wanted.len() / 2);
            let mut maps = self.read_maps(first, deadline)?;
            maps.extend(self.read_maps(second, deadline)?);
            return Ok(maps);
        }
        let buffer = self.storage("read_maps", total / 4);
        let mut encoder =
            self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read_maps") });
        let mut offset = 0;
        for (target, level) in wanted {
            let [width, height] = target.level_size(*level);
            let (_, padded) = row(target, width);
            let mut source = target.texture.as_image_copy();
            source.mip_level = *level as u32;
            encoder.copy_texture_to_buffer(
                source,
                wgpu::TexelCopyBufferInfo {
                    buffer: &buffer,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset,
                        bytes_per_row: Some(padded),
                        rows_per_image: Some(height),
                    },
                },
                wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            );
            offset += u64::from(padded * height);
        }
        self.queue.submit([encoder.finish()]);
        let floats = self.read(&buffer, total / 4, deadline)?;
        let mut rest = floats.as_slice();
        let maps = wanted.iter().map(|(target, level)| {
            let [width, height] = target.level_size(*level);
            let (bytes, padded) = row(target, width);
            let (own, after) = rest.split_at((padded * height) as usize / 4);
            rest = after;
            let rows = own.chunks(padded as usize / 4);
            let rows = rows.map(|padded| &padded[..bytes as usize / 4]);
            let data = if target.is_half() {
                rows.flat_map(bytemuck::cast_slice::<f32, f16>).map(|value| value.to_f32()).collect()
            } else {
                rows.flatten().copied().collect()
            };
            HostMap { width, height, channels: target.channels, data }
        });
        Ok(maps.collect())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    /// As a scene of four layers of the finest resolution needs.
    #[test]
    fn maps_that_do_not_fit_one_buffer_are_read_all_the_same() {
        let gpu = Gpu::open(None, true).unwrap();
        let side = 4096;
        let maps: Vec<_> = (1..=5_u8)
            .map(|i| gpu.texture_from("map", [side; 2], 1, &vec![f32::from(i); (side * side) as usize]))
            .collect();
        let wanted: Vec<_> = maps.iter().map(|map| (map, 0)).collect();
        let texels = maps.len() as u64 * u64::from(side) * u64::from(side);
        assert!(4 * texels > gpu.device.limits().max_buffer_size);
        let read = gpu.read_maps(&wanted, None).unwrap();
        assert_eq!(read.len(), maps.len());
        for (i, map) in (1..=5_u8).zip(&read) {
            assert_eq!((map.width, map.height, map.data.len()), (side, side, (side * side) as usize));
            assert!(map.data.iter().all(|value| *value == f32::from(i)));
        }
    }
}
