//! What the encoders promise, held against decoders that are not part of the crate.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::collections::{BTreeMap, HashMap};
use std::io::{Cursor, Seek, SeekFrom, Write};

use exr::image::write::samples::WritableSamples as _;
use exr::meta::attribute::{AttributeValue, SampleType};
use exr::prelude::{ReadChannels as _, ReadLayers as _, Text, Vec2};
use half::f16;
use proptest::prelude::*;
use skyloom::encode::{
    Alpha, At, Depth, EncodeError, Encoded, Exposure, Format, Frame, Linear, Metadata, Output, Picture, PictureDepth,
    Pixels, Place, Tonemap, Written, encode, encode_to, to_exr, to_f32, to_png, to_webp,
};
use skyloom::image::{ImageEncoding, ImageLimits, decode};

const RGBA: [&str; 4] = ["R", "G", "B", "A"];

fn pixels<'a>(width: u32, height: u32, channels: &'a [&'a str], data: &'a [f32]) -> Pixels<'a> {
    Pixels { width, height, channels, data, errors: None, layers: &[], alpha: Alpha::Premultiplied, fraction: false }
}

/// Texels in one row.
fn row<'a>(channels: &'a [&'a str], data: &'a [f32]) -> Pixels<'a> {
    pixels((data.len() / channels.len()) as u32, 1, channels, data)
}

fn exr(texture: &Pixels<'_>, depth: Option<Depth>) -> Encoded {
    to_exr(texture, &metadata(), depth).unwrap()
}

/// Numbers that halves hold exactly, all different.
fn ramp(count: usize) -> Vec<f32> {
    (0..count).map(|i| i as f32 / 8.0).collect()
}

