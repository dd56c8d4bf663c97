//! Formats for engines, read back by programs that others wrote (`radiant`, `ktx2`, `ddsfile`), and mip levels as means of light.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use ddsfile::{AlphaMode, Caps2, D3D10ResourceDimension, Dds, DxgiFormat, MiscFlag};
use half::f16;
use proptest::prelude::*;
use skyloom::axes::Axes;
use skyloom::encode::{
    Alpha, Coding, Container, Depth, EncodeError, Format, Frame, Level, Linear, Metadata, Mips, Output, Packed, Pixels,
    encode, levels,
};
use skyloom::projection::{Sphere, SphereLayout};
use skyloom::request::{Request, RequestError};

#[path = "formats/bands.rs"]
mod bands;
#[path = "formats/blocks.rs"]
mod blocks;
#[path = "formats/specular.rs"]
mod specular;

const RGB: [&str; 3] = ["R", "G", "B"];
const RGBA: [&str; 4] = ["R", "G", "B", "A"];
/// Half a step of 11 bits, of 9 and of 8, of the brightest channel.
const HALF: f64 = 1.0 / 2048.0;
const SHARED_9: f64 = 1.0 / 512.0;
const SHARED_8: f64 = 1.0 / 256.0;

fn metadata(projection: &str) -> Metadata {
    Metadata {
        texture: "sky".to_owned(),
        comments: String::new(),
        unit: "kcd/m2".to_owned(),
        scale: 2.5,
        component: None,
        peak: None,
        view: None,
        direction: None,
        eye: None,
        projection: Some(projection.to_owned()),
        layer: None,
        expected_error: None,
        domain_extent_m: 20_000.0,
        origin: [0.0; 3],
        sun_direction: [0.0, -0.6, 0.8],
        base_height_m: 1000.0,
        time_s: 0.5,
        axes: Frame {
            name: "enu".to_owned(),
            words: "x east, y north, z up".to_owned(),
            up: "+z".to_owned(),
            handedness: "right".to_owned(),
        },
        left_azimuth_deg: None,
        disc: None,
        wavelength_nm: None,
        scene: "0123abcd".to_owned(),
        version: "0.2.0+abc".to_owned(),
        white_luminance: None,
        periodic: false,
        place: None,
    }
}

/// Light over five decades, of many colours, with equal texels in a row here and there.
fn light(texels: usize, channels: usize) -> Vec<f32> {
    let texel = |i: usize, c: usize| {
        let i = if i % 50 < 20 { i - i % 50 } else { i };
        let wave = (i as f64 * 0.37 + c as f64).sin();
        if c == 3 {
            (0.5 + 0.5 * wave) as f32
        } else {
            (10_f64.powf((i % 97) as f64 / 20.0 - 2.0) * (1.1 + wave)) as f32
        }
    };
    (0..texels).flat_map(|i| (0..channels).map(move |c| texel(i, c))).collect()
}

fn file(
    output: &Output,
    size: [u32; 2],
    channels: &[&str],
    data: &[f32],
    projection: &str,
) -> Result<Vec<u8>, EncodeError> {
    let alpha = output.linear().alpha;
    let pixels =
        Pixels { width: size[0], height: size[1], channels, data, errors: None, layers: &[], alpha, fraction: false };
    Ok(encode(&pixels, &metadata(projection), output, 1.0)?.bytes)
}

fn packed(container: Container, coding: Coding, mips: Mips) -> Output {
    Output::Packed(Packed { container, linear: Linear::default(), coding, mips })
}

fn halves(bytes: &[u8]) -> Vec<f64> {
    bytes.as_chunks::<2>().0.iter().map(|bytes| f16::from_le_bytes(*bytes).into()).collect()
}

/// Texels of RGB9E5 by the formula of `EXT_texture_shared_exponent`.
fn shared(bytes: &[u8]) -> Vec<f64> {
    let texel = |bytes: &[u8; 4]| {
        let packed = u32::from_le_bytes(*bytes);
        let unit = 2_f64.powi((packed >> 27) as i32 - 24);
        [0, 9, 18].map(|shift| f64::from(packed >> shift & 511) * unit)
    };
    bytes.as_chunks::<4>().0.iter().flat_map(texel).collect()
}

