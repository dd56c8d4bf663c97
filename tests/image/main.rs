//! What images promise: the decoder here and in `windows`, `channels`, `colour` and `pngs`, what a scene takes them for in
//! `maps`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::io::Cursor;
use std::path::PathBuf;

use exr::math::RoundingMode;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image as ExrImage, Layer, LayerAttributes, Levels, Vec2,
    WritableImage as _,
};
use skyloom::image::{Colour, Image, ImageEncoding, ImageError, ImageLimits, decode, sha256_hex};

mod channels;
mod colour;
mod exr_file;
mod maps;
mod png_file;
mod pngs;
mod windows;

use exr_file::Exr;
use png_file::png;

fn limits() -> ImageLimits {
    ImageLimits::default()
}

fn data_file(name: &str) -> Vec<u8> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("tests/data/openexr_{name}.exr"));
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

const EXR_FILES: [&str; 15] = [
    "half_none",
    "half_rle",
    "half_zips",
    "half_zip",
    "half_piz",
    "half_pxr24",
    "half_b44",
    "half_b44a",
    "half_dwaa",
    "half_dwab",
    "float_zip",
    "uint_zip",
    "decreasing",
    "window",
    "tiled",
];

/// A generator of test numbers (xorshift64*), so that every run sees the same.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % bound
    }
}

#[test]
fn sizes_are_refused_from_the_header_before_anything_is_decoded() {
    let small = ImageLimits { max_side: 100, max_texels: 5000 };
    for (width, height) in [(101, 1), (1, 101), (71, 71), (u32::MAX, u32::MAX)] {
        let bomb = png(width, height, 16, 6, 0, &[], &[]);
        let expected = ImageError::TooLarge {
            part: "the image",
            width: width.into(),
            height: height.into(),
            max_side: 100,
            max_texels: 5000,
        };
        assert_eq!(decode(&bomb, &small), Err(expected));
    }
    assert!(matches!(decode(&png(0, 1, 8, 0, 0, &[], &[0]), &small), Err(ImageError::Broken(_))));
    assert!(decode(&png(2, 1, 8, 0, 0, &[], &[0, 1, 2]), &ImageLimits { max_side: 2, max_texels: 2 }).is_ok());
}

/// A file whose window of one name is another.
fn with_window(file: &[u8], name: &str, window: [i32; 4]) -> Result<Image, ImageError> {
    let kind = format!("{name}\0box2i\0").into_bytes();
    let place = file.windows(kind.len()).position(|part| part == kind).unwrap() + kind.len() + 4;
    let mut file = file.to_vec();
    file[place..place + 16].copy_from_slice(&window.map(i32::to_le_bytes).concat());
    decode(&file, &limits())
}

#[test]
fn an_openexr_header_that_claims_a_billion_texels_is_refused() {
    let file = data_file("half_zip");
    let too_large = |result| matches!(result, Err(ImageError::TooLarge { .. }));
    let broken = |result| matches!(result, Err(ImageError::Broken(_)));
    for name in ["dataWindow", "displayWindow"] {
        let with_window = |window| with_window(&file, name, window);
        assert!(too_large(with_window([0, 0, 99_999, 99_999])));
        assert!(too_large(with_window([i32::MIN, i32::MIN, i32::MAX, i32::MAX])));
        assert!(too_large(with_window([0, 0, 8191, 8191])));
        // No texels, and a window upside down.
        assert!(broken(with_window([0, 0, -1, 5])));
        assert!(broken(with_window([5, 5, i32::MIN, i32::MIN])));
    }
    // Within the limits, but the file has too few blocks for it.
    assert!(broken(with_window(&file, "dataWindow", [0, 0, 4095, 4095])));
    // A picture may be larger than what is stored of it.
    let image = with_window(&file, "displayWindow", [0, 0, 4095, 4095]).unwrap();
    assert_eq!((image.width, image.height, image.empty), (4096, 4096, 4096 * 4096 - 24 * 40));
}

