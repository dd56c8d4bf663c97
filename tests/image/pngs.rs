//! PNG files: samples, and what their chunks state.

use skyloom::image::{Colour, ImageEncoding, ImageError, decode};

use crate::limits;
use crate::png_file::{chunk, png, stored};

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
fn every_kind_of_png_is_read() {
    assert_eq!(values(&png(2, 1, 8, 4, 0, &[], &[0, 255, 255, 51, 255])), [1.0, 0.2]);
    let rgb = decode(&png(1, 1, 8, 2, 0, &[], &[0, 0, 51, 255]), &limits()).unwrap();
    assert_eq!((rgb.channels, rgb.data.as_slice()), (3, [0.0, 0.2, 1.0].as_slice()));
    assert_eq!(values(&png(1, 1, 8, 6, 0, &[], &[0, 0, 51, 255, 255])), [0.0, 0.2, 1.0]);
    let wide = [0, 0, 0, 0x33, 0x33, 0xff, 0xff, 0xff, 0xff];
    assert_eq!(values(&png(1, 1, 16, 6, 0, &[], &wide)), [0.0, 0.2, 1.0]);
    assert_eq!(values(&png(1, 1, 16, 4, 0, &[], &[0, 0x33, 0x33, 0xff, 0xff])), [0.2]);
    // A palette of two colours in one bit; grey in 2 bits.
    let palette = chunk(b"PLTE", &[255, 51, 0, 0, 255, 51]);
    assert_eq!(values(&png(2, 1, 1, 3, 0, &palette, &[0, 0b0100_0000])), [1.0, 0.2, 0.0, 0.0, 1.0, 0.2]);
    assert_eq!(values(&png(2, 1, 2, 0, 0, &[], &[0, 0b0111_0000])), [85.0 / 255.0, 1.0]);
    // Adam7: passes 1, 4, 6 and 7 of a 3 x 2 picture.
    let interlaced = png(3, 2, 8, 0, 1, &[], &[0, 0, 0, 102, 0, 51, 0, 153, 204, 255]);
    assert_eq!(values(&interlaced), [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]);
}

/// Count, value and place of what is transparent.
fn transparent(file: &[u8]) -> (u64, f32, u32, u32) {
    match decode(file, &limits()) {
        Err(ImageError::Transparent(wrong)) => (wrong.count, wrong.value, wrong.column, wrong.row),
        other => panic!("{other:?}"),
    }
}

#[test]
fn alpha_below_1_is_refused_at_every_depth() {
    let grey = [0, 9, 255, 9, 255, 0, 9, 254, 9, 0];
    assert_eq!(transparent(&png(2, 2, 8, 4, 0, &[], &grey)), (2, 254.0 / 255.0, 0, 1));
    assert_eq!(transparent(&png(2, 1, 8, 6, 0, &[], &[0, 1, 2, 3, 255, 1, 2, 3, 51])), (1, 0.2, 1, 0));
    // The lower byte counts.
    let nearly = [0, 9, 9, 0xff, 0xfe];
    assert_eq!(transparent(&png(1, 1, 16, 4, 0, &[], &nearly)), (1, 65534.0 / 65535.0, 0, 0));
    assert_eq!(transparent(&png(1, 1, 16, 6, 0, &[], &[0, 0, 0, 0, 0, 0, 0, 0x33, 0x33])), (1, 0.2, 0, 0));
}

#[test]
fn colours_that_a_chunk_makes_transparent_are_refused_where_they_occur() {
    let clear = |value: &[u8]| chunk(b"tRNS", value);
    let palette = |value: &[u8]| [chunk(b"PLTE", &[255, 51, 0, 0, 255, 51, 9, 9, 9]), clear(value)].concat();
    let lines = [0, 0b0001_0001];
    assert_eq!(transparent(&png(4, 1, 2, 3, 0, &palette(&[255, 51]), &lines)), (2, 0.2, 1, 0));
    // A colour that occurs nowhere, and a palette all of which is opaque.
    assert_eq!(values(&png(4, 1, 2, 3, 0, &palette(&[255, 255, 0]), &lines)).len(), 12);
    assert_eq!(values(&png(4, 1, 2, 3, 0, &palette(&[255, 255, 255]), &lines)).len(), 12);

    for (depth, row) in [(1, 0b0110_0000), (2, 0b0001_0100), (4, 0b0001_0000)] {
        let width = 8 / u32::from(depth);
        let file = |value| png(width, 1, depth, 0, 0, &clear(&[0, value]), &[0, row]);
        assert_eq!(transparent(&file(1)).1, 0.0, "{depth} bits");
        assert!(depth == 1 || decode(&file(3), &limits()).is_ok());
    }
    assert_eq!(transparent(&png(3, 1, 8, 0, 0, &clear(&[0, 7]), &[0, 8, 9, 7])), (1, 0.0, 2, 0));
    assert_eq!(values(&png(3, 1, 8, 0, 0, &clear(&[0, 7]), &[0, 8, 9, 255])).len(), 3);
    let grey = |value: u16| png(2, 1, 16, 0, 0, &clear(&value.to_be_bytes()), &[0, 1, 2, 3, 4]);
    assert_eq!(transparent(&grey(0x0304)), (1, 0.0, 1, 0));
    assert_eq!(values(&grey(0x0305)).len(), 2);
    let rgb = |value: &[u8]| png(2, 1, 8, 2, 0, &clear(value), &[0, 1, 2, 3, 4, 5, 6]);
    assert_eq!(transparent(&rgb(&[0, 1, 0, 2, 0, 3])), (1, 0.0, 0, 0));
    assert_eq!(values(&rgb(&[0, 1, 0, 2, 0, 9])).len(), 6);
    let wide = |value: &[u8]| png(1, 1, 16, 2, 0, &clear(value), &[0, 1, 2, 3, 4, 5, 6]);
    assert_eq!(transparent(&wide(&[1, 2, 3, 4, 5, 6])), (1, 0.0, 0, 0));
    assert_eq!(values(&wide(&[1, 2, 3, 4, 5, 7])).len(), 3);
}

