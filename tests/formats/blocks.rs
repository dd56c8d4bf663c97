//! Compressed blocks, decoded by a program that others wrote (`bcdec_rs`).

use ddsfile::{Dds, DxgiFormat};
use half::f16;
use proptest::prelude::*;
use skyloom::encode::{Coding, Container, EncodeError, Level, Mips, Output, Packed, Pixels, encode, levels};

use crate::{RGB, file, light, metadata, packed};

/// The texels of blocks, `channels` each.
fn decoded(bytes: &[u8], width: usize, height: usize, channels: usize) -> Vec<f64> {
    let across = width.div_ceil(4);
    let mut texels = vec![0.0; width * height * channels];
    let length = if channels == 3 { 16 } else { 8 };
    assert_eq!(bytes.len(), across * height.div_ceil(4) * length);
    for (number, block) in bytes.chunks(length).enumerate() {
        let mut found = [0.0_f32; 48];
        if channels == 3 {
            bcdec_rs::bc6h_float(block, &mut found, 12, false);
        } else {
            bcdec_rs::bc4_float(block, &mut found, 4, false);
        }
        for (i, texel) in found.chunks(channels).take(16).enumerate() {
            let (x, y) = (4 * (number % across) + i % 4, 4 * (number / across) + i / 4);
            if x < width && y < height {
                let at = (y * width + x) * channels;
                for (value, found) in texels[at..at + channels].iter_mut().zip(texel) {
                    *value = f64::from(*found);
                }
            }
        }
    }
    texels
}

/// Root of the mean square of the errors, in parts of that of the values.
fn relative(data: &[f32], found: &[f64]) -> f64 {
    assert_eq!(data.len(), found.len());
    let (error, all) = data.iter().zip(found).fold((0.0, 0.0), |(error, all), (value, found)| {
        let value = f64::from(*value);
        (error + (value - found).powi(2), all + value * value)
    });
    (error / all).sqrt()
}

/// Light of a sky: a colour that changes with height, brighter around a place.
fn sky(width: usize, height: usize) -> Vec<f32> {
    let texel = |i: usize| {
        let (x, y) = ((i % width) as f64 / width as f64, (i / width) as f64 / height as f64);
        let glow = 20.0 * (-60.0 * ((x - 0.3).powi(2) + (y - 0.4).powi(2))).exp();
        [2.0, 3.0, 6.0].map(|tint| ((tint + 6.0 * y * y) + glow) as f32)
    };
    (0..width * height).flat_map(texel).collect()
}

#[test]
fn another_decoder_finds_the_light_of_blocks() {
    use ktx2::Format as Vk;
    for (size, channels, coding, format) in [
        ([64, 32], 3, Coding::Bc6h, Vk::BC6H_UFLOAT_BLOCK),
        ([37, 18], 3, Coding::Bc6h, Vk::BC6H_UFLOAT_BLOCK),
        ([64, 32], 1, Coding::Bc4, Vk::BC4_UNORM_BLOCK),
        ([9, 5], 1, Coding::Bc4, Vk::BC4_UNORM_BLOCK),
    ] {
        let [width, height] = size.map(|side| side as usize);
        let data: Vec<f32> = match channels {
            3 => sky(width, height),
            _ => sky(width, height).chunks(3).map(|texel| texel[0] / 30.0).collect(),
        };
        let names = if channels == 1 { &["Y"][..] } else { &RGB };
        let all = levels(Level { width, height, data: data.clone() }, channels, false);
        let bytes = file(&packed(Container::Ktx2, coding, Mips::Means), size, names, &data, "equirect").unwrap();
        let reader = ktx2::Reader::new(bytes.as_slice()).unwrap();
        assert_eq!((reader.header().format, reader.levels().len()), (Some(format), all.len()));
        assert_eq!(reader.header().type_size, 1);
        let dds = file(&packed(Container::Dds, coding, Mips::Means), size, names, &data, "equirect").unwrap();
        let dds = Dds::read(dds.as_slice()).unwrap();
        let dxgi = if channels == 3 { DxgiFormat::BC6H_UF16 } else { DxgiFormat::BC4_UNorm };
        assert_eq!((dds.get_dxgi_format(), dds.get_num_mipmap_levels() as usize), (Some(dxgi), all.len()));
        let first = width.div_ceil(4) * height.div_ceil(4) * if channels == 3 { 16 } else { 8 };
        assert_eq!(dds.header.linear_size, Some(first as u32));
        let mut rest = dds.get_data(0).unwrap();
        for (number, (level, expected)) in reader.levels().zip(&all).enumerate() {
            let (own, after) = rest.split_at(level.data.len());
            assert!(own == level.data, "level {number} of both containers");
            rest = after;
            let found = decoded(level.data, expected.width, expected.height, channels);
            let error = relative(&expected.data, &found);
            eprintln!("{coding:?} {size:?} level {number}: {error:.5}");
            // The smaller a picture, the more its light changes across a block.
            let limit = (1.2 / expected.width as f64).max(0.01);
            assert!(error < limit, "{coding:?} {size:?} level {number}: {error}");
        }
        assert!(rest.is_empty());
    }
}

