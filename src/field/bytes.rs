//! What a layer's field takes of memory, before it is made.

use super::eddies::{BANDS, GRID};
use super::synthetic;
use crate::image::Image;
use crate::scene::{ExtinctionProfile, Layer, Thickness};
use std::collections::HashMap;
use std::sync::Arc;

/// What a layer's field takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FieldBytes {
    /// Texels of its map across and down.
    pub(crate) size: [u32; 2],
    /// Bytes of one of them.
    pub(crate) texel: u64,
    /// Bytes of the map with its bounds.
    pub(crate) map: u64,
    /// Bytes of what it is made from on the device.
    pub(crate) source: u64,
    /// Whether that stays: the field moves.
    pub(crate) stays: bool,
    /// Bytes on the way there: what the host has of it, and brings to the device.
    pub(crate) passing: u64,
}

/// A texel of a map of columns, and of a thickness.
const COLUMN: u64 = 16;
const SHEET: u64 = 4;
/// Displacement: four bands of eddies, velocity, and three maps of displacement.
const MOTION: u64 = COLUMN * (BANDS as u64 + 4) * (GRID as u64 * GRID as u64);

impl FieldBytes {
    /// That of a layer whose synthetic field has so many texels a side; an image that is not among `images` counts as one texel.
    pub(crate) fn new(layer: &Layer, moves: bool, resolution: u32, images: &HashMap<String, Arc<Image>>) -> Self {
        let shape = &layer.shape;
        let found = || shape.image_names().find_map(|name| images.get(&name.0));
        let image = || found().map_or([1; 2], |image| [image.width, image.height]);
        let texels = |[across, down]: [u32; 2]| u64::from(across) * u64::from(down);
        let grows = shape.profile == ExtinctionProfile::Adiabatic;
        let mut hung = shape.hangs_from_m().is_some() || (grows && !shape.has_maps());
        let (size, texel, source, passing) = match &shape.thickness {
            // The host has the columns as the device gets them, and a copy of them is on its way.
            _ if shape.has_maps() => (image(), COLUMN, 0, 2 * COLUMN * texels(image())),
            Some(Thickness::Stratocumulus(_)) => {
                let columns = shape.thins_out();
                hung &= !columns;
                ([resolution; 2], if columns { COLUMN } else { SHEET }, synthetic::bytes(resolution), 0)
            }
            // Values beside the image, which is its own field where nothing moves it.
            Some(Thickness::Map { .. }) => {
                let image_bytes = SHEET * texels(image());
                (image(), SHEET, image_bytes * if moves { 2 } else { 1 }, 2 * image_bytes)
            }
            Some(Thickness::Uniform(_)) | None => ([1; 2], SHEET, 0, 0),
        };
        // The thickness of columns that hang, or whose extinction grows, goes when the columns are there.
        let (texel, passing) = if hung { (COLUMN, passing + texel * texels(size)) } else { (texel, passing) };
        let source = source + if moves { MOTION } else { 0 };
        Self { size, texel, map: map(texel, texels(size)), source, stays: moves, passing }
    }

    /// Bytes of the mip levels of its map and bounds.
    pub(crate) fn levels(&self) -> u64 {
        if self.size == [1; 2] { 0 } else { self.map * 4 / 3 }
    }
}

/// A map with its bounds, of 8 bytes for each 64 texels.
fn map(texel: u64, texels: u64) -> u64 {
    texel * texels + texels / 8
}