/// The largest difference in parts of the brightest channel of a texel.
fn worst(data: &[f32], found: &[f64], channels: usize) -> f64 {
    assert_eq!(data.len(), found.len());
    let texels = data.chunks(channels).zip(found.chunks(channels));
    let error = |(texel, found): (&[f32], &[f64])| {
        let brightest = f64::from(texel.iter().copied().fold(0.0, f32::max)).max(1e-30);
        texel.iter().zip(found).map(|(a, b)| (f64::from(*a) - b).abs() / brightest).fold(0.0, f64::max)
    };
    texels.map(error).fold(0.0, f64::max)
}

#[test]
fn another_reader_finds_the_light_of_a_radiance_picture() {
    // Sides with runs and without, short and long.
    for size in [[1, 3], [7, 5], [8, 4], [500, 3], [40, 40]] {
        for channels in [1, 3] {
            let data = light((size[0] * size[1]) as usize, channels);
            let names = if channels == 1 { &["Y"][..] } else { &RGB[..] };
            let bytes = file(&Output::new(Format::Hdr), size, names, &data, "equirect").unwrap();
            let text = String::from_utf8_lossy(&bytes[..600.min(bytes.len())]).into_owned();
            assert!(text.starts_with("#?RADIANCE\n") && text.contains("\n# sunDirection = 0 -0.6 0.8\n"), "{text}");
            let image = radiant::load(bytes.as_slice()).unwrap();
            assert_eq!([image.width, image.height], size.map(|side| side as usize));
            // This reader takes mantissas for 255th parts, as three.js does; others take them for 256th parts.
            let part = |value: f32| f64::from(value) * 255.0 / 256.0;
            let found: Vec<f64> = image.data.iter().flat_map(|texel| [texel.r, texel.g, texel.b]).map(part).collect();
            let grey = |value: &f32| [*value; 3];
            let whole: Vec<f32> = if channels == 1 { data.iter().flat_map(grey).collect() } else { data };
            let error = worst(&whole, &found, 3);
            eprintln!("hdr {size:?} {channels}: {error:.5}, {} bytes", bytes.len());
            assert!(error <= SHARED_8, "{error}");
        }
    }
}

#[test]
fn another_reader_finds_every_level_of_a_ktx2_texture() {
    use ktx2::Format as Vk;
    let size = [37, 20];
    for (channels, coding, format, bytes, limit) in [
        (3, Coding::Float(Depth::Half), Vk::R16G16B16A16_SFLOAT, 8, HALF),
        (4, Coding::Float(Depth::Half), Vk::R16G16B16A16_SFLOAT, 8, HALF),
        (1, Coding::Float(Depth::Half), Vk::R16_SFLOAT, 2, HALF),
        (4, Coding::Float(Depth::Float), Vk::R32G32B32A32_SFLOAT, 16, 0.0),
        (3, Coding::Rgb9e5, Vk::E5B9G9R9_UFLOAT_PACK32, 4, SHARED_9),
    ] {
        let names = if channels == 1 { &["Y"][..] } else { &RGBA[..channels] };
        let data = light(37 * 20, channels);
        let bytes_of_file =
            file(&packed(Container::Ktx2, coding, Mips::Means), size, names, &data, "equirect").unwrap();
        let reader = ktx2::Reader::new(bytes_of_file.as_slice()).unwrap();
        let header = reader.header();
        assert_eq!((header.format, header.face_count, header.level_count), (Some(format), 1, 6));
        assert_eq!([header.pixel_width, header.pixel_height], size);
        assert!(reader.writer().unwrap().starts_with("skyloom"));
        assert_eq!(reader.is_alpha_premultiplied(), Some(channels == 4));
        assert_eq!(reader.transfer_function(), Some(ktx2::TransferFunction::Linear));
        assert_eq!(reader.color_primaries(), Some(ktx2::ColorPrimaries::BT709));
        let sun = reader.key_value_data().find(|(key, _)| *key == "skyloom:sunDirection").unwrap().1;
        assert_eq!(sun, b"0 -0.6 0.8\0");
        let expected = levels(Level { width: 37, height: 20, data: data.clone() }, channels, false);
        assert_eq!(reader.levels().len(), expected.len());
        for (level, expected) in reader.levels().zip(&expected) {
            assert_eq!(level.data.len(), expected.width * expected.height * bytes);
            let values = match coding {
                Coding::Rgb9e5 => shared(level.data),
                Coding::Float(Depth::Half) => halves(level.data),
                Coding::Float(Depth::Float) | Coding::Bc6h | Coding::Bc4 => {
                    level.data.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes).into()).collect()
                }
            };
            let wide = values.len() / (expected.width * expected.height);
            let found: Vec<f64> = values.chunks(wide).flat_map(|texel| &texel[..channels]).copied().collect();
            let opaque = values.chunks(wide).all(|texel| wide < 4 || channels == 4 || texel[3] == 1.0);
            let error = worst(&expected.data, &found, channels);
            assert!(error <= limit && opaque, "{coding:?} {channels}: {error}");
        }
        eprintln!("ktx2 {coding:?} {channels} channels: {} bytes", bytes_of_file.len());
    }
}