#[test]
fn even_light_stays_what_it_is() {
    for level in [0.0_f32, 6.2e-5, 0.001, 0.37, 1.0, 25.0, 4000.0, 65_504.0] {
        let data: Vec<f32> = (0..16).flat_map(|_| [level, level * 0.5, level * 0.25]).collect();
        let bytes = file(&packed(Container::Dds, Coding::Bc6h, Mips::None), [4, 4], &RGB, &data, "plane").unwrap();
        let found = decoded(&bytes[148..], 4, 4, 3);
        for (value, found) in data.iter().zip(found) {
            // Ends of 10 bits for 15 of a half float and its exponent.
            assert!((f64::from(*value) - found).abs() <= f64::from(*value) / 60.0 + 1e-6, "{value} {found}");
        }
    }
    for step in 0..=255_u8 {
        let value = f32::from(step) / 255.0;
        let bytes =
            file(&packed(Container::Dds, Coding::Bc4, Mips::None), [4, 4], &["Y"], &[value; 16], "plane").unwrap();
        assert!(decoded(&bytes[148..], 4, 4, 1).iter().all(|found| (found - f64::from(value)).abs() < 1e-6), "{value}");
    }
}

#[test]
fn what_blocks_cannot_hold_is_refused_by_name() {
    for (coding, names, data, field, told) in [
        (Coding::Bc6h, &RGB[..], &[1.0, 70_000.0, 0.0][..], "scale", "0 to 65504, the range of coding bc6h"),
        (Coding::Bc6h, &RGB, &[1.0, -0.5, 0.0], "scale", "channel G"),
        (Coding::Bc6h, &RGB, &[1e-5, 0.0, 0.0], "scale", "0.000061"),
        (Coding::Bc4, &["Y"], &[1.5], "scale", "the range of coding bc4; allowed: formats exr, f32, or scale 1.6"),
    ] {
        let error = file(&packed(Container::Ktx2, coding, Mips::None), [1, 1], names, data, "plane").unwrap_err();
        assert!(error.field() == Some(field) && error.to_string().contains(told), "{error}");
    }
    // Noise of a part of a whole is cut off.
    let output = Output::Packed(Packed { coding: Coding::Bc4, ..Packed::new(Container::Dds) });
    let part = |data: &[f32]| -> Result<Vec<f64>, EncodeError> {
        let pixels = Pixels {
            width: 1,
            height: 1,
            channels: &["Y"],
            data,
            errors: None,
            layers: &[],
            alpha: skyloom::encode::Alpha::Premultiplied,
            fraction: true,
        };
        let about = skyloom::encode::Metadata { scale: 1.0, ..metadata("plane") };
        Ok(decoded(&encode(&pixels, &about, &output, 1.0)?.bytes[148..], 1, 1, 1))
    };
    assert_eq!((part(&[1.02]).unwrap(), part(&[-0.01]).unwrap()), (vec![1.0], vec![0.0]));
}

