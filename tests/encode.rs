//! What the encoders promise, held against decoders that are not part of the crate.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::collections::HashMap;
use std::io::Cursor;

use exr::image::write::samples::WritableSamples as _;
use exr::meta::attribute::{AttributeValue, SampleType};
use exr::prelude::{ReadChannels as _, ReadLayers as _, Text, Vec2};
use half::f16;
use skyloom::encode::{
    Alpha, Depth, EncodeError, Metadata, Picture, PictureDepth, Pixels, Place, Tonemap, Transfer, to_exr, to_f32,
    to_png,
};
use skyloom::image::{ImageEncoding, ImageLimits, decode};

const RGBA: [&str; 4] = ["R", "G", "B", "A"];

fn pixels<'a>(width: u32, height: u32, channels: &'a [&'a str], data: &'a [f32]) -> Pixels<'a> {
    Pixels { width, height, channels, data, alpha: Alpha::Premultiplied }
}

/// Numbers that halves hold exactly, all different.
fn ramp(count: usize) -> Vec<f32> {
    (0..count).map(|i| i as f32 / 8.0).collect()
}

fn metadata() -> Metadata {
    Metadata {
        domain_extent_m: 20_000.125,
        origin: [1.0, -2.0, 3.5],
        sun_direction: [0.0, -0.6, 0.8],
        base_height_m: 1000.0,
        time_s: 86_400.1,
        axes: "enu".to_owned(),
        texture: "cloud".to_owned(),
        comments: "radiance in kcd/m2".to_owned(),
        scene: "0123abcd".to_owned(),
        software: "skyloom 0.1.0".to_owned(),
        white_luminance: Some(1000.0),
        periodic: true,
        place: None,
    }
}

/// Channels by name as another reader sees them, and the header.
fn read_exr(file: &[u8]) -> (HashMap<String, (SampleType, Vec<f32>)>, exr::meta::header::Header) {
    let meta = exr::meta::MetaData::read_from_buffered(file, true).unwrap();
    exr::meta::MetaData::validate(&meta.headers, true).unwrap();
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .pedantic()
        .from_buffered(Cursor::new(file))
        .unwrap();
    let channels = image.layer_data.channel_data.list.iter().map(|channel| {
        let values = channel.sample_data.values_as_f32().collect();
        (channel.name.to_string(), (channel.sample_data.sample_type(), values))
    });
    (channels.collect(), meta.headers[0].clone())
}

fn channel(data: &[f32], count: usize, place: usize) -> Vec<f32> {
    data.iter().skip(place).step_by(count).copied().collect()
}

#[test]
fn another_reader_finds_names_values_and_sizes_of_half_and_float_files() {
    let names: [&[&str]; 3] = [&["R"], &["R", "G", "B"], &RGBA];
    for channels in names {
        // One texel, taller than wide, and more rows than fit in one block.
        for (width, height) in [(1_u32, 1_u32), (3, 5), (7, 37)] {
            let data = ramp((width * height) as usize * channels.len());
            for (depth, sample_type) in [(Depth::Half, SampleType::F16), (Depth::Float, SampleType::F32)] {
                let file = to_exr(&pixels(width, height, channels, &data), &metadata(), depth).unwrap();
                let (found, header) = read_exr(&file);
                assert_eq!(header.layer_size, Vec2(width as usize, height as usize));
                assert_eq!(found.len(), channels.len());
                for (place, &name) in channels.iter().enumerate() {
                    assert_eq!(found[name], (sample_type, channel(&data, channels.len(), place)), "{name}");
                }
            }
        }
    }
}

#[test]
fn files_longer_than_a_batch_of_blocks_keep_their_rows_in_order() {
    let (width, height) = (2, 64 * 16 * 2 + 5);
    let data: Vec<f32> = (0..width * height).map(|i| i as f32).collect();
    let file = to_exr(&pixels(width, height, &["R"], &data), &metadata(), Depth::Float).unwrap();
    assert_eq!(read_exr(&file).0["R"].1, data);
    assert_eq!(decode(&file, &ImageLimits::default()).unwrap().data, data);
}