#[test]
fn another_reader_finds_every_level_of_a_dds_texture() {
    let size = [16, 12];
    for (channels, coding, format, bytes, alpha, limit) in [
        (3, Coding::Float(Depth::Half), DxgiFormat::R16G16B16A16_Float, 8, AlphaMode::Opaque, HALF),
        (4, Coding::Float(Depth::Half), DxgiFormat::R16G16B16A16_Float, 8, AlphaMode::PreMultiplied, HALF),
        (1, Coding::Float(Depth::Half), DxgiFormat::R16_Float, 2, AlphaMode::Unknown, HALF),
        (3, Coding::Rgb9e5, DxgiFormat::R9G9B9E5_SharedExp, 4, AlphaMode::Unknown, SHARED_9),
    ] {
        let names = if channels == 1 { &["Y"][..] } else { &RGBA[..channels] };
        let data = light(16 * 12, channels);
        let file = file(&packed(Container::Dds, coding, Mips::Means), size, names, &data, "plane").unwrap();
        let dds = Dds::read(file.as_slice()).unwrap();
        assert_eq!([dds.get_width(), dds.get_height(), dds.get_num_mipmap_levels()], [16, 12, 5]);
        let header = dds.header10.as_ref().unwrap();
        assert_eq!((header.dxgi_format, header.array_size), (format, 1));
        assert_eq!((header.resource_dimension, header.alpha_mode), (D3D10ResourceDimension::Texture2D, alpha));
        let mut rest = dds.get_data(0).unwrap();
        for level in levels(Level { width: 16, height: 12, data }, channels, false) {
            let (own, after) = rest.split_at(level.width * level.height * bytes);
            rest = after;
            let values = if coding == Coding::Rgb9e5 { shared(own) } else { halves(own) };
            let wide = values.len() / (level.width * level.height);
            let found: Vec<f64> = values.chunks(wide).flat_map(|texel| &texel[..channels]).copied().collect();
            assert!(worst(&level.data, &found, channels) <= limit, "{coding:?} {channels}");
        }
        assert!(rest.is_empty());
    }
}

/// Where a face of a cube looks at a place (s to the right, t downwards, 0 to 1): the Khronos table.
fn khronos(face: usize, s: f64, t: f64) -> [f64; 3] {
    let (a, b) = (2.0 * s - 1.0, 2.0 * t - 1.0);
    let [x, y, z] = match face {
        0 => [1.0, -b, -a],
        1 => [-1.0, -b, a],
        2 => [a, 1.0, b],
        3 => [a, -1.0, -b],
        4 => [a, -b, 1.0],
        _ => [-a, -b, -1.0],
    };
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}

