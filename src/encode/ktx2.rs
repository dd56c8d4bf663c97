//! KTX2 (Khronos, KTX File Format Specification 2.0), without supercompression. Written here, as the crates that are kept read it
//! alone.

use std::io;

use super::encoded::Target;
use super::metadata::Metadata;
use super::openexr::Depth;
use super::packed::{DeviceTexture, Layout};

const IDENTIFIER: [u8; 12] = [0xAB, b'K', b'T', b'X', b' ', b'2', b'0', 0xBB, b'\r', b'\n', 0x1A, b'\n'];
/// Bytes of identifier, header and index.
const HEAD: usize = 80;
/// Bytes of the place of a level.
const PLACE: usize = 24;

/// `VkFormat`, and the size of the numbers that a texel consists of, bytes.
fn format(layout: Layout) -> [u32; 2] {
    match layout {
        Layout::Single(Depth::Half) => [76, 2],
        Layout::Single(Depth::Float) => [100, 4],
        Layout::Four(Depth::Half) => [97, 2],
        Layout::Four(Depth::Float) => [109, 4],
        Layout::Rgb9e5 => [123, 4],
        Layout::Bc6h => [143, 1],
        Layout::Bc4 => [139, 1],
    }
}

pub(super) fn write(texture: &DeviceTexture<'_>, metadata: &Metadata, file: &mut dyn Target) -> io::Result<()> {
    let (descriptor, words) = (descriptor(texture), words(metadata, texture.roughness.clone()));
    let count = texture.levels.len();
    let faces = texture.levels.first().map_or(1, Vec::len) as u32;
    let dfd = HEAD + PLACE * count;
    let kvd = dfd + descriptor.len();
    let [format, number_bytes] = format(texture.layout);
    let mut head = IDENTIFIER.to_vec();
    let mut put = |numbers: &[u32]| numbers.iter().for_each(|number| head.extend(number.to_le_bytes()));
    put(&[format, number_bytes, texture.width, texture.height, 0, 0, faces, count as u32, 0]);
    put(&[dfd as u32, descriptor.len() as u32, kvd as u32, words.len() as u32]);
    // No global data of a supercompression.
    put(&[0; 4]);
    // The smallest level comes first, so that a reader shows something early. Before each is what its place is short of.
    let step = texture.layout.bytes().max(4);
    let mut end = kvd + words.len();
    let mut places = Vec::with_capacity(count);
    for faces in texture.levels.iter().rev() {
        let (begin, length) =
            (end.next_multiple_of(step), faces.iter().map(|face| texture.layout.bytes_of(*face)).sum());
        places.push((begin - end, begin, length));
        end = begin + length;
    }
    for (_, begin, length) in places.iter().rev() {
        head.extend([*begin, *length, *length].map(|number| (number as u64).to_le_bytes()).as_flattened());
    }
    head.extend_from_slice(&descriptor);
    head.extend_from_slice(&words);
    file.write_all(&head)?;
    for ((short, ..), faces) in places.iter().zip(texture.levels.iter().rev()) {
        file.write_all(&vec![0; *short])?;
        faces.iter().try_for_each(|face| texture.write_face(*face, file))?;
    }
    Ok(())
}

/// The data format descriptor: linear light in the primaries of Rec.709.
fn descriptor(texture: &DeviceTexture<'_>) -> Vec<u8> {
    /// Bits of a channel's kind: a float, with a sign, an exponent.
    const FLOAT: u32 = 0x80 | SIGNED;
    const SIGNED: u32 = 0x40;
    const EXPONENT: u32 = 0x20;
    const ALPHA: u32 = 15;
    let (minus_one, one) = ((-1.0_f32).to_bits(), 1.0_f32.to_bits());
    // First bit, bits, channel, and the values that stand for -1 (or 0) and 1.
    let samples: Vec<[u32; 5]> = match texture.layout {
        Layout::Single(depth) => vec![[0, depth.bits(), FLOAT, minus_one, one]],
        Layout::Four(depth) => [0, 1, 2, ALPHA]
            .into_iter()
            .enumerate()
            .map(|(i, channel)| [i as u32 * depth.bits(), depth.bits(), channel | FLOAT, minus_one, one])
            .collect(),
        // The specification's example of a shared exponent: 1 is 8448, an exponent of 15 is none.
        Layout::Rgb9e5 => [0, 1, 2]
            .into_iter()
            .flat_map(|channel| [[9 * channel, 9, channel, 0, 8448], [27, 5, channel | EXPONENT, 15, 31]])
            .collect(),
        // A block is one sample, of floats without a sign and of parts of a whole.
        Layout::Bc6h => vec![[0, 128, FLOAT & !SIGNED, 0, one]],
        Layout::Bc4 => vec![[0, 64, 0, 0, u32::MAX]],
    };
    let block = 24 + 16 * samples.len() as u32;
    // Colours, or the kind of blocks.
    let model = match texture.layout {
        Layout::Single(_) | Layout::Four(_) | Layout::Rgb9e5 => 1,
        Layout::Bc6h => 133,
        Layout::Bc4 => 131,
    };
    let (primaries_bt709, transfer_linear) = (1 << 8, 1 << 16);
    let premultiplied = u32::from(texture.premultiplied == Some(true)) << 24;
    let colours = model | primaries_bt709 | transfer_linear | premultiplied;
    // Of a block's sides in texels, less one each.
    let sides = 0x0101 * (texture.layout.block_side() as u32 - 1);
    // Version 2; bytes in the first plane.
    let mut numbers = vec![4 + block, 0, 2 | block << 16, colours, sides, texture.layout.bytes() as u32, 0];
    for [first, bits, channel, low, high] in samples {
        numbers.extend([first | (bits - 1) << 16 | channel << 24, 0, low, high]);
    }
    numbers.into_iter().flat_map(u32::to_le_bytes).collect()
}

/// Names with their words.
fn words(metadata: &Metadata, roughness: Option<String>) -> Vec<u8> {
    let mut own = metadata.in_words();
    own.extend(roughness.map(|words| ("roughness", words)));
    own.sort_unstable();
    let own = own.into_iter().map(|(name, value)| (format!("skyloom:{name}"), value));
    let writer = format!("skyloom {}", metadata.version);
    let standard = [("KTXorientation".to_owned(), "rd".to_owned()), ("KTXwriter".to_owned(), writer)];
    let mut bytes = Vec::new();
    // Sorted by name, as the format wants them.
    for (name, value) in standard.into_iter().chain(own) {
        let entry = [name.as_bytes(), &[0], value.as_bytes(), &[0]].concat();
        bytes.extend((entry.len() as u32).to_le_bytes());
        bytes.extend_from_slice(&entry);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}