/// Largest difference of a decoded reference file from the formula in the data's README, relative to 120. `first`: column and
/// row of the file's texels where the picture begins.
fn largest_error(image: &Image, first: [usize; 2]) -> f32 {
    let width = image.width as usize;
    let texels = image.data.chunks(image.channels as usize).enumerate();
    texels.fold(0.0, |largest: f32, (i, texel)| {
        let i = 24 * (i / width + first[1]) + i % width + first[0];
        let wanted = [i as f32 / 8.0, i as f32 / 8.0 + 1.0, (959 - i) as f32 / 8.0];
        texel.iter().zip(wanted).fold(largest, |largest, (value, wanted)| largest.max((value - wanted).abs() / 120.0))
    })
}

#[test]
fn openexr_files_of_another_library_are_read_in_every_compression_sample_type_and_layout() {
    for name in EXR_FILES {
        let mut image = decode(&data_file(name), &limits()).unwrap_or_else(|error| panic!("{name}: {error}"));
        // Of one file a part of the texels is the picture.
        let (size, first) = if name == "window" { ([10, 10], [3, 11]) } else { ([24, 40], [0, 0]) };
        assert_eq!(([image.width, image.height], image.encoding), (size, ImageEncoding::Float), "{name}");
        assert_eq!(image.channels, if name == "uint_zip" { 1 } else { 3 }, "{name}");
        if name == "uint_zip" {
            image.data.iter_mut().for_each(|value| *value /= 8.0);
        }
        let allowed = match name {
            "half_b44" | "half_b44a" | "half_dwaa" | "half_dwab" => 0.02,
            _ => 0.0,
        };
        let error = largest_error(&image, first);
        assert!(error <= allowed, "{name}: {error}");
    }
}

#[test]
fn a_file_of_another_library_with_alpha_0_is_refused() {
    let Err(ImageError::Transparent(wrong)) = decode(&data_file("grey_alpha"), &limits()) else { panic!("accepted") };
    assert_eq!((wrong.count, wrong.of, wrong.value, wrong.column, wrong.row), (960, 960, 0.0, 0, 0));
}

#[test]
fn of_a_mip_map_the_largest_level_is_read() {
    let level = |width: usize, height: usize| FlatSamples::F32((0..width * height).map(|i| i as f32).collect());
    let levels =
        Levels::Mip { rounding_mode: RoundingMode::Down, level_data: vec![level(5, 7), level(2, 3), level(1, 1)] };
    let encoding = Encoding { blocks: Blocks::Tiles(Vec2(2, 3)), ..Encoding::SMALL_LOSSLESS };
    let channels = AnyChannels::sort([AnyChannel::new("R", levels)].into_iter().collect());
    let mut file = Cursor::new(Vec::new());
    ExrImage::from_layer(Layer::new((5, 7), LayerAttributes::default(), encoding, channels))
        .write()
        .to_buffered(&mut file)
        .unwrap();
    let image = decode(file.get_ref(), &limits()).unwrap();
    assert_eq!((image.width, image.height, image.channels), (5, 7, 1));
    assert!(image.data.iter().enumerate().all(|(i, &value)| value == i as f32));
}

#[test]
fn values_that_are_not_finite_are_refused_with_their_number_and_the_place_of_the_first() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let file = Exr::of(5, 4).channel("h", move |x, y| if y >= 2 && x == 3 { bad } else { 1.0 }).write();
        let Err(ImageError::NotFinite(wrong)) = decode(&file, &limits()) else { panic!("{bad} is accepted") };
        assert_eq!((wrong.count, wrong.of, wrong.column, wrong.row), (2, 20, 3, 2));
        assert_eq!(wrong.value.to_bits(), bad.to_bits());
        let text = ImageError::NotFinite(wrong).to_string();
        assert!(text.contains("2 of 20 texels") && text.contains("column 3, row 2"), "{text}");
    }
}