#[test]
fn faces_of_a_cube_lie_where_the_containers_have_them() {
    const SIDE: usize = 8;
    // Each texel tells its direction in the coordinates of the axes, here x east, y north, z up.
    let sphere = Sphere { layout: SphereLayout::Cube, axes: Axes::Enu, eye: [0.0; 3] };
    let size = [SIDE as u32, 6 * SIDE as u32];
    let texel = |i: usize| {
        let place = [(i % SIDE) as f64 + 0.5, (i / SIDE) as f64 + 0.5];
        sphere.direction(place, size).unwrap().map(|value| (value + 1.0) as f32)
    };
    let data: Vec<f32> = (0..6 * SIDE * SIDE).flat_map(texel).collect();
    let coding = Coding::Float(Depth::Half);
    let ktx = file(&packed(Container::Ktx2, coding, Mips::Means), size, &RGB, &data, "cube").unwrap();
    let reader = ktx2::Reader::new(ktx.as_slice()).unwrap();
    let header = reader.header();
    assert_eq!([header.pixel_width, header.pixel_height, header.face_count, header.level_count], [8, 8, 6, 4]);
    let dds = file(&packed(Container::Dds, coding, Mips::Means), size, &RGB, &data, "cube").unwrap();
    let dds = Dds::read(dds.as_slice()).unwrap();
    assert!(dds.header.caps2.contains(Caps2::CUBEMAP | Caps2::CUBEMAP_ALLFACES));
    assert!(dds.header10.as_ref().unwrap().misc_flag.contains(MiscFlag::TEXTURECUBE));
    assert_eq!([dds.get_width(), dds.get_height(), dds.get_num_mipmap_levels()], [8, 8, 4]);
    // In a KTX2 the faces of a level follow one another, in a DDS the levels of a face.
    let level = reader.levels().next().unwrap();
    let face_bytes = 8 * (64 + 16 + 4 + 1);
    assert_eq!((level.data.len(), dds.data.len()), (6 * 64 * 8, 6 * face_bytes));
    for face in 0..6 {
        let of_ktx = halves(&level.data[face * 64 * 8..][..64 * 8]);
        let of_dds = halves(&dds.data[face * face_bytes..][..64 * 8]);
        assert_eq!(of_ktx, of_dds);
        for (i, texel) in of_ktx.chunks(4).enumerate() {
            let expected = khronos(face, ((i % SIDE) as f64 + 0.5) / 8.0, ((i / SIDE) as f64 + 0.5) / 8.0);
            for (value, expected) in texel.iter().zip(expected) {
                assert!((value - 1.0 - expected).abs() <= 2.0 * HALF, "face {face}, texel {i}: {texel:?} {expected}");
            }
        }
        // The one texel at the end is the face's mean: it looks along its axis.
        let last = halves(reader.levels().last().unwrap().data);
        let middle: Vec<f64> = last[4 * face..][..3].iter().map(|value| (value - 1.0).round()).collect();
        assert_eq!(middle, khronos(face, 0.5, 0.5), "face {face}");
    }
}

#[test]
fn values_that_a_coding_cannot_hold_are_refused_by_name() {
    let refused = |output: &Output, data: &[f32]| {
        let error = file(output, [1, 1], &RGB, data, "plane").unwrap_err();
        (error.field(), error.to_string())
    };
    let shared = packed(Container::Ktx2, Coding::Rgb9e5, Mips::None);
    let half = packed(Container::Dds, Coding::Float(Depth::Half), Mips::None);
    for (output, data, field, told) in [
        (shared, [1.0, 70_000.0, 0.0], "scale", "0 to 65408"),
        (shared, [1.0, -0.5, 0.0], "scale", "channel G, column 0, row 0"),
        (shared, [1e-6, 0.0, 0.0], "scale", "0.000015"),
        (Output::new(Format::Hdr), [1.0, -0.5, 0.0], "scale", "the range of format hdr"),
        (half, [1.0, 70_000.0, 0.0], "depth", "allowed: depth 32"),
        (Output::new(Format::F16), [1.0, 70_000.0, 0.0], "scale", "allowed: format f32, or scale"),
        (Output::new(Format::F16), [1e-6, 0.0, 0.0], "scale", "allowed: format f32, or scale"),
    ] {
        let (found, text) = refused(&output, &data);
        assert!(found == Some(field) && text.contains(told), "{found:?} {text}");
    }
    let bytes = file(&Output::new(Format::F16), [1, 1], &RGB, &[1.0, 65_504.0, 0.1], "plane").unwrap();
    assert_eq!(halves(&bytes), [1.0, 65_504.0, f64::from(f16::from_f32(0.1))]);
}

