//! DDS (Microsoft, "DDS file layout") with the header of Direct3D 10, which names the format of the texels.

use std::io;

use super::encoded::Target;
use super::openexr::Depth;
use super::packed::{DeviceTexture, Layout};

/// `DXGI_FORMAT`.
fn format(layout: Layout) -> u32 {
    match layout {
        Layout::Single(Depth::Half) => 54,
        Layout::Single(Depth::Float) => 41,
        Layout::Four(Depth::Half) => 10,
        Layout::Four(Depth::Float) => 2,
        Layout::Rgb9e5 => 67,
        Layout::Bc6h => 95,
        Layout::Bc4 => 80,
    }
}

pub(super) fn write(texture: &DeviceTexture<'_>, file: &mut dyn Target) -> io::Result<()> {
    // What the header holds, and what the texture is.
    const CAPS_SIZE_FORMAT: u32 = 0x1 | 0x2 | 0x4 | 0x1000;
    const PITCH: u32 = 0x8;
    const ALL_BYTES: u32 = 0x8_0000;
    const MIPS: u32 = 0x2_0000;
    const TEXTURE: u32 = 0x1000;
    const COMPLEX: u32 = 0x8;
    const HAS_MIPS: u32 = 0x40_0000;
    const ALL_FACES: u32 = 0x200 | 0xFC00;
    const IS_CUBE: u32 = 0x4;
    const TWO_DIMENSIONS: u32 = 3;
    let levels = texture.levels.len() as u32;
    let faces = texture.levels.first().map_or(1, Vec::len);
    let (is_cube, has_mips) = (faces > 1, levels > 1);
    let given = |flag: u32, is: bool| if is { flag } else { 0 };
    // Of rows of texels one is told, of blocks all of the first level.
    let bytes = texture.layout.bytes() as u32;
    let (told, length) = match texture.layout.block_side() as u32 {
        1 => (PITCH, texture.width * bytes),
        side => (ALL_BYTES, texture.width.div_ceil(side) * texture.height.div_ceil(side) * bytes),
    };
    let mut numbers = vec![u32::from_le_bytes(*b"DDS "), 124, CAPS_SIZE_FORMAT | told | given(MIPS, has_mips)];
    numbers.extend([texture.height, texture.width, length, 0, levels]);
    numbers.extend([0; 11]);
    // The texels' format stands in the second header.
    numbers.extend([32, 0x4, u32::from_le_bytes(*b"DX10"), 0, 0, 0, 0, 0]);
    let caps = TEXTURE | given(COMPLEX, is_cube || has_mips) | given(HAS_MIPS, has_mips);
    numbers.extend([caps, given(ALL_FACES, is_cube), 0, 0, 0]);
    let alpha = match texture.premultiplied {
        _ if matches!(texture.layout, Layout::Single(_) | Layout::Rgb9e5 | Layout::Bc6h | Layout::Bc4) => 0,
        Some(false) => 1,
        Some(true) => 2,
        None => 3,
    };
    numbers.extend([format(texture.layout), TWO_DIMENSIONS, given(IS_CUBE, is_cube), 1, alpha]);
    let head: Vec<u8> = numbers.into_iter().flat_map(u32::to_le_bytes).collect();
    file.write_all(&head)?;
    // Face by face, in each the largest level first.
    for face in 0..faces {
        let mut levels = texture.levels.iter().filter_map(|faces| faces.get(face));
        levels.try_for_each(|level| texture.write_face(*level, file))?;
    }
    Ok(())
}
