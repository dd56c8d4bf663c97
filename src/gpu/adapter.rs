//! Which adapter: a real one before a software one.

use super::error::GpuError;

/// An adapter, in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AdapterSummary {
    /// Its name.
    pub name: String,
    /// Vulkan, Metal or DX12.
    pub backend: String,
    /// Discrete, integrated, virtual or software.
    pub kind: String,
    /// Driver with version.
    pub driver: String,
    /// Whether skyloom would use this one.
    pub chosen: bool,
}

/// What to do where no adapter was found.
const HOW_TO_INSTALL: &str = "no Vulkan driver was found; install a graphics driver, or the software one: \
    apt-get install mesa-vulkan-drivers libvulkan1 (Debian, Ubuntu), dnf install mesa-vulkan-drivers (Fedora)";

impl AdapterSummary {
    /// The kind of an adapter whose work the processor does.
    pub const SOFTWARE: &str = "software";
}

fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    descriptor.flags = wgpu::InstanceFlags::empty();
    wgpu::Instance::new(descriptor)
}

fn rank(kind: wgpu::DeviceType) -> u32 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Cpu => 3,
        wgpu::DeviceType::Other => 4,
    }
}

fn sorted() -> Vec<(wgpu::Adapter, wgpu::AdapterInfo)> {
    let found = pollster::block_on(instance().enumerate_adapters(wgpu::Backends::all()));
    let mut list: Vec<_> =
        found.into_iter().map(|adapter| (adapter.get_info(), adapter)).map(|(i, a)| (a, i)).collect();
    list.sort_by_key(|(_, info)| rank(info.device_type));
    list
}

fn matches(info: &wgpu::AdapterInfo, wanted: Option<&str>) -> bool {
    wanted.is_none_or(|wanted| info.name.to_lowercase().contains(&wanted.to_lowercase()))
}

fn summary(info: &wgpu::AdapterInfo, chosen: bool) -> AdapterSummary {
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => "discrete",
        wgpu::DeviceType::IntegratedGpu => "integrated",
        wgpu::DeviceType::VirtualGpu => "virtual",
        wgpu::DeviceType::Cpu => AdapterSummary::SOFTWARE,
        wgpu::DeviceType::Other => "other",
    };
    AdapterSummary {
        name: info.name.clone(),
        backend: info.backend.to_string(),
        kind: kind.to_owned(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        chosen,
    }
}

/// Every adapter, best first; the one that would be used is marked.
pub fn adapters(wanted: Option<&str>) -> Vec<AdapterSummary> {
    let mut chosen = false;
    let mark = |(_, info): &(wgpu::Adapter, wgpu::AdapterInfo)| {
        let this = !chosen && matches(info, wanted);
        chosen |= this;
        summary(info, this)
    };
    sorted().iter().map(mark).collect()
}

/// The best adapter whose name contains `wanted`.
pub(super) fn choose(wanted: Option<&str>) -> Result<(wgpu::Adapter, AdapterSummary), GpuError> {
    let list = sorted();
    if list.is_empty() {
        return Err(GpuError::NoAdapter(HOW_TO_INSTALL.to_owned()));
    }
    let names: Vec<_> = list.iter().map(|(_, info)| info.name.clone()).collect();
    let found = list.into_iter().find(|(_, info)| matches(info, wanted));
    let (adapter, info) = found.ok_or_else(|| {
        let wanted = wanted.unwrap_or_default();
        GpuError::NoAdapter(format!("no adapter's name contains \"{wanted}\"; there are {}", names.join(", ")))
    })?;
    let summary = summary(&info, true);
    Ok((adapter, summary))
}