#[test]
fn blocks_are_for_textures_that_they_hold() {
    use skyloom::request::{Request, RequestError};
    let pairs = |pairs: &[(&str, &str)]| -> Vec<(String, String)> {
        pairs.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect()
    };
    for (texture, query, is_taken) in [
        ("sky", &[("coding", "bc6h")][..], true),
        ("shadow", &[("coding", "bc6h")], true),
        ("cloud", &[("coding", "bc6h")], false),
        ("shadow", &[("coding", "bc4")], true),
        ("thickness", &[("coding", "bc4"), ("scale", "0.001")], true),
        ("sky", &[("coding", "bc4")], false),
        ("cloud", &[("coding", "bc4"), ("wavelength", "440")], false),
        ("irradiance", &[("coding", "bc4"), ("wavelength", "440")], true),
    ] {
        match Request::parse(texture, "dds", &pairs(query)) {
            Ok(request) => {
                let coding = request.to_query().into_iter().find(|(name, _)| *name == "coding").unwrap().1;
                assert!(is_taken && coding == query[0].1, "{texture} {query:?}");
            }
            Err(RequestError::Invalid(errors)) => {
                assert!(!is_taken && errors[0].pointer == "coding", "{texture} {query:?} {errors:?}");
            }
            Err(other) => panic!("{other}"),
        }
    }
}

proptest! {
    /// Whatever stands in a block: nothing fails, and what comes out is light.
    #[test]
    fn any_light_becomes_blocks(seed in prop::collection::vec(0_u16..=0x7bff, 48), bits in 0_u32..15) {
        // Of many powers, or nearly the same.
        let near = |value: u16| f16::from_bits(if bits == 0 { value } else { (seed[0] >> bits << bits) | (value & ((1 << bits) - 1)) }.min(0x7bff));
        let data: Vec<f32> = seed.iter().map(|value| near(*value).to_f32()).collect();
        prop_assume!(data.iter().any(|value| *value > 1e-4));
        let bytes = file(&packed(Container::Dds, Coding::Bc6h, Mips::None), [4, 4], &RGB, &data, "plane").unwrap();
        for found in decoded(&bytes[148..], 4, 4, 3) {
            prop_assert!((0.0..=65_504.0).contains(&found), "{}", found);
        }
    }

    /// The error is below that of eight steps between the least and the largest value, rounded to 8 bits.
    #[test]
    fn parts_of_a_whole_are_within_their_steps(values in prop::collection::vec(0.0_f32..=1.0, 16), span in 0.0_f32..=1.0, low in 0.0_f32..=1.0) {
        let data: Vec<f32> = values.iter().map(|value| (low + value * span).min(1.0)).collect();
        let bytes = file(&packed(Container::Dds, Coding::Bc4, Mips::None), [4, 4], &["Y"], &data, "plane").unwrap();
        let found = decoded(&bytes[148..], 4, 4, 1);
        let sum: f64 = data.iter().zip(&found).map(|(value, found)| (f64::from(*value) - found).powi(2)).sum();
        let (least, most) = data.iter().fold((1.0_f32, 0.0_f32), |(least, most), value| (least.min(*value), most.max(*value)));
        let step = (f64::from(most - least) + 1.0 / 255.0) / 14.0 + 0.5 / 255.0;
        prop_assert!((sum / 16.0).sqrt() <= step + 1e-6, "{:?} {:?}", data, found);
    }
}

#[test]
fn noise_of_all_colours_over_five_decades_is_the_worst_light() {
    let data = light(64 * 64, 3);
    let bytes = file(&packed(Container::Dds, Coding::Bc6h, Mips::None), [64, 64], &RGB, &data, "plane").unwrap();
    let error = relative(&data, &decoded(&bytes[148..], 64, 64, 3));
    eprintln!("five decades in a block: {error:.4}");
    assert!(error < 0.45, "{error}");
}
