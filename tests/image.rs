//! What the decoder of uploaded images promises.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::io::Cursor;
use std::path::PathBuf;

use exr::math::RoundingMode;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image as ExrImage, Layer, LayerAttributes, Levels, Vec2,
    WritableImage as _,
};
use skyloom::image::{Image, ImageEncoding, ImageError, ImageLimits, decode, sha256_hex};

fn limits() -> ImageLimits {
    ImageLimits::default()
}

fn data_file(name: &str) -> Vec<u8> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("tests/data/openexr_{name}.exr"));
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

const EXR_FILES: [&str; 16] = [
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
    "grey_alpha",
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

// ---- a PNG writer of the plainest kind, to make files that no library would write ----

fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 })
    })
}

fn chunk(kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let mut tagged = kind.to_vec();
    tagged.extend_from_slice(content);
    let mut chunk = (content.len() as u32).to_be_bytes().to_vec();
    chunk.extend_from_slice(&tagged);
    chunk.extend_from_slice(&crc(&tagged).to_be_bytes());
    chunk
}

/// zlib stream of one stored block.
fn stored(bytes: &[u8]) -> Vec<u8> {
    let length = u16::try_from(bytes.len()).unwrap();
    let mut stream = vec![0x78, 0x01, 0x01];
    stream.extend_from_slice(&length.to_le_bytes());
    stream.extend_from_slice(&(!length).to_le_bytes());
    stream.extend_from_slice(bytes);
    let (a, b) = bytes.iter().fold((1_u32, 0_u32), |(a, b), &byte| {
        let a = (a + u32::from(byte)) % 65521;
        (a, (b + a) % 65521)
    });
    stream.extend_from_slice(&((b << 16) | a).to_be_bytes());
    stream
}

/// `lines` are the scan lines with their filter bytes; `extra` are whole chunks between header and picture.
fn png(width: u32, height: u32, depth: u8, color: u8, interlaced: u8, extra: &[u8], lines: &[u8]) -> Vec<u8> {
    let mut header = width.to_be_bytes().to_vec();
    header.extend_from_slice(&height.to_be_bytes());
    header.extend_from_slice(&[depth, color, 0, 0, interlaced]);
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    file.extend(chunk(b"IHDR", &header));
    file.extend_from_slice(extra);
    file.extend(chunk(b"IDAT", &stored(lines)));
    file.extend(chunk(b"IEND", b""));
    file
}

fn values(bytes: &[u8]) -> Vec<f32> {
    decode(bytes, &limits()).unwrap().data
}

#[test]
fn png_samples_are_divided_by_their_maximum_and_row_0_is_on_top() {
    let grey = decode(&png(1, 2, 8, 0, 0, &[], &[0, 255, 0, 51]), &limits()).unwrap();
    assert_eq!((grey.width, grey.height, grey.channels, grey.encoding), (1, 2, 1, ImageEncoding::Integer));
    assert_eq!(grey.data, [1.0, 0.2]);
    assert_eq!(values(&png(1, 1, 16, 0, 0, &[], &[0, 0x80, 0x01])), [f32::from(0x8001_u16) / 65535.0]);
    assert_eq!(values(&png(1, 1, 16, 0, 0, &[], &[0, 0xff, 0xff])), [1.0]);
}

#[test]
fn every_kind_of_png_is_read_and_alpha_is_dropped() {
    assert_eq!(values(&png(2, 1, 8, 4, 0, &[], &[0, 255, 7, 51, 9])), [1.0, 0.2]);
    let rgb = decode(&png(1, 1, 8, 2, 0, &[], &[0, 0, 51, 255]), &limits()).unwrap();
    assert_eq!((rgb.channels, rgb.data.as_slice()), (3, [0.0, 0.2, 1.0].as_slice()));
    assert_eq!(values(&png(1, 1, 8, 6, 0, &[], &[0, 0, 51, 255, 0])), [0.0, 0.2, 1.0]);
    assert_eq!(values(&png(1, 1, 16, 6, 0, &[], &[0, 0, 0, 0x33, 0x33, 0xff, 0xff, 1, 2])), [0.0, 0.2, 1.0]);
    assert_eq!(values(&png(1, 1, 16, 4, 0, &[], &[0, 0x33, 0x33, 0, 0])), [0.2]);
    // A palette of two colours in one bit, the first of them transparent; grey in 2 bits.
    let palette = [chunk(b"PLTE", &[255, 51, 0, 0, 255, 51]), chunk(b"tRNS", &[0])].concat();
    assert_eq!(values(&png(2, 1, 1, 3, 0, &palette, &[0, 0b0100_0000])), [1.0, 0.2, 0.0, 0.0, 1.0, 0.2]);
    assert_eq!(values(&png(2, 1, 2, 0, 0, &[], &[0, 0b0111_0000])), [85.0 / 255.0, 1.0]);
    // Adam7: passes 1, 4, 6 and 7 of a 3 x 2 picture.
    let interlaced = png(3, 2, 8, 0, 1, &[], &[0, 0, 0, 102, 0, 51, 0, 153, 204, 255]);
    assert_eq!(values(&interlaced), [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]);
}

