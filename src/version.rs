//! Which renderer made a texture.

use crate::gpu::shaders;
use crate::image::sha256_hex;
use std::sync::LazyLock;

/// Version of the renderer: two versions may give different textures for the same request. The crate's version and a
/// hash of all shaders.
pub static VERSION: LazyLock<String> = LazyLock::new(|| {
    let sources: String = shaders::ALL.iter().map(|shader| shader.source(true)).collect();
    format!("{}+{}", env!("CARGO_PKG_VERSION"), &sha256_hex(sources.as_bytes())[..12])
});
