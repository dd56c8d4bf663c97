//! What a request may ask for, and what is kept for requests.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use skyloom::scene::Scene;

use crate::render_queue::Patience;

/// `[limits]`: largest things a request may ask for or send.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Bytes of a scene.
    pub scene_bytes: usize,
    /// Bytes of an image file.
    pub image_bytes: usize,
    /// Texels along either side of an image.
    pub image_side: u32,
    /// Texels of an image.
    pub image_texels: u64,
    /// Texels a side of a texture.
    pub max_side: u32,
    /// Bytes of memory that a render may take, on the device and on the host together.
    pub render_memory_bytes: u64,
    /// Smallest tolerance that a query may ask for: smaller ones take larger tables.
    pub least_tolerance: f64,
    /// Registered skies.
    pub skies: usize,
    /// Bytes of all registered skies together.
    pub sky_store_bytes: u64,
    /// Bytes of all stored images together.
    pub image_store_bytes: u64,
    /// Bytes of bodies of requests in memory at a time.
    pub upload_memory_bytes: u64,
    /// Bytes of replies in memory at a time, until they are sent.
    pub reply_memory_bytes: u64,
    /// Bytes of large replies in files at a time, until they are sent; 0 keeps them in memory.
    pub reply_disk_bytes: u64,
    /// Times x points of one series of light at points.
    pub series_values: u64,
    /// Textures of one `POST /v1/render`.
    pub bundle_textures: usize,
    /// Texels of them together.
    pub bundle_texels: u64,
    /// Frames of one film.
    pub film_frames: u64,
    /// Streams of events, series and films open at a time; each holds one of `server.connections`.
    pub streams: usize,
}

/// `[queue]`: the queue in front of the render thread.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Queue {
    /// Renders that may wait; one more is answered 503.
    pub depth: usize,
    /// Seconds from entering the queue to the finished picture; later is answered 504.
    pub timeout_s: u64,
}

/// `[cache]`: memory kept for quick answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Cache {
    /// Bytes of encoded replies.
    pub memory_bytes: u64,
    /// Bytes of decoded images.
    pub image_memory_bytes: u64,
}

/// `[render]`: the graphics device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Render {
    /// Part of the name of the adapter to use; empty picks the best one.
    pub adapter: String,
    /// Bytes of earlier renders that each renderer may keep for the next ones.
    pub kept_bytes: u64,
    /// Renderers that take jobs that are alike side by side; 0 leaves it to the device.
    pub side_by_side: usize,
    /// Seconds without a sign of life of a renderer after which nothing is rendered until it gives one.
    pub unready_after_s: u64,
    /// The same after which the server ends, to be started again.
    pub restart_after_s: u64,
}

/// `[log]`: the log on stderr.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Log {
    /// How its lines are written.
    pub format: LogFormat,
}

/// How lines of the log are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LogFormat {
    /// For people.
    #[default]
    Text,
    /// An object a line.
    Json,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            scene_bytes: Scene::MAX_BYTES,
            image_bytes: 64 << 20,
            image_side: 8192,
            image_texels: 4096 * 4096,
            max_side: 4096,
            render_memory_bytes: 4 << 30,
            least_tolerance: 0.0,
            skies: 10_000,
            sky_store_bytes: 4 << 30,
            image_store_bytes: 4 << 30,
            upload_memory_bytes: 512 << 20,
            reply_memory_bytes: 2 << 30,
            reply_disk_bytes: 8 << 30,
            series_values: 20_000,
            bundle_textures: 16,
            bundle_texels: 4096 * 4096,
            film_frames: 3600,
            streams: 256,
        }
    }
}

impl Default for Queue {
    fn default() -> Self {
        Self { depth: 32, timeout_s: 30 }
    }
}

impl Default for Render {
    fn default() -> Self {
        Self {
            adapter: String::new(),
            kept_bytes: 1 << 30,
            side_by_side: 0,
            unready_after_s: 180,
            restart_after_s: 600,
        }
    }
}

impl Default for Cache {
    fn default() -> Self {
        Self { memory_bytes: 256 << 20, image_memory_bytes: 512 << 20 }
    }
}

impl Queue {
    /// Time from entering the queue to the finished picture.
    pub fn timeout(&self) -> Duration {
        Duration::from_secs(self.timeout_s)
    }
}

impl Render {
    /// How long a renderer may give no sign of life.
    pub fn patience(&self) -> Patience {
        let [unready, restart] = [self.unready_after_s, self.restart_after_s].map(Duration::from_secs);
        Patience { unready, restart }
    }

    /// The wanted adapter, or none when any will do.
    pub fn wanted(&self) -> Option<String> {
        Some(self.adapter.clone()).filter(|name| !name.is_empty())
    }
}

impl Limits {
    /// Limits that the image decoder enforces before it allocates.
    pub fn image(&self) -> skyloom::image::ImageLimits {
        skyloom::image::ImageLimits { max_side: self.image_side, max_texels: self.image_texels }
    }
}