#[test]
fn another_reader_finds_the_attributes() {
    let data = ramp(4);
    let place =
        Place { latitude_deg: 52.5, longitude_deg: -13.25, altitude_m: 34.0, utc: "2026:06:21 10:00:00".into() };
    let with_place = Metadata { place: Some(place), ..metadata() };
    let file = to_exr(&pixels(1, 1, &RGBA, &data), &with_place, Depth::Half).unwrap();
    let (_, header) = read_exr(&file);

    let color = header.shared_attributes.chromaticities.unwrap();
    assert_eq!((color.red, color.green), (Vec2(0.64, 0.33), Vec2(0.30, 0.60)));
    assert_eq!((color.blue, color.white), (Vec2(0.15, 0.06), Vec2(0.3127, 0.3290)));
    let own = &header.own_attributes;
    let text = |value: &str| Some(Text::from(value));
    assert_eq!(own.white_luminance, Some(1000.0));
    assert_eq!(own.adopted_neutral, Some(Vec2(0.3127, 0.3290)));
    assert_eq!(own.wrap_mode_name, text("periodic"));
    assert_eq!(own.software_name, text("skyloom 0.1.0"));
    assert_eq!(own.comments, text("radiance in kcd/m2"));
    assert_eq!((own.latitude, own.longitude, own.altitude), (Some(52.5), Some(-13.25), Some(34.0)));
    assert_eq!((own.capture_date.clone(), own.utc_offset), (text("2026:06:21 10:00:00"), Some(0.0)));

    let other = |name: &str| own.other.get(&Text::from(name)).cloned().unwrap_or_else(|| panic!("{name}"));
    let string = |value: &str| AttributeValue::Text(Text::from(value));
    assert_eq!(other("skyloom:domainExtent"), AttributeValue::F64(20_000.125));
    assert_eq!(other("skyloom:baseHeight"), AttributeValue::F64(1000.0));
    assert_eq!(other("skyloom:time"), AttributeValue::F64(86_400.1));
    assert_eq!(other("skyloom:origin"), AttributeValue::FloatVec3((1.0, -2.0, 3.5)));
    assert_eq!(other("skyloom:sunDirection"), AttributeValue::FloatVec3((0.0, -0.6, 0.8)));
    assert_eq!(other("skyloom:axes"), string("enu"));
    assert_eq!(other("skyloom:alpha"), string("premultiplied"));
    assert_eq!(other("skyloom:scene"), string("0123abcd"));
    assert_eq!(other("skyloom:texture"), string("cloud"));

    let plain = Metadata { white_luminance: None, periodic: false, comments: String::new(), ..metadata() };
    let (_, header) = read_exr(&to_exr(&pixels(1, 1, &["R"], &[1.0]), &plain, Depth::Half).unwrap());
    assert_eq!((header.own_attributes.white_luminance, header.own_attributes.comments), (None, None));
    assert_eq!(header.own_attributes.wrap_mode_name, text("clamp"));
    assert!(!header.own_attributes.other.contains_key(&Text::from("skyloom:alpha")));
}

#[test]
fn halves_are_rounded_to_the_nearest_and_clipped_at_65504() {
    let step = 1.0 / 1024.0;
    // A tie goes to the even neighbour; just beside it, to the nearer one.
    let data = [1.0 + 0.5 * step, 1.0 + 1.5 * step, 1.0 + 0.501 * step, 65_504.0, 65_520.0, 1e9, -1e9, 0.0, 3.0e-8];
    let file = to_exr(&pixels(3, 3, &["R"], &data), &metadata(), Depth::Half).unwrap();
    let smallest = f16::from_bits(1).to_f32();
    let expected = [1.0, 1.0 + 2.0 * step, 1.0 + step, 65_504.0, 65_504.0, 65_504.0, -65_504.0, 0.0, smallest];
    assert_eq!(read_exr(&file).0["R"].1, expected);
    let exact = to_exr(&pixels(3, 3, &["R"], &data), &metadata(), Depth::Float).unwrap();
    assert_eq!(read_exr(&exact).0["R"].1, data);
}

#[test]
fn the_same_texture_gives_the_same_bytes_every_time() {
    let data: Vec<f32> = (0..40 * 50 * 4).map(|i| ((i * 7919) % 1013) as f32 / 97.0).collect();
    let texture = pixels(40, 50, &RGBA, &data);
    for depth in [Depth::Half, Depth::Float] {
        let first = to_exr(&texture, &metadata(), depth).unwrap();
        assert!((0..5).all(|_| to_exr(&texture, &metadata(), depth).unwrap() == first));
    }
    for depth in [PictureDepth::Eight, PictureDepth::Sixteen] {
        let picture = Picture { depth, ..Picture::default() };
        assert_eq!(to_png(&texture, &picture).unwrap(), to_png(&texture, &picture).unwrap());
    }
}

/// Samples of a PNG as integers, alpha included.
fn read_png(file: &[u8]) -> (image::ColorType, (u32, u32), Vec<u16>) {
    let image = image::load_from_memory_with_format(file, image::ImageFormat::Png).unwrap();
    let size = (image.width(), image.height());
    let samples = match &image {
        image::DynamicImage::ImageLuma16(buffer) => buffer.as_raw().clone(),
        image::DynamicImage::ImageRgb16(buffer) => buffer.as_raw().clone(),
        image::DynamicImage::ImageRgba16(buffer) => buffer.as_raw().clone(),
        other => other.as_bytes().iter().copied().map(u16::from).collect(),
    };
    (image.color(), size, samples)
}