#[test]
fn files_of_other_formats_and_unsupported_parts_are_named() {
    assert_eq!(decode(b"", &limits()), Err(ImageError::UnknownFormat));
    assert_eq!(decode(b"\xff\xd8\xff\xe0JFIF", &limits()), Err(ImageError::UnknownFormat));
    let reason = |bytes: &[u8]| decode(bytes, &limits()).unwrap_err().to_string();
    assert!(reason(&data_file("multipart")).contains("multi-part"));
    let mut renamed = data_file("float_zip");
    let place = renamed.windows(2).position(|part| part == b"R\0").unwrap();
    renamed[place] = b'Q';
    assert!(reason(&renamed).contains("B, G, Q"), "{}", reason(&renamed));
}

#[test]
fn a_block_that_claims_more_coefficients_than_it_can_have_is_refused_before_they_are_allocated() {
    for name in ["half_dwaa", "half_dwab"] {
        let mut file = data_file(name);
        // The block starts with its version, 2, in eight bytes; the number of coefficients follows seven sizes later.
        let start = file.windows(8).rposition(|part| part == 2_u64.to_le_bytes()).unwrap();
        file[start + 64..start + 72].copy_from_slice(&(u64::MAX >> 8).to_le_bytes());
        let error = decode(&file, &limits()).unwrap_err().to_string();
        assert!(error.contains("impossible size"), "{name}: {error}");
    }
}

/// One valid PNG of 6 x 5 texels with 16 bits.
fn valid_png() -> Vec<u8> {
    let lines: Vec<u8> = (0..5).flat_map(|y| (0..37).map(move |x| if x == 0 { y } else { x * 6 + y })).collect();
    png(6, 5, 16, 2, 0, &[], &lines)
}

#[test]
fn a_file_cut_off_anywhere_is_an_error_and_never_a_panic() {
    let mut files: Vec<(&str, Vec<u8>)> = EXR_FILES.map(|name| (name, data_file(name))).into();
    files.extend([("png", valid_png()), ("statements", pngs::stating_everything())]);
    files.push(("cropped", windows::cropped_with_alpha()));
    for (name, file) in files {
        assert!(decode(&file, &limits()).is_ok(), "{name}");
        for length in 0..file.len() {
            let error = decode(&file[..length], &limits()).expect_err(name);
            assert!(matches!(error, ImageError::Broken(_) | ImageError::UnknownFormat), "{name} {length}: {error}");
        }
    }
}

#[test]
fn a_png_with_fewer_rows_than_its_header_says_is_an_error() {
    assert!(matches!(decode(&png(2, 2, 8, 0, 0, &[], &[0, 1, 2]), &limits()), Err(ImageError::Broken(_))));
    assert!(matches!(decode(&png(4096, 4096, 16, 6, 0, &[], &[0]), &limits()), Err(ImageError::Broken(_))));
}

#[test]
fn damaged_bytes_never_panic_and_never_give_wrong_shapes_or_values_that_are_not_finite() {
    let mut random = Random(0x5eed);
    let mut files: Vec<Vec<u8>> = EXR_FILES.map(data_file).into();
    files.extend([data_file("multipart"), valid_png(), pngs::stating_everything()]);
    files.extend([windows::cropped_with_alpha(), colour::with_primaries(colour::ACES_CG)]);
    for file in files {
        for round in 0..400 {
            let mut damaged = file.clone();
            for _ in 0..=round % 4 {
                let place = random.below(damaged.len());
                damaged[place] = match random.below(4) {
                    0 => 0,
                    1 => 0xff,
                    2 => damaged[place] ^ (1 << random.below(8)),
                    _ => random.below(256) as u8,
                };
            }
            // Small limits, so that windows that grow cost no time.
            let limits = ImageLimits { max_side: 256, max_texels: 1 << 16 };
            if let Ok(image) = decode(&damaged, &limits) {
                assert_eq!(image.data.len() as u64, u64::from(image.width * image.height * image.channels));
                assert!(image.data.iter().all(|value| value.is_finite()));
                if let Colour::Primaries(matrix) = image.colour {
                    assert!(matrix.iter().flatten().all(|part| part.is_finite()));
                }
            }
        }
    }
}

#[test]
fn images_are_named_by_their_sha256() {
    assert_eq!(sha256_hex(b""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    assert_eq!(sha256_hex(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}