#[test]
fn what_a_png_carries_besides_its_samples_is_not_looked_at() {
    // A profile that would inflate without end, texts, gamma, an animation that would replace the picture.
    let extra = [
        chunk(b"gAMA", &100_000_u32.to_be_bytes()),
        chunk(b"iCCP", &[b"x\0\0".as_slice(), &[0x78, 0x9c, 0xff]].concat()),
        chunk(b"acTL", &[0, 0, 0, 2, 0, 0, 0, 0]),
        chunk(b"tEXt", &vec![b'a'; 1 << 20]),
    ]
    .concat();
    assert_eq!(values(&png(1, 1, 8, 0, 0, &extra, &[0, 51])), [0.2]);
}

#[test]
fn sizes_are_refused_from_the_header_before_anything_is_decoded() {
    let small = ImageLimits { max_side: 100, max_texels: 5000 };
    for (width, height) in [(101, 1), (1, 101), (71, 71), (u32::MAX, u32::MAX)] {
        let bomb = png(width, height, 16, 6, 0, &[], &[]);
        let expected =
            ImageError::TooLarge { width: width.into(), height: height.into(), max_side: 100, max_texels: 5000 };
        assert_eq!(decode(&bomb, &small), Err(expected));
    }
    assert!(matches!(decode(&png(0, 1, 8, 0, 0, &[], &[0]), &small), Err(ImageError::Broken(_))));
    assert!(decode(&png(2, 1, 8, 0, 0, &[], &[0, 1, 2]), &ImageLimits { max_side: 2, max_texels: 2 }).is_ok());
}

#[test]
fn an_openexr_header_that_claims_a_billion_texels_is_refused() {
    let file = data_file("half_zip");
    let kind = b"dataWindow\0box2i\0";
    let place = file.windows(kind.len()).position(|part| part == kind).unwrap() + kind.len() + 4;
    let with_window = |window: [i32; 4]| {
        let mut file = file.clone();
        file[place..place + 16].copy_from_slice(&window.map(i32::to_le_bytes).concat());
        decode(&file, &limits())
    };
    let too_large = |result| matches!(result, Err(ImageError::TooLarge { .. }));
    assert!(too_large(with_window([0, 0, 99_999, 99_999])));
    assert!(too_large(with_window([i32::MIN, i32::MIN, i32::MAX, i32::MAX])));
    assert!(too_large(with_window([0, 0, 8191, 8191])));
    // Within the limits, but the file has too few blocks for it.
    assert!(matches!(with_window([0, 0, 4095, 4095]), Err(ImageError::Broken(_))));
    // No texels, and a window upside down.
    assert!(matches!(with_window([0, 0, -1, 5]), Err(ImageError::Broken(_))));
    assert!(matches!(with_window([5, 5, i32::MIN, i32::MIN]), Err(ImageError::Broken(_))));
}

/// Largest difference of a decoded reference file from the formula in the data's README, relative to 120.
fn largest_error(image: &Image) -> f32 {
    assert_eq!((image.width, image.height, image.encoding), (24, 40, ImageEncoding::Float));
    let texels = image.data.chunks(image.channels as usize).enumerate();
    texels.fold(0.0, |largest: f32, (i, texel)| {
        let wanted = [i as f32 / 8.0, i as f32 / 8.0 + 1.0, (959 - i) as f32 / 8.0];
        texel.iter().zip(wanted).fold(largest, |largest, (value, wanted)| largest.max((value - wanted).abs() / 120.0))
    })
}

#[test]
fn openexr_files_of_another_library_are_read_in_every_compression_sample_type_and_layout() {
    for name in EXR_FILES {
        let mut image = decode(&data_file(name), &limits()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(image.channels, if matches!(name, "uint_zip" | "grey_alpha") { 1 } else { 3 }, "{name}");
        if name == "uint_zip" {
            image.data.iter_mut().for_each(|value| *value /= 8.0);
        }
        let allowed = match name {
            "half_b44" | "half_b44a" | "half_dwaa" | "half_dwab" => 0.02,
            _ => 0.0,
        };
        assert!(largest_error(&image) <= allowed, "{name}: {}", largest_error(&image));
    }
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
fn values_that_are_not_finite_are_refused() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let samples = FlatSamples::F32(vec![0.0, bad]);
        let channels = AnyChannels::sort([AnyChannel::new("h", samples)].into_iter().collect());
        let mut file = Cursor::new(Vec::new());
        ExrImage::from_layer(Layer::new((2, 1), LayerAttributes::default(), Encoding::UNCOMPRESSED, channels))
            .write()
            .to_buffered(&mut file)
            .unwrap();
        assert_eq!(decode(file.get_ref(), &limits()), Err(ImageError::NotFinite));
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
    files.push(("png", valid_png()));
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
    files.extend([data_file("multipart"), valid_png()]);
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
            if let Ok(image) = decode(&damaged, &limits()) {
                assert_eq!(image.data.len() as u64, u64::from(image.width * image.height * image.channels));
                assert!(image.data.iter().all(|value| value.is_finite()));
            }
        }
    }
}

#[test]
fn images_are_named_by_their_sha256() {
    assert_eq!(sha256_hex(b""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    assert_eq!(sha256_hex(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}
