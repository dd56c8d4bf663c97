//! The values of a file's first level, by what its format says.

use half::f16;
use std::io::Cursor;

use crate::chart::file::ChartError;
use crate::job::Texture;

/// Bytes before the texels of a DDS file with the header of Direct3D 10.
const DDS_HEADER: usize = 148;
/// Where a KTX2 file says where its first level is.
const KTX2_FIRST_LEVEL: usize = 80;

const BROKEN: ChartError = ChartError::Empty("a file that is not what its format says");

/// Values of a file of a texture, channels interleaved.
pub(super) fn values(
    format: &str,
    query: &[(&str, &str)],
    file: &[u8],
    texture: &Texture,
) -> Result<Vec<f32>, ChartError> {
    let channels = texture.channels.len();
    match format {
        "f32" => Ok(floats(file)),
        "f16" => Ok(halves(file)),
        "exr" => exr(file, texture),
        "hdr" => hdr(file, texture),
        "png" => picture(file, image::ImageFormat::Png),
        "webp" => picture(file, image::ImageFormat::WebP),
        "dds" => device(query, file.get(DDS_HEADER..).ok_or(BROKEN)?, texture),
        "ktx2" => {
            let at = file.get(KTX2_FIRST_LEVEL..).and_then(|index| index.first_chunk::<8>()).ok_or(BROKEN)?;
            let start = usize::try_from(u64::from_le_bytes(*at)).ok().ok_or(BROKEN)?;
            device(query, file.get(start..).ok_or(BROKEN)?, texture)
        }
        _ => Err(BROKEN),
    }
    .and_then(|values| if values.len() == channels * texels(texture) { Ok(values) } else { Err(BROKEN) })
}

fn texels(texture: &Texture) -> usize {
    texture.width as usize * texture.height as usize
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

fn halves(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks::<2>().0.iter().map(|bytes| f16::from_le_bytes(*bytes).to_f32()).collect()
}

/// Texels as a device takes them; a texture of colours has four channels there.
fn device(query: &[(&str, &str)], bytes: &[u8], texture: &Texture) -> Result<Vec<f32>, ChartError> {
    let count = texels(texture);
    let coding = query.iter().find(|(name, _)| *name == "coding").map_or("float", |(_, value)| value);
    let bytes_of = |each: usize| bytes.get(..each * count).ok_or(BROKEN);
    match coding {
        "float" => {
            let four = halves(bytes_of(8)?);
            Ok(four.chunks(4).flat_map(|texel| texel.iter().take(3).copied()).collect())
        }
        "rgb9e5" => Ok(bytes_of(4)?.as_chunks::<4>().0.iter().flat_map(|texel| shared(*texel)).collect()),
        "bc6h" => blocks(bytes, texture, 16, |block, out: &mut [[f32; 3]; 16]| {
            bcdec_rs::bc6h_float(block, out.as_flattened_mut(), 12, false);
        }),
        "bc4" => blocks(bytes, texture, 8, |block, out: &mut [[f32; 1]; 16]| {
            let mut levels = [0_u8; 16];
            bcdec_rs::bc4(block, &mut levels, 4, false);
            out.iter_mut().zip(levels).for_each(|(out, level)| out[0] = f32::from(level) / 255.0);
        }),
        _ => Err(BROKEN),
    }
}

/// A texel of RGB9E5 by the formula of `EXT_texture_shared_exponent`.
fn shared(bytes: [u8; 4]) -> [f32; 3] {
    let packed = u32::from_le_bytes(bytes);
    let unit = f64::from(packed >> 27).exp2() * 2_f64.powi(-24);
    [0, 9, 18].map(|shift| (f64::from(packed >> shift & 511) * unit) as f32)
}

/// Blocks of 4 x 4 texels; sides are multiples of four, and faces lie one below the other.
fn blocks<const N: usize>(
    bytes: &[u8],
    texture: &Texture,
    each: usize,
    read: impl Fn(&[u8], &mut [[f32; N]; 16]),
) -> Result<Vec<f32>, ChartError> {
    let (width, height) = (texture.width as usize, texture.height as usize);
    let mut values = vec![0.0; N * width * height];
    for (number, block) in bytes.chunks_exact(each).take(width * height / 16).enumerate() {
        let mut found = [[0.0; N]; 16];
        read(block, &mut found);
        let (left, top) = (4 * (number % (width / 4)), 4 * (number / (width / 4)));
        for (i, texel) in found.iter().enumerate() {
            let at = N * ((top + i / 4) * width + left + i % 4);
            values.get_mut(at..at + N).ok_or(BROKEN)?.copy_from_slice(texel);
        }
    }
    Ok(values)
}

fn exr(file: &[u8], texture: &Texture) -> Result<Vec<f32>, ChartError> {
    use exr::prelude::{ReadChannels as _, ReadLayers as _, read};
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(file))
        .ok()
        .ok_or(BROKEN)?;
    let planes: Vec<Vec<f32>> = texture
        .channels
        .iter()
        .filter_map(|name| image.layer_data.channel_data.list.iter().find(|channel| channel.name.eq(name)))
        .map(|channel| channel.sample_data.values_as_f32().collect())
        .collect();
    if planes.len() != texture.channels.len() {
        return Err(BROKEN);
    }
    Ok((0..texels(texture)).flat_map(|i| planes.iter().map(move |plane| plane[i])).collect())
}

fn picture(file: &[u8], format: image::ImageFormat) -> Result<Vec<f32>, ChartError> {
    let image = image::load_from_memory_with_format(file, format).ok().ok_or(BROKEN)?;
    Ok(match image {
        image::DynamicImage::ImageLuma8(image) => image.iter().map(|value| f32::from(*value) / 255.0).collect(),
        image::DynamicImage::ImageLuma16(image) => image.iter().map(|value| f32::from(*value) / 65535.0).collect(),
        // A WebP is always in colour.
        image::DynamicImage::ImageRgb8(image) => image.pixels().map(|texel| f32::from(texel.0[0]) / 255.0).collect(),
        _ => return Err(BROKEN),
    })
}

/// Runs of Radiance: four bytes that begin a row, then each part of the texels for itself.
fn hdr(file: &[u8], texture: &Texture) -> Result<Vec<f32>, ChartError> {
    let end = file.windows(2).position(|two| two == b"\n\n").ok_or(BROKEN)? + 2;
    let size = file[end..].iter().position(|letter| *letter == b'\n').ok_or(BROKEN)?;
    let mut rest = file[end + size + 1..].iter().copied();
    let width = texture.width as usize;
    let mut values = Vec::with_capacity(3 * texels(texture));
    for _ in 0..texture.height {
        let mut parts: [Vec<u8>; 4] = Default::default();
        rest.nth(3).ok_or(BROKEN)?;
        for part in &mut parts {
            while part.len() < width {
                let count = rest.next().ok_or(BROKEN)?;
                if count > 128 {
                    let value = rest.next().ok_or(BROKEN)?;
                    part.extend(std::iter::repeat_n(value, usize::from(count) - 128));
                } else {
                    part.extend(rest.by_ref().take(usize::from(count)));
                }
            }
        }
        let [r, g, b, e] = &parts;
        for i in 0..width {
            let unit = 2_f64.powi(i32::from(e[i]) - 136);
            values.extend([r[i], g[i], b[i]].map(|part| (f64::from(part) * unit) as f32));
        }
    }
    Ok(values)
}