#[test]
fn what_else_a_png_carries_does_not_change_its_samples() {
    // A profile that would inflate without end, texts, gamma, significant bits, an animation that would replace the picture.
    let extra = [
        chunk(b"gAMA", &100_000_u32.to_be_bytes()),
        chunk(b"iCCP", &[b"x\0\0".as_slice(), &[0x78, 0x9c, 0xff]].concat()),
        chunk(b"sBIT", &[5]),
        chunk(b"acTL", &[0, 0, 0, 2, 0, 0, 0, 0]),
        chunk(b"tEXt", &vec![b'a'; 1 << 20]),
    ]
    .concat();
    assert_eq!(values(&png(1, 1, 8, 0, 0, &extra, &[0, 51])), [0.2]);
}

/// What a colour picture with these chunks is taken for.
fn colour(extra: &[u8]) -> Colour {
    decode(&png(1, 1, 8, 2, 0, extra, &[0, 10, 20, 30]), &limits()).unwrap().colour
}

fn words(values: &[u32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_be_bytes()).collect()
}

/// White, red, green and blue of Rec.709, as PNG writes them.
const SRGB_PRIMARIES: [u32; 8] = [31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000];

#[test]
fn colours_are_known_by_their_chunks() {
    let gamma = |value: u32| chunk(b"gAMA", &value.to_be_bytes());
    let primaries = |values: [u32; 8]| chunk(b"cHRM", &words(&values));
    let wide = primaries([31270, 32900, 70800, 29200, 17000, 79700, 13100, 4600]);
    let srgb = chunk(b"sRGB", &[0]);
    let code_points = |values: [u8; 4]| chunk(b"cICP", &values);
    assert_eq!(colour(&[]), Colour::Unsaid);
    assert_eq!(colour(&primaries(SRGB_PRIMARIES)), Colour::Unsaid);
    assert_eq!(colour(&srgb), Colour::Srgb);
    assert_eq!(colour(&gamma(45_455)), Colour::Srgb);
    assert_eq!(colour(&[gamma(45_455), primaries(SRGB_PRIMARIES)].concat()), Colour::Srgb);
    assert_eq!(colour(&gamma(100_000)), Colour::Linear);
    assert_eq!(colour(&code_points([1, 13, 0, 1])), Colour::Srgb);
    assert_eq!(colour(&code_points([1, 8, 0, 1])), Colour::Linear);
    for (extra, name) in [
        (gamma(55_556), "gAMA"),
        (gamma(0), "gAMA"),
        (wide.clone(), "cHRM"),
        ([gamma(45_455), wide.clone()].concat(), "cHRM"),
        (code_points([9, 16, 0, 1]), "cICP"),
        (code_points([1, 13, 0, 0]), "cICP"),
        // Code points go before the sRGB chunk, a profile too; that before gamma and primaries.
        ([srgb.clone(), code_points([12, 13, 0, 1])].concat(), "cICP"),
    ] {
        let Colour::Other(what) = colour(&extra) else { panic!("{name} is passed over") };
        assert!(what.contains(name), "{what}");
    }
    assert_eq!(colour(&[gamma(100_000), wide, srgb].concat()), Colour::Srgb);
}

/// A profile of three primaries, x 65536, and the same curve for each.
fn profile(space: &[u8; 4], primaries: [[i32; 3]; 3], curve: &[u8]) -> Vec<u8> {
    let mut values: Vec<(&[u8; 4], Vec<u8>)> = Vec::new();
    for (name, column) in [b"rXYZ", b"gXYZ", b"bXYZ"].into_iter().zip(primaries) {
        values.push((name, [b"XYZ \0\0\0\0".to_vec(), column.map(i32::to_be_bytes).concat()].concat()));
    }
    values.extend([b"rTRC", b"gTRC", b"bTRC", b"kTRC"].map(|name| (name, curve.to_vec())));
    let mut file = vec![0; 128];
    file[16..20].copy_from_slice(space);
    file.extend(words(&[values.len() as u32]));
    let mut at = 132 + 12 * values.len();
    for (name, value) in &values {
        file.extend([name.as_slice(), &words(&[at as u32, value.len() as u32])].concat());
        at += value.len();
    }
    values.into_iter().for_each(|(_, value)| file.extend(value));
    file
}