fn samples(texture: &Pixels<'_>, picture: &Picture) -> Vec<u16> {
    read_png(&to_png(texture, picture).unwrap()).2
}

#[test]
fn pictures_have_row_0_on_top_and_one_channel_is_grey() {
    let data: Vec<f32> = (0..15).map(|i| i as f32 / 255.0).collect();
    let file = to_png(&pixels(3, 5, &["R"], &data), &Picture::mask(PictureDepth::Eight)).unwrap();
    assert_eq!(read_png(&file), (image::ColorType::L8, (3, 5), (0..15).collect()));
    for (depth, kinds) in [
        (PictureDepth::Eight, [image::ColorType::L8, image::ColorType::Rgb8, image::ColorType::Rgba8]),
        (PictureDepth::Sixteen, [image::ColorType::L16, image::ColorType::Rgb16, image::ColorType::Rgba16]),
    ] {
        let names: [&[&str]; 3] = [&["R"], &["R", "G", "B"], &RGBA];
        for (channels, kind) in names.into_iter().zip(kinds) {
            let file = to_png(&pixels(1, 1, channels, &ramp(channels.len())), &Picture::mask(depth)).unwrap();
            assert_eq!(read_png(&file).0, kind);
        }
    }
}

#[test]
fn masks_are_rounded_to_the_nearest_integer_and_clipped() {
    let data = [0.0, 1.0, 0.5, 0.4 / 255.0, 0.6 / 255.0, -3.0, 7.0, 254.6 / 255.0];
    let texture = pixels(2, 4, &["R"], &data);
    assert_eq!(samples(&texture, &Picture::mask(PictureDepth::Eight)), [0, 255, 128, 0, 1, 0, 255, 255]);
    let fine = samples(&texture, &Picture::mask(PictureDepth::Sixteen));
    assert_eq!(fine, [0, 65535, 32768, 103, 154, 0, 65535, 65432]);
}

#[test]
fn without_a_tone_curve_a_picture_is_srgb_with_its_known_values() {
    // Linear values and their samples by IEC 61966-2-1.
    let known =
        [(0.0, 0), (0.001, 3), (0.0031308, 10), (0.01, 25), (0.18, 118), (0.214_041_14, 128), (0.5, 188), (1.0, 255)];
    let data = known.map(|(value, _)| value);
    let picture = Picture { tonemap: Tonemap::None, ..Picture::default() };
    assert_eq!(samples(&pixels(8, 1, &["R"], &data), &picture), known.map(|(_, sample)| sample));
    let fine = Picture { depth: PictureDepth::Sixteen, ..picture };
    assert_eq!(samples(&pixels(2, 1, &["R"], &[0.5, 1.0]), &fine), [48192, 65535]);
}

#[test]
fn the_white_level_becomes_display_white_at_exposure_0_and_each_stop_doubles_the_light() {
    let picture = Picture { white: 8.0, tonemap: Tonemap::None, ..Picture::default() };
    let data = [8.0, 7.0, 4.0, 9.0, 1e30];
    let texture = pixels(5, 1, &["R"], &data);
    assert_eq!(samples(&texture, &picture), [255, 240, 188, 255, 255]);
    let darker = Picture { exposure_stops: -1.0, ..picture };
    assert_eq!(samples(&texture, &darker)[..2], [188, 177]);
    let brighter = Picture { exposure_stops: 1.0, ..picture };
    assert_eq!(samples(&texture, &brighter)[2], 255);
    // Exposure and tone curve are of no effect without a transfer curve.
    let linear = Picture { transfer: Transfer::Linear, tonemap: Tonemap::Filmic, ..brighter };
    assert_eq!(samples(&pixels(1, 1, &["R"], &[0.2]), &linear), [51]);
}

#[test]
fn the_filmic_curve_rises_from_0_to_1_and_has_its_published_values() {
    let curve = |x| Tonemap::Filmic.apply(x);
    assert_eq!((curve(0.0), curve(-5.0), curve(1e30), curve(f32::MAX)), (0.0, 0.0, 1.0, 1.0));
    assert!((curve(1.0) - 2.54 / 3.16).abs() < 1e-6);
    assert!((curve(0.18) - 0.266_9).abs() < 1e-3);
    assert!(curve(7.2) < 1.0 && curve(7.3) == 1.0);
    let steps: Vec<f32> = (0..=2000).map(|i| curve(i as f32 / 200.0)).collect();
    assert!(steps.windows(2).all(|pair| pair[0] <= pair[1]));
    let expected = (255.0 * (1.055 * (2.54_f64 / 3.16).powf(1.0 / 2.4) - 0.055)).round() as u16;
    assert_eq!(samples(&pixels(1, 1, &["R"], &[1.0]), &Picture::default()), [expected]);
}