fn metadata() -> Metadata {
    Metadata {
        texture: "cloud".to_owned(),
        comments: "radiance".to_owned(),
        unit: "kcd/m2".to_owned(),
        scale: 1.0,
        component: None,
        peak: None,
        view: None,
        direction: None,
        eye: None,
        projection: None,
        layer: None,
        expected_error: None,
        domain_extent_m: 20_000.125,
        origin: [1.0, -2.0, 3.5],
        sun_direction: [-0.0, -0.6, 0.8],
        base_height_m: 1000.0,
        time_s: 123_456_789.1,
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
    let names: [&[&str]; 3] = [&["Y"], &["R", "G", "B"], &RGBA];
    for channels in names {
        // One texel, taller than wide, and more rows than fit in one block.
        for (width, height) in [(1_u32, 1_u32), (3, 5), (7, 37)] {
            let data = ramp((width * height) as usize * channels.len());
            for (depth, sample_type) in [(Depth::Half, SampleType::F16), (Depth::Float, SampleType::F32)] {
                let file = exr(&pixels(width, height, channels, &data), Some(depth));
                assert_eq!((file.bits, file.reason), (depth.bits(), None));
                let (found, header) = read_exr(&file.bytes);
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
    let file = exr(&pixels(width, height, &["Y"], &data), Some(Depth::Float)).bytes;
    assert_eq!(read_exr(&file).0["Y"].1, data);
    assert_eq!(decode(&file, &ImageLimits::default()).unwrap().data, data);
}

/// Attributes of skyloom's own without their prefix, as text, and the header.
fn own_attributes(file: &[u8]) -> (BTreeMap<String, String>, exr::meta::header::Header) {
    let (_, header) = read_exr(file);
    let text = |value: &AttributeValue| match value {
        AttributeValue::Text(text) => format!("\"{text}\""),
        AttributeValue::F32(value) => value.to_string(),
        AttributeValue::I32(value) => format!("int {value}"),
        AttributeValue::FloatVec2(value) => format!("{:?}", (value.0, value.1)),
        AttributeValue::FloatVec3(value) => format!("{value:?}"),
        other => panic!("a type that stock readers do not know: {other:?}"),
    };
    let named = header.own_attributes.other.iter().map(|(name, value)| {
        (name.to_string().strip_prefix("skyloom:").unwrap_or_else(|| panic!("{name}")).to_owned(), text(value))
    });
    (named.collect(), header)
}

#[test]
fn another_reader_finds_the_attributes() {
    let place =
        Place { latitude_deg: 52.5, longitude_deg: -13.25, altitude_m: 34.0, utc: "2026:06:21 10:00:00".into() };
    let whole = Metadata {
        component: Some("diffuse".to_owned()),
        peak: Some(true),
        view: Some("above".to_owned()),
        direction: Some([40.0, 20.5]),
        eye: Some([0.5, -12_000.0, 14_000.0]),
        projection: Some("plane".to_owned()),
        left_azimuth_deg: Some(270.0),
        disc: Some(false),
        wavelength_nm: Some(440.5),
        layer: Some(2),
        expected_error: Some(0.015_625),
        scale: 1000.0,
        place: Some(place),
        ..metadata()
    };
    let file = to_exr(&pixels(1, 1, &RGBA, &ramp(4)), &whole, None).unwrap();
    let (found, header) = own_attributes(&file.bytes);

    let color = header.shared_attributes.chromaticities.unwrap();
    assert_eq!((color.red, color.green), (Vec2(0.64, 0.33), Vec2(0.30, 0.60)));
    assert_eq!((color.blue, color.white), (Vec2(0.15, 0.06), Vec2(0.3127, 0.3290)));
    let own = &header.own_attributes;
    let text = |value: &str| Some(Text::from(value));
    assert_eq!(own.white_luminance, Some(1000.0));
    assert_eq!(own.adopted_neutral, Some(Vec2(0.3127, 0.3290)));
    assert_eq!(own.wrap_mode_name, text("periodic"));
    assert_eq!(own.environment_map, Some(exr::meta::attribute::EnvironmentMap::LatitudeLongitude));
    assert_eq!(own.software_name, text("skyloom 0.2.0+abc"));
    assert_eq!(own.comments, text("radiance"));
    assert_eq!((own.latitude, own.longitude, own.altitude), (Some(52.5), Some(-13.25), Some(34.0)));
    assert_eq!((own.capture_date.clone(), own.utc_offset), (text("2026:06:21 10:00:00"), Some(0.0)));

    let always = [
        ("alpha", "\"premultiplied\""),
        ("axes", "\"enu\""),
        ("baseHeight", "1000"),
        ("depth", "\"half\""),
        ("domainExtent", "20000.125"),
        ("frame", "\"x east, y north, z up\""),
        ("handedness", "\"right\""),
        ("origin", "(1.0, -2.0, 3.5)"),
        ("scale", "1000"),
        ("scene", "\"0123abcd\""),
        ("sunDirection", "(0.0, -0.6, 0.8)"),
        ("texture", "\"cloud\""),
        // The nearest float, and all digits.
        ("time", "123456790"),
        ("timeExact", "\"123456789.1\""),
        ("unit", "\"kcd/m2\""),
        ("up", "\"+z\""),
        ("version", "\"0.2.0+abc\""),
    ];
    let applicable = [
        ("component", "\"diffuse\""),
        ("direction", "(40.0, 20.5)"),
        ("disc", "\"false\""),
        ("expectedError", "0.015625"),
        ("eye", "(0.5, -12000.0, 14000.0)"),
        ("layer", "int 2"),
        ("leftAzimuth", "270"),
        ("peak", "\"true\""),
        ("projection", "\"plane\""),
        ("view", "\"above\""),
        ("wavelength", "440.5"),
    ];
    let texts = |list: &[(&str, &str)]| list.iter().map(|&(name, value)| (name.into(), value.into())).collect();
    let mut all: BTreeMap<String, String> = texts(&always);
    all.append(&mut texts(&applicable));
    assert_eq!(found, all);

    let plain =
        Metadata { white_luminance: None, periodic: false, comments: String::new(), scale: 1000.0, ..metadata() };
    let (found, header) = own_attributes(&to_exr(&row(&["Y"], &[1.0]), &plain, None).unwrap().bytes);
    assert_eq!((header.own_attributes.white_luminance, header.own_attributes.comments), (None, None));
    assert_eq!(header.own_attributes.wrap_mode_name, text("clamp"));
    let mut without_alpha: BTreeMap<String, String> = texts(&always);
    without_alpha.remove("alpha");
    assert_eq!(found, without_alpha);
}

#[test]
fn halves_are_rounded_to_the_nearest() {
    let step = 1.0 / 1024.0;
    // A tie goes to the even neighbour; just beside it, to the nearer one; 65519 is nearer to the largest than to 65536.
    let data = [1.0 + 0.5 * step, 1.0 + 1.5 * step, 1.0 + 0.501 * step, 65_504.0, 65_519.0, -65_519.0, 0.0, 3.0e-8];
    let smallest = f16::from_bits(1).to_f32();
    let expected = [1.0, 1.0 + 2.0 * step, 1.0 + step, 65_504.0, 65_504.0, -65_504.0, 0.0, smallest];
    for depth in [None, Some(Depth::Half)] {
        let file = exr(&row(&["Y"], &data), depth);
        assert_eq!((file.bits, read_exr(&file.bytes).0["Y"].1.as_slice()), (16, &expected[..]));
    }
    assert_eq!(read_exr(&exr(&row(&["Y"], &data), Some(Depth::Float)).bytes).0["Y"].1, data);
}

#[test]
fn what_halves_cannot_hold_is_written_as_floats_and_the_file_says_why() {
    let cases: [(&[&str], &[f32], Option<&str>); 12] = [
        (
            &["Y"],
            &[1.0, 98_000.5],
            Some("largest value 98000.5 (channel Y, column 1, row 0) is above 65504, the largest half float"),
        ),
        (
            &["Y"],
            &[-65_520.0, 1.0],
            Some("largest value -65520 (channel Y, column 0, row 0) is above 65504, the largest half float"),
        ),
        (
            &["Y"],
            &[3e30, -3e30],
            Some("largest value 3e30 (channel Y, column 0, row 0) is above 65504, the largest half float"),
        ),
        (&["Y"], &[0.0625, 1e-9], None),
        (&["Y"], &[0.0624, 0.0], Some("largest value 0.0624 of channel Y is below 0.0625: halves lose digits")),
        (&["Y"], &[-3e-6, 0.0], Some("largest value -3e-6 of channel Y is below 0.0625: halves lose digits")),
        (&["Y"], &[0.0, -0.0], None),
        // Each channel by itself, so that a band of its own unit keeps its digits; a colour without blue is no such band.
        (
            &["R", "G", "B"],
            &[5.0, 0.01, 3.0],
            Some("largest value 0.01 of channel G is below 0.0625: halves lose digits"),
        ),
        (&["R", "G", "B"], &[5.0, 4.0, 0.0], None),
        // Alpha is no light: neither does it hide dark colours nor do faint clouds need floats.
        (&RGBA, &[5.0, 4.0, 3.0, 1e-5], None),
        (&RGBA, &[1e-5, 2e-5, 3e-5, 1.0], Some("largest value 1e-5 of channel R is below 0.0625: halves lose digits")),
        (&RGBA, &[0.0, 0.0, 0.0, 0.5], None),
    ];
    for (channels, data, wanted) in cases {
        let wanted = wanted.map(str::to_owned);
        let file = exr(&row(channels, data), None);
        let told = wanted.as_ref().map_or_else(|| "\"half\"".to_owned(), |reason| format!("\"float: {reason}\""));
        assert_eq!(own_attributes(&file.bytes).0["depth"], told, "{channels:?} {data:?}");
        assert_eq!((file.bits, file.reason), (if wanted.is_some() { 32 } else { 16 }, wanted));
        let sample_type = if file.bits == 16 { SampleType::F16 } else { SampleType::F32 };
        assert!(read_exr(&file.bytes).0.values().all(|(found, _)| *found == sample_type), "one type in the whole file");
    }
    let asked = exr(&row(&["Y"], &[1e9]), Some(Depth::Float));
    assert_eq!((own_attributes(&asked.bytes).0["depth"].as_str(), asked.reason), ("\"float\"", None));
}

#[test]
fn halves_asked_for_by_name_are_refused_where_they_cannot_hold_the_texture() {
    let refused = |channels: &[&str], data: &[f32], scale: f64| {
        let error = to_exr(&row(channels, data), &Metadata { scale, ..metadata() }, Some(Depth::Half)).unwrap_err();
        assert_eq!(error.field(), Some("depth"));
        error
    };
    let data = [1.0, 2.0, 3.0, 4.0, 98_000.0, 6.0];
    let error = refused(&["R", "G", "B"], &data, 1000.0);
    let at = At { channel: "G".to_owned(), x: 1, y: 0 };
    assert_eq!(error, EncodeError::AboveHalf { value: 98_000.0, at, instead: "depth 32", scale: Some(660.0) });
    let text = "largest value 98000 (channel G, column 1, row 0) is above 65504, the largest half float; \
                allowed: depth 32, or scale 660";
    assert_eq!(error.to_string(), text);
    // With the scale that it proposes the texture fits.
    assert_eq!(exr(&row(&["R", "G", "B"], &data.map(|value| value * 0.66)), Some(Depth::Half)).bits, 16);
    let text = "largest value 3e-6 (channel Y, column 0, row 0) is below 0.000061, where half floats lose their digits; \
                allowed: depth 32, or scale 21000";
    assert_eq!(refused(&["Y"], &[3e-6, 1e-6], 1.0).to_string(), text);
    // Beyond what a scale may be, none is proposed.
    let text =
        "largest value 1e15 (channel Y, column 0, row 0) is above 65504, the largest half float; allowed: depth 32";
    assert_eq!(refused(&["Y"], &[1e15], 1.0).to_string(), text);
    // Tiny values are the caller's wish while the brightest has its digits.
    let wished: [(&[&str], &[f32]); 3] =
        [(&["Y"], &[6.2e-5, 1e-9]), (&["R", "G", "B"], &[1.0, 1e-6, 1e-7]), (&["Y"], &[0.0])];
    for (channels, data) in wished {
        assert_eq!(exr(&row(channels, data), Some(Depth::Half)).bits, 16);
    }
}

#[test]
fn standard_errors_are_a_layer_of_their_own() {
    let (data, errors) = (ramp(8), [0.5, 0.25, 0.125, 1e-6, 0.0, 2.0]);
    let texture = Pixels { errors: Some(&errors), ..pixels(1, 2, &RGBA, &data) };
    let file = exr(&texture, None);
    let found = read_exr(&file.bytes).0;
    let mut names: Vec<_> = found.keys().map(String::as_str).collect();
    names.sort_unstable();
    assert_eq!(names, ["A", "B", "G", "R", "error.B", "error.G", "error.R"]);
    // They may be small, so the file stays half.
    assert_eq!((found["error.G"].1.as_slice(), file.bits), (&[0.25, 0.0][..], 16));
    assert_eq!(found["A"].1, [data[3], data[7]]);

    let large = [0.5, 0.25, 0.125, 1.0, 70_000.0, 2.0];
    let reason = exr(&Pixels { errors: Some(&large), ..texture }, None).reason.unwrap();
    assert!(reason.starts_with("largest value 70000 (channel error.G, column 0, row 1) is above"), "{reason}");
    let grey = Pixels { errors: Some(&[0.5]), ..row(&["Y"], &[1.0]) };
    assert_eq!(read_exr(&exr(&grey, None).bytes).0["error.Y"].1, [0.5]);
    let bad = Pixels { errors: Some(&[f32::NAN]), ..grey };
    let at = At { channel: "error.Y".to_owned(), x: 0, y: 0 };
    assert_eq!(to_exr(&bad, &metadata(), None).unwrap_err(), EncodeError::NotFinite(at));
    let short = Pixels { errors: Some(&errors[..5]), ..texture };
    assert!(matches!(to_exr(&short, &metadata(), None), Err(EncodeError::Shape { .. })));
}

#[test]
fn texels_are_scaled_and_divided_by_alpha_as_the_output_says() {
    let finished = |output: Output, channels: &[&str], data: &[f32]| {
        let (mut data, mut errors) = (data.to_vec(), vec![1.0; data.len() / channels.len() * channels.len().min(3)]);
        output.finish(1, channels, &mut data, &mut [&mut errors]).map(|()| (data, errors))
    };
    let linear = |scale, alpha| Output::F32 { linear: Linear { scale, alpha } };
    let texels = [1.0, 2.0, 4.0, 0.5, 3.0, 3.0, 3.0, 0.0, 1e-30, 1e-30, 1e-30, 1e-25];
    let scaled = vec![10.0, 20.0, 40.0, 0.5, 30.0, 30.0, 30.0, 0.0, 1e-29, 1e-29, 1e-29, 1e-25];
    let premultiplied = finished(linear(10.0, Alpha::Premultiplied), &RGBA, &texels).unwrap();
    assert_eq!(premultiplied, (scaled.clone(), vec![10.0; 9]));
    let straight = vec![20.0, 40.0, 80.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-25];
    let errors = vec![20.0, 20.0, 20.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(finished(linear(10.0, Alpha::Straight), &RGBA, &texels).unwrap(), (straight, errors));
    // Without alpha there is nothing to divide by.
    let grey = finished(linear(10.0, Alpha::Straight), &["Y"], &[0.5]).unwrap();
    assert_eq!(grey, (vec![5.0], vec![10.0]));
    let mask = Output::Png(Picture::Mask { scale: 10.0, depth: PictureDepth::Eight });
    assert_eq!(finished(mask, &RGBA, &texels).unwrap().0, scaled);
    for untouched in Format::ALL.map(Output::new) {
        assert_eq!(finished(untouched, &RGBA, &texels).unwrap(), (texels.to_vec(), vec![1.0; 9]));
    }
    let overflow = finished(linear(1e6, Alpha::Premultiplied), &["R", "G", "B"], &[1.0, 1.0, 1.0, 1.0, 1e33, 1e38]);
    let at = At { channel: "G".to_owned(), x: 0, y: 1 };
    assert_eq!(overflow.unwrap_err(), EncodeError::Overflow { field: "scale", value: 1e33, at });
    let overflow = finished(linear(2.0, Alpha::Straight), &RGBA, &[1.0, 1.0, 1e38, 1e-6]).unwrap_err();
    assert_eq!(overflow.field(), Some("alpha"));
    assert!(overflow.to_string().contains("value 1e38 (channel B, column 0, row 0)"), "{overflow}");
}

/// A file that takes so many bytes at most, and notes how long the longest piece was that it was given.
struct Disk {
    file: Cursor<Vec<u8>>,
    room: u64,
    longest: usize,
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        if self.file.position() + bytes.len() as u64 > self.room {
            return Err(std::io::Error::other("no room"));
        }
        self.longest = self.longest.max(bytes.len());
        self.file.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Seek for Disk {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.file.seek(to)
    }
}

#[test]
fn a_file_written_band_by_band_is_the_same_and_a_full_disk_is_told() {
    let [width, height] = [512, 2100];
    let noise = |place: u32| f32::from(place.wrapping_mul(2_654_435_761).to_be_bytes()[0]) / 255.0;
    let data: Vec<f32> = (0..width * height * 3).map(noise).collect();
    let texture = pixels(width, height, &["R", "G", "B"], &data);
    for format in Format::ALL {
        let output = Output::new(format);
        let whole = encode(&texture, &metadata(), &output, 1.0).unwrap();
        let write = |room: u64| {
            let mut disk = Disk { file: Cursor::default(), room, longest: 0 };
            let written = encode_to(&texture, &metadata(), &output, 1.0, &mut disk);
            (written, disk)
        };
        let (written, disk) = write(u64::MAX);
        let Written { bits, reason } = written.unwrap();
        assert_eq!((bits, &reason), (whole.bits, &whole.reason), "{format:?}");
        assert!(disk.file.get_ref() == &whole.bytes, "{format:?}");
        // Of these no more is made at a time than a band: a million values, or a block of lines.
        if matches!(format, Format::Exr | Format::F16 | Format::Hdr) {
            assert!(disk.longest * 3 < whole.bytes.len() * 2, "{format:?}: {} of {}", disk.longest, whole.bytes.len());
        }
        let (refused, _) = write(whole.bytes.len() as u64 - 1);
        assert!(matches!(refused, Err(EncodeError::Codec(_))), "{format:?}: {refused:?}");
    }
}

#[test]
fn one_entry_writes_every_format() {
    let data = [0.25, 0.5];
    let texture = row(&["Y"], &data);
    let file = |output: Output| encode(&texture, &metadata(), &output, 1.0).unwrap();
    let depth = Some(Depth::Float);
    let float = file(Output::Exr { linear: Linear::default(), depth });
    assert_eq!(float, exr(&texture, depth));
    assert_eq!(file(Output::new(Format::Exr)), exr(&texture, None));
    assert_eq!(
        (file(Output::new(Format::F32)).bytes, 32),
        (to_f32(&texture).unwrap(), file(Output::new(Format::F32)).bits)
    );
    for (depth, bits) in [(PictureDepth::Eight, 8), (PictureDepth::Sixteen, 16)] {
        let picture = Picture::mask(depth);
        let bytes = to_png(&texture, &picture, 1.0).unwrap();
        assert_eq!(file(Output::Png(picture)), Encoded { bytes, bits, reason: None });
    }
    let picture = Picture::mask(PictureDepth::Eight);
    let bytes = to_webp(&texture, &picture, 1.0).unwrap();
    assert_eq!(file(Output::Webp(picture)), Encoded { bytes, bits: 8, reason: None });
    for format in Format::ALL {
        assert_eq!(Output::new(format).format(), format);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_texture_keeps_its_digits_or_is_refused_by_name(
        values in proptest::collection::vec(prop_oneof![
            3 => any::<f32>().prop_filter("finite", |value| value.is_finite()),
            3 => -70_000_f32..70_000.0,
            2 => -0.1_f32..0.1,
            1 => Just(0.0_f32),
        ], 3..30),
        magnitude in -30..=0_i32,
        colours in any::<bool>(),
    ) {
        let factor = 2_f32.powi(magnitude);
        let channels: &[&str] = if colours { &["R", "G", "B"] } else { &["Y"] };
        let count = values.len() / channels.len() * channels.len();
        let data: Vec<f32> = values[..count].iter().map(|value| value * factor).collect();
        let texture = row(channels, &data);
        let largest = |values: &[f32]| values.iter().fold(0.0_f32, |most, value| most.max(value.abs()));
        let holds = |file: &[u8], dark: fn(f32) -> f32| {
            let found = read_exr(file).0;
            channels.iter().enumerate().all(|(place, &name)| {
                let (wanted, (_, found)) = (channel(&data, channels.len(), place), &found[name]);
                let brightest = largest(&wanted);
                wanted.iter().zip(found).all(|(wanted, found)| {
                    let error = (wanted - found).abs();
                    // Halves below 2^-14 have a fixed step.
                    error <= wanted.abs() * 2_f32.powi(-11) || (wanted.abs() < dark(brightest) && error <= 2_f32.powi(-25))
                })
            })
        };
        // By default whatever is not 1024 times darker than the brightest of its channel keeps its digits.
        let default = exr(&texture, None);
        prop_assert!(holds(&default.bytes, |brightest| brightest / 1024.0));
        let exact = exr(&texture, Some(Depth::Float));
        prop_assert_eq!(default.bits == 16, default.reason.is_none());
        for file in [Some(&exact), Some(&default).filter(|file| file.bits == 32)].into_iter().flatten() {
            for (place, &name) in channels.iter().enumerate() {
                prop_assert_eq!(&read_exr(&file.bytes).0[name].1, &channel(&data, channels.len(), place));
            }
        }
        match to_exr(&texture, &metadata(), Some(Depth::Half)) {
            Ok(file) => {
                prop_assert!(holds(&file.bytes, |_| 2_f32.powi(-14)));
                let brightest = largest(&data);
                prop_assert!(brightest == 0.0 || (2_f32.powi(-14)..65_520.0).contains(&brightest));
            }
            Err(error) => prop_assert_eq!(error.field(), Some("depth")),
        }
        match to_png(&texture, &Picture::mask(PictureDepth::Sixteen), 1.0) {
            Ok(file) => {
                let near = |(sample, value): (&u16, &f32)| (f32::from(*sample) / 65535.0 - value).abs() < 0.51 / 65535.0;
                prop_assert!(read_png(&file).2.iter().zip(&data).all(near));
            }
            Err(error) => prop_assert_eq!(error.field(), Some("scale")),
        }
    }
}

#[test]
fn the_same_texture_gives_the_same_bytes_every_time() {
    let data: Vec<f32> = (0..40 * 50 * 4).map(|i| ((i * 7919) % 1013) as f32 / 97.0).collect();
    let texture = pixels(40, 50, &RGBA, &data);
    for depth in [Depth::Half, Depth::Float] {
        let first = exr(&texture, Some(depth));
        assert!((0..5).all(|_| exr(&texture, Some(depth)) == first));
    }
    for depth in [PictureDepth::Eight, PictureDepth::Sixteen] {
        let picture = display(0.0, Tonemap::Filmic, depth);
        assert_eq!(to_png(&texture, &picture, 1.0).unwrap(), to_png(&texture, &picture, 1.0).unwrap());
    }
}

fn display(exposure_stops: f64, tonemap: Tonemap, depth: PictureDepth) -> Picture {
    Picture::Display { exposure: Exposure::Stops(exposure_stops), tonemap, depth, dither: false }
}

/// A picture of 8 bits without a tone curve.
fn plain(exposure_stops: f64) -> Picture {
    display(exposure_stops, Tonemap::None, PictureDepth::Eight)
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

#[test]
fn a_webp_has_the_samples_of_a_png_in_fewer_bytes() {
    let side = 96_usize;
    let value = |i: usize| ((i % side) as f32 * 0.011 + (i / side) as f32 * 0.003).fract();
    for channels in [&["Y"][..], &["R", "G", "B"], &["R", "G", "B", "A"]] {
        let count = channels.len();
        let data: Vec<f32> =
            (0..side * side).flat_map(|i| (0..count).map(move |c| value(i) * (1.0 - 0.2 * c as f32))).collect();
        let texture = pixels(side as u32, side as u32, channels, &data);
        for picture in [Picture::default(), Picture::mask(PictureDepth::Eight)] {
            // Colours of a mask are divided by alpha, which may leave them outside.
            let picture = if count == 4 { Picture::default() } else { picture };
            let (png, webp) = (to_png(&texture, &picture, 1.0).unwrap(), to_webp(&texture, &picture, 1.0).unwrap());
            let read = |file: &[u8], format| image::load_from_memory_with_format(file, format).unwrap().into_rgba8();
            assert!(read(&png, image::ImageFormat::Png) == read(&webp, image::ImageFormat::WebP), "{channels:?}");
            assert!(webp.len() < png.len(), "{channels:?}: {} and {} bytes", webp.len(), png.len());
        }
    }
    let wide = vec![0.5; 16_384];
    let error = to_webp(&row(&["Y"], &wide), &Picture::default(), 1.0).unwrap_err();
    assert_eq!(error, EncodeError::TooWide { width: 16_384, height: 1 });
    assert_eq!(error.field(), Some("size"));
}

fn samples(texture: &Pixels<'_>, picture: &Picture) -> Vec<u16> {
    read_png(&to_png(texture, picture, 1.0).unwrap()).2
}

#[test]
fn pictures_have_row_0_on_top_and_one_channel_is_grey() {
    let data: Vec<f32> = (0..15).map(|i| i as f32 / 255.0).collect();
    let file = to_png(&pixels(3, 5, &["Y"], &data), &Picture::mask(PictureDepth::Eight), 1.0).unwrap();
    assert_eq!(read_png(&file), (image::ColorType::L8, (3, 5), (0..15).collect()));
    for (depth, kinds) in [
        (PictureDepth::Eight, [image::ColorType::L8, image::ColorType::Rgb8, image::ColorType::Rgba8]),
        (PictureDepth::Sixteen, [image::ColorType::L16, image::ColorType::Rgb16, image::ColorType::Rgba16]),
    ] {
        let names: [&[&str]; 3] = [&["Y"], &["R", "G", "B"], &RGBA];
        for (channels, kind) in names.into_iter().zip(kinds) {
            let file = to_png(&pixels(1, 1, channels, &ramp(channels.len())), &Picture::mask(depth), 1.0).unwrap();
            assert_eq!(read_png(&file).0, kind);
        }
    }
}

#[test]
fn masks_are_rounded_to_the_nearest_integer_and_never_cut_off() {
    let data = [0.0, 1.0, 0.5, 0.4 / 255.0, 0.6 / 255.0, 254.6 / 255.0];
    let texture = row(&["Y"], &data);
    assert_eq!(samples(&texture, &Picture::mask(PictureDepth::Eight)), [0, 255, 128, 0, 1, 255]);
    let fine = samples(&texture, &Picture::mask(PictureDepth::Sixteen));
    assert_eq!(fine, [0, 65535, 32768, 103, 154, 65432]);
    // Half a step outside is rounding.
    let outside = [1.0 + 0.4 / 255.0, -0.4 / 255.0];
    let texture = row(&["Y"], &outside);
    assert_eq!(samples(&texture, &Picture::mask(PictureDepth::Eight)), [255, 0]);
    let refused = |texture: &Pixels<'_>, scale: f64| {
        let mask = Picture::Mask { scale, depth: PictureDepth::Sixteen };
        let error = to_png(texture, &mask, 1.0).unwrap_err();
        assert_eq!(error.field(), Some("scale"));
        error.to_string()
    };
    assert!(refused(&texture, 1.0).contains("column 0, row 0"));
    let text = "value 98000 (channel G, column 0, row 0) is outside 0 to 1, the range of a PNG with encoding linear; \
                allowed: formats exr, f32, or scale 0.01";
    assert_eq!(refused(&row(&["R", "G", "B"], &[7.0, 98_000.0, -9.0]), 1000.0), text);
    assert!(refused(&row(&["Y"], &[-9.0]), 1.0).ends_with("allowed: formats exr, f32"));

    // The noise of what cannot be above 1 is cut off, unless a scale lifted it there.
    let noisy = Pixels { fraction: true, ..row(&["Y"], &[1.25, -0.25, 0.5]) };
    assert_eq!(samples(&noisy, &Picture::mask(PictureDepth::Eight)), [255, 0, 128]);
    assert!(refused(&noisy, 2.0).ends_with("or scale 1.6"), "{}", refused(&noisy, 2.0));

    // A colour is judged as it is written, divided by alpha, where alpha is above nothing.
    let cloud = [0.5, 0.25, 0.125, 0.25];
    assert!(refused(&row(&RGBA, &cloud), 1.0).starts_with("value 2 (channel R"));
    let faint = [1.0, 1.0, 1.0, 0.4 / 65535.0];
    assert!(to_png(&row(&RGBA, &faint), &Picture::mask(PictureDepth::Sixteen), 1.0).is_ok());
}

#[test]
fn without_a_tone_curve_a_picture_is_srgb_with_its_known_values() {
    // Linear values and their samples by IEC 61966-2-1.
    let known =
        [(0.0, 0), (0.001, 3), (0.0031308, 10), (0.01, 25), (0.18, 118), (0.214_041_14, 128), (0.5, 188), (1.0, 255)];
    let data = known.map(|(value, _)| value);
    assert_eq!(samples(&pixels(8, 1, &["Y"], &data), &plain(0.0)), known.map(|(_, sample)| sample));
    let fine = display(0.0, Tonemap::None, PictureDepth::Sixteen);
    assert_eq!(samples(&pixels(2, 1, &["Y"], &[0.5, 1.0]), &fine), [48192, 65535]);
}

/// 64 x 64 samples of one light that lies between two steps. The pattern's mean over so many is within a hundredth of a step.
#[test]
fn dither_shows_what_lies_between_two_steps() {
    const BETWEEN: f64 = 100.3;
    let linear = ((BETWEEN / 255.0 + 0.055) / 1.055).powf(2.4) as f32;
    let shown = |value: f32, dither| {
        let data = vec![value; 3 * 64 * 64];
        let picture = Picture::Display {
            exposure: Exposure::Stops(0.0),
            tonemap: Tonemap::None,
            depth: PictureDepth::Eight,
            dither,
        };
        samples(&pixels(64, 64, &["R", "G", "B"], &data), &picture)
    };
    assert!(shown(linear, false).iter().all(|sample| *sample == 100));
    let dithered = shown(linear, true);
    assert!(dithered.iter().all(|sample| [100, 101].contains(sample)));
    let mean = dithered.iter().map(|sample| f64::from(*sample)).sum::<f64>() / dithered.len() as f64;
    eprintln!("mean of {BETWEEN}: {mean:.3}");
    assert!((mean - BETWEEN).abs() < 0.02, "{mean}");
    // So it is in each 8 x 8, or about.
    for corner in (0..64).step_by(8).flat_map(|y| (0..64).step_by(8).map(move |x| [x, y])) {
        let block = (0..64).map(|i| f64::from(dithered[3 * (64 * (corner[1] + i / 8) + corner[0] + i % 8)]));
        let mean = block.sum::<f64>() / 64.0;
        assert!((mean - BETWEEN).abs() < 0.1, "{corner:?}: {mean}");
    }
    // What has no light, and what is white, has no noise.
    assert!(shown(0.0, true).iter().all(|sample| *sample == 0));
    assert!(shown(1.0, true).iter().all(|sample| *sample == 255));
}

#[test]
fn the_white_level_becomes_display_white_at_exposure_0_and_each_stop_doubles_the_light() {
    let data = [8.0, 7.0, 4.0, 9.0, 1e30];
    let texture = pixels(5, 1, &["Y"], &data);
    let shown = |stops| read_png(&to_png(&texture, &plain(stops), 8.0).unwrap()).2;
    assert_eq!(shown(0.0), [255, 240, 188, 255, 255]);
    assert_eq!(shown(-1.0)[..2], [188, 177]);
    assert_eq!(shown(1.0)[2], 255);
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
    assert_eq!(samples(&pixels(1, 1, &["Y"], &[1.0]), &Picture::default()), [expected]);
}

#[test]
fn premultiplied_colour_becomes_straight_in_a_picture() {
    let data = [0.1, 0.2, 0.4, 0.5, 0.3, 0.3, 0.3, 0.0, 0.25, 0.5, 1.0, 1.0];
    let mask = Picture::mask(PictureDepth::Eight);
    let texture = pixels(3, 1, &RGBA, &data);
    assert_eq!(samples(&texture, &mask), [51, 102, 204, 128, 0, 0, 0, 0, 64, 128, 255, 255]);
    // Division comes before the curves, and alpha gets neither exposure nor curve.
    assert_eq!(samples(&texture, &plain(1.0))[..4], [170, 231, 255, 128]);
    let straight = Pixels { alpha: Alpha::Straight, ..texture };
    assert_eq!(samples(&straight, &mask)[..4], [26, 51, 102, 128]);
    // A trace of cloud: the quotient overflows and is white.
    let trace = [1.0, 1.0, 0.0, 1e-40];
    for tonemap in [Tonemap::None, Tonemap::Filmic] {
        let picture = display(1.0, tonemap, PictureDepth::Eight);
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
        let expected = EncodeError::NotFinite(At { channel: "G".to_owned(), x: 2, y: 4 });
        assert_eq!(
            (expected.field(), expected.to_string().as_str()),
            (None, "channel G, column 2, row 4: not a finite number")
        );
        assert_eq!(to_exr(&texture, &metadata(), None).unwrap_err(), expected);
        assert_eq!(to_png(&texture, &Picture::default(), 1.0).unwrap_err(), expected);
        assert_eq!(to_f32(&texture).unwrap_err(), expected);
    }
}

#[test]
fn shapes_that_do_not_fit_are_refused() {
    let data = ramp(12);
    let wrong: [(u32, u32, &[&str]); 6] = [
        (0, 5, &["Y"]),
        (5, 0, &["Y"]),
        (3, 5, &["Y"]),
        (2, 3, &["R", "G"]),
        (4, 1, &["B", "G", "R"]),
        (12, 1, &["R"]),
    ];
    for (width, height, channels) in wrong {
        let texture = pixels(width, height, channels, &data);
        assert!(matches!(to_f32(&texture), Err(EncodeError::Shape { .. })), "{width} x {height} {channels:?}");
    }
    let texture = pixels(12, 1, &["Y"], &data);
    for white in [0.0, -1.0, f32::NAN] {
        assert!(to_png(&texture, &Picture::default(), white).is_err());
    }
}

#[test]
fn files_written_here_are_decoded_here() {
    let data = ramp(3 * 5 * 3);
    let texture = pixels(3, 5, &["R", "G", "B"], &data);
    for depth in [Depth::Half, Depth::Float] {
        let image = decode(&exr(&texture, Some(depth)).bytes, &ImageLimits::default()).unwrap();
        assert_eq!((image.width, image.height, image.channels, image.encoding), (3, 5, 3, ImageEncoding::Float));
        assert_eq!(image.data, data);
    }
    // A cloud is no map: its alpha would be lost.
    let data = ramp(3 * 5 * 4);
    let refused = decode(&exr(&pixels(3, 5, &RGBA, &data), None).bytes, &ImageLimits::default());
    assert!(refused.unwrap_err().to_string().contains("alpha"));
    let mask: Vec<f32> = (0..15).map(|i| i as f32 / 15.0).collect();
    let texture = pixels(3, 5, &["Y"], &mask);
    for (depth, error) in [(PictureDepth::Eight, 0.5 / 255.0), (PictureDepth::Sixteen, 0.5 / 65535.0)] {
        let image = decode(&to_png(&texture, &Picture::mask(depth), 1.0).unwrap(), &ImageLimits::default()).unwrap();
        assert_eq!((image.width, image.height, image.channels, image.encoding), (3, 5, 1, ImageEncoding::Integer));
        assert!(image.data.iter().zip(&mask).all(|(found, wanted)| (found - wanted).abs() <= error + 1e-6));
    }
}