#[test]
fn alpha_finds_no_place_in_three_mantissas() {
    for (texture, format, query, pointer) in [
        ("cloud", "hdr", None, "format"),
        ("cloud", "ktx2", Some("rgb9e5"), "coding"),
        ("sky", "hdr", Some("rgb9"), "coding"),
    ] {
        let query: Vec<_> = query.map(|coding| ("coding".to_owned(), coding.to_owned())).into_iter().collect();
        let Err(RequestError::Invalid(errors)) = Request::parse(texture, format, &query) else { panic!("{texture}") };
        assert_eq!(errors[0].pointer, pointer);
    }
    // What does not touch the file has no effect.
    let query = [("coding", "rgb9e5"), ("mips", "true")].map(|(name, value)| (name.to_owned(), value.to_owned()));
    assert_eq!(Request::parse("cloud", "exr", &query).unwrap(), Request::parse("cloud", "exr", &[]).unwrap());
    assert_eq!(
        Request::parse("sky", "dds", &query).unwrap().to_query(),
        query.map(|(name, value)| (if name == "mips" { "mips" } else { "coding" }, value))
    );
}

/// Mean light of a level: colours times alpha where they were divided by it.
fn means(level: &Level, channels: usize, straight: bool) -> Vec<f64> {
    let mut sums = vec![0.0; channels];
    for texel in level.data.chunks(channels) {
        let alpha = if straight && channels == 4 { f64::from(texel[3]) } else { 1.0 };
        for (c, value) in texel.iter().enumerate() {
            sums[c] += if c < 3 { alpha } else { 1.0 } * f64::from(*value);
        }
    }
    sums.iter().map(|sum| sum / (level.width * level.height) as f64).collect()
}

proptest! {
    /// Whatever the sides, odd ones too: no level has more light or less.
    #[test]
    fn every_level_has_the_mean_of_the_first(width in 1_usize..40, height in 1_usize..40, channels in prop::sample::select(vec![1_usize, 3, 4]), straight: bool, seed in 0_u32..1000) {
        let mut data = light(width * height, channels);
        data.rotate_left(seed as usize % (width * height * channels));
        let alpha = |i: usize| (((i as u32 + seed) * 7919) % 101) as f32 / 100.0;
        if channels == 4 {
            data.iter_mut().skip(3).step_by(4).enumerate().for_each(|(i, value)| *value = alpha(i));
        }
        let all = levels(Level { width, height, data }, channels, straight);
        prop_assert_eq!(all.len(), width.max(height).ilog2() as usize + 1);
        let first = means(&all[0], channels, straight);
        for (n, level) in all.iter().enumerate() {
            prop_assert_eq!([level.width, level.height], [(width >> n).max(1), (height >> n).max(1)]);
            for (mean, first) in means(level, channels, straight).iter().zip(&first) {
                // Each level is rounded to floats.
                prop_assert!((mean - first).abs() <= 6e-7 * first.abs() + 1e-9, "level {}: {} {}", n, mean, first);
            }
        }
    }
}

#[test]
fn straight_colours_are_weighted_by_what_is_seen_of_them() {
    // A clear texel of any colour beside a white one.
    let picture = Level { width: 2, height: 1, data: vec![1.0, 1.0, 1.0, 0.5, 9.0, 9.0, 0.0, 0.0] };
    assert_eq!(levels(picture.clone(), 4, true)[1].data, [1.0, 1.0, 1.0, 0.25]);
    assert_eq!(levels(picture, 4, false)[1].data, [5.0, 5.0, 0.5, 0.25]);
    let bytes = file(
        &Output::Packed(Packed {
            linear: Linear { scale: 1.0, alpha: Alpha::Straight },
            mips: Mips::Means,
            ..Packed::new(Container::Ktx2)
        }),
        [2, 1],
        &RGBA,
        &[1.0, 1.0, 1.0, 0.5, 9.0, 9.0, 0.0, 0.0],
        "plane",
    )
    .unwrap();
    let reader = ktx2::Reader::new(bytes.as_slice()).unwrap();
    assert_eq!(reader.is_alpha_premultiplied(), Some(false));
    assert_eq!(halves(reader.levels().last().unwrap().data), [1.0, 1.0, 1.0, 0.25]);
}