#[test]
fn premultiplied_colour_becomes_straight_in_a_picture() {
    let data = [0.1, 0.2, 0.4, 0.5, 0.3, 0.3, 0.3, 0.0, 0.25, 0.5, 1.0, 1.0];
    let mask = Picture::mask(PictureDepth::Eight);
    let texture = pixels(3, 1, &RGBA, &data);
    assert_eq!(samples(&texture, &mask), [51, 102, 204, 128, 0, 0, 0, 0, 64, 128, 255, 255]);
    // Division comes before the curves, and alpha gets neither exposure nor curve.
    let picture = Picture { exposure_stops: 1.0, tonemap: Tonemap::None, ..Picture::default() };
    assert_eq!(samples(&texture, &picture)[..4], [170, 231, 255, 128]);
    let straight = Pixels { alpha: Alpha::Straight, ..texture };
    assert_eq!(samples(&straight, &mask)[..4], [26, 51, 102, 128]);
    // A trace of cloud: the quotient overflows and is white.
    let trace = [1.0, 1.0, 0.0, 1e-40];
    for tonemap in [Tonemap::None, Tonemap::Filmic] {
        let picture = Picture { tonemap, ..picture };
        assert_eq!(samples(&pixels(1, 1, &RGBA, &trace), &picture), [255, 255, 0, 0]);
    }
}

#[test]
fn raw_floats_are_little_endian_rows_from_the_top() {
    let data = [1.0, -0.5, 3.0e-39, 65_505.0, 0.0, 7.25];
    let bytes = to_f32(&pixels(1, 2, &["R", "G", "B"], &data)).unwrap();
    let found: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|&value| f32::from_le_bytes(value)).collect();
    assert_eq!(found, data);
    assert_eq!(bytes[..4], [0, 0, 0x80, 0x3f]);
}

#[test]
fn values_that_are_not_finite_are_named_and_never_written() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut data = ramp(3 * 5 * 4);
        data[(4 * 3 + 2) * 4 + 1] = bad;
        let texture = pixels(3, 5, &RGBA, &data);
        let expected = EncodeError::NotFinite { channel: "G".to_owned(), x: 2, y: 4 };
        assert_eq!(to_exr(&texture, &metadata(), Depth::Half).unwrap_err(), expected);
        assert_eq!(to_png(&texture, &Picture::default()).unwrap_err(), expected);
        assert_eq!(to_f32(&texture).unwrap_err(), expected);
    }
}

#[test]
fn shapes_that_do_not_fit_are_refused() {
    let data = ramp(12);
    let wrong: [(u32, u32, &[&str]); 5] =
        [(0, 5, &["R"]), (5, 0, &["R"]), (3, 5, &["R"]), (2, 3, &["R", "G"]), (4, 1, &["B", "G", "R"])];
    for (width, height, channels) in wrong {
        let texture = pixels(width, height, channels, &data);
        assert!(matches!(to_f32(&texture), Err(EncodeError::Shape { .. })), "{width} x {height} {channels:?}");
    }
    let texture = pixels(12, 1, &["R"], &data);
    for white in [0.0, -1.0, f32::NAN] {
        assert!(to_png(&texture, &Picture { white, ..Picture::default() }).is_err());
    }
}

#[test]
fn files_written_here_are_decoded_here() {
    let data = ramp(3 * 5 * 4);
    let texture = pixels(3, 5, &RGBA, &data);
    let colors: Vec<f32> = data.chunks(4).flat_map(|texel| texel[..3].to_vec()).collect();
    for depth in [Depth::Half, Depth::Float] {
        let image = decode(&to_exr(&texture, &metadata(), depth).unwrap(), &ImageLimits::default()).unwrap();
        assert_eq!((image.width, image.height, image.channels, image.encoding), (3, 5, 3, ImageEncoding::Float));
        assert_eq!(image.data, colors);
    }
    let mask: Vec<f32> = (0..15).map(|i| i as f32 / 15.0).collect();
    let texture = pixels(3, 5, &["R"], &mask);
    for (depth, error) in [(PictureDepth::Eight, 0.5 / 255.0), (PictureDepth::Sixteen, 0.5 / 65535.0)] {
        let image = decode(&to_png(&texture, &Picture::mask(depth)).unwrap(), &ImageLimits::default()).unwrap();
        assert_eq!((image.width, image.height, image.channels, image.encoding), (3, 5, 1, ImageEncoding::Integer));
        assert!(image.data.iter().zip(&mask).all(|(found, wanted)| (found - wanted).abs() <= error + 1e-6));
    }
}