fn embedded(profile: &[u8]) -> Vec<u8> {
    chunk(b"iCCP", &[b"a name\0\0".as_slice(), &stored(profile)].concat())
}

/// Primaries of the profiles of sRGB and of Adobe RGB (1998), under D50, as their files have them.
const SRGB_XYZ: [[i32; 3]; 3] = [[28578, 14581, 912], [25241, 46981, 6362], [9376, 3972, 46799]];
const ADOBE_XYZ: [[i32; 3]; 3] = [[39960, 20389, 1276], [13453, 41004, 3988], [9765, 4143, 48792]];

fn parametric(kind: u16, parameters: &[f64]) -> Vec<u8> {
    let fixed = parameters.iter().flat_map(|value| ((value * 65536.0).round() as i32).to_be_bytes());
    [b"para\0\0\0\0".as_slice(), &kind.to_be_bytes(), &[0; 2]].concat().into_iter().chain(fixed).collect()
}

#[test]
fn colour_profiles_are_told_apart_by_their_primaries_and_curves() {
    let curve = |values: &[u16]| {
        let entries: Vec<u8> = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        [b"curv\0\0\0\0".as_slice(), &words(&[values.len() as u32]), &entries].concat()
    };
    // IEC 61966-2-1 as a formula and as a table; gamma 2.2.
    let formula = parametric(3, &[2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.04045]);
    let value = |x: f64| if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
    let table: Vec<u16> = (0..1024).map(|i| (65535.0 * value(f64::from(i) / 1023.0)).round() as u16).collect();
    for known in [formula.clone(), curve(&table), curve(&[(2.2 * 256.0) as u16]), parametric(0, &[2.2])] {
        assert_eq!(colour(&embedded(&profile(b"RGB ", SRGB_XYZ, &known))), Colour::Srgb);
        let grey = png(1, 1, 8, 0, 0, &embedded(&profile(b"GRAY", [[0; 3]; 3], &known)), &[0, 51]);
        assert_eq!(decode(&grey, &limits()).unwrap().colour, Colour::Srgb);
    }
    assert_eq!(colour(&embedded(&profile(b"RGB ", SRGB_XYZ, &curve(&[])))), Colour::Linear);
    assert_eq!(colour(&embedded(&profile(b"RGB ", SRGB_XYZ, &curve(&[256])))), Colour::Linear);
    for other in [
        profile(b"RGB ", ADOBE_XYZ, &curve(&[563])),
        profile(b"RGB ", SRGB_XYZ, &curve(&[(1.8 * 256.0) as u16])),
        profile(b"CMYK", SRGB_XYZ, &formula),
        profile(b"RGB ", SRGB_XYZ, b"mAB "),
        profile(b"RGB ", SRGB_XYZ, &curve(&table)[..100]),
        Vec::new(),
        vec![0xff; 200],
    ] {
        let Colour::Other(what) = colour(&embedded(&other)) else { panic!("taken for known") };
        assert!(what.contains("a name"), "{what}");
    }
}

/// Every statement at once, for files that are damaged.
pub(crate) fn stating_everything() -> Vec<u8> {
    let formula = parametric(3, &[2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.04045]);
    let extra = [
        chunk(b"cHRM", &words(&SRGB_PRIMARIES)),
        chunk(b"gAMA", &45_455_u32.to_be_bytes()),
        embedded(&profile(b"RGB ", SRGB_XYZ, &formula)),
        chunk(b"sRGB", &[0]),
        chunk(b"cICP", &[1, 13, 0, 1]),
        chunk(b"eXIf", &orientation(1)),
        chunk(b"tRNS", &[0, 1, 0, 2, 0, 3]),
    ]
    .concat();
    png(2, 1, 8, 2, 0, &extra, &[0, 10, 20, 30, 40, 50, 60])
}

/// Exif with the tag of orientation alone.
fn orientation(value: u8) -> Vec<u8> {
    [b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".as_slice(), &[value], &[0; 6]].concat()
}

#[test]
fn pictures_that_are_to_be_turned_are_refused() {
    let file = |value| png(1, 1, 8, 0, 0, &chunk(b"eXIf", &orientation(value)), &[0, 51]);
    assert_eq!(values(&file(1)), [0.2]);
    for value in 2..=8 {
        let error = decode(&file(value), &limits()).unwrap_err().to_string();
        assert!(error.contains("upright"), "{value}: {error}");
    }
    assert_eq!(values(&png(1, 1, 8, 0, 0, &chunk(b"eXIf", b"MM"), &[0, 51])), [0.2]);
}
