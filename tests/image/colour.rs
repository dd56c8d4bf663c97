//! Primaries that an OpenEXR file states, against published matrices, and what becomes of an albedo in them.

use skyloom::image::{Colour, Image, ImageEncoding, ImageError, Matrix, decode};

use crate::exr_file::{Exr, attribute};
use crate::limits;

/// x and y of red, green, blue and white: SMPTE ST 2065-1; Academy S-2014-004; ITU-R BT.2020-2; SMPTE EG 432-1 with D65.
const ACES: [f32; 8] = [0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767];
pub(crate) const ACES_CG: [f32; 8] = [0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767];
const REC2020: [f32; 8] = [0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329];
const DISPLAY_P3: [f32; 8] = [0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329];
const REC709: [f32; 8] = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329];

fn stating(chromaticities: [f32; 8]) -> Exr {
    let mut file = Exr::of(3, 2);
    file.attributes =
        attribute("chromaticities", "chromaticities", &chromaticities.map(|value| value.to_le_bytes()).concat());
    file
}

/// A colour picture with these primaries.
pub(crate) fn with_primaries(chromaticities: [f32; 8]) -> Vec<u8> {
    stating(chromaticities)
        .channel("B", |_, _| 0.3)
        .channel("G", |_, _| 0.4)
        .channel("R", |x, _| x as f32 / 9.0)
        .write()
}

fn matrix(chromaticities: [f32; 8]) -> Matrix {
    match decode(&with_primaries(chromaticities), &limits()).unwrap().colour {
        Colour::Primaries(matrix) => matrix,
        other => panic!("{other:?}"),
    }
}

#[test]
fn primaries_lead_to_rec709_by_the_published_matrices() {
    for (name, chromaticities, published) in [
        // The matrix of OpenColorIO's ACES configuration, and that of the `colour` library: Bradford.
        (
            "ACES2065-1",
            ACES,
            [
                [2.521_686_19, -1.134_130_99, -0.387_555_20],
                [-0.276_479_91, 1.372_719_09, -0.096_239_17],
                [-0.015_378_06, -0.152_975_34, 1.168_353_40],
            ],
        ),
        (
            "ACEScg",
            ACES_CG,
            [
                [1.705_050_99, -0.621_792_12, -0.083_258_87],
                [-0.130_256_42, 1.140_804_74, -0.010_548_32],
                [-0.024_003_36, -0.128_968_98, 1.152_972_33],
            ],
        ),
        // ITU-R BT.2407-0, section 2.
        ("Rec.2020", REC2020, [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]]),
        // CSS Color 4 by way of XYZ.
        ("Display P3", DISPLAY_P3, [[1.2249, -0.2249, 0.0], [-0.0421, 1.0421, 0.0], [-0.0196, -0.0786, 1.0983]]),
    ] {
        for (row, wanted) in matrix(chromaticities).iter().zip(published) {
            for (found, wanted) in row.iter().zip(wanted) {
                // Digits as published; chromaticities have those of floats.
                assert!((found - wanted).abs() < 1e-4, "{name}: {found}, not {wanted}");
            }
            let sum: f64 = row.iter().sum();
            assert!((sum - 1.0).abs() < 1e-9, "{name}: white stays white");
        }
    }
}

#[test]
fn primaries_of_rec709_in_any_rounding_are_nothing_to_convert() {
    for white in [[0.3127, 0.329], [0.31271, 0.32902], [0.312_713, 0.329_016]] {
        let mut chromaticities = REC709;
        chromaticities[6..].copy_from_slice(&white);
        assert_eq!(decode(&with_primaries(chromaticities), &limits()).unwrap().colour, Colour::Unsaid);
    }
    assert_eq!(decode(&Exr::of(2, 2).channel("Y", |_, _| 0.5).write(), &limits()).unwrap().colour, Colour::Unsaid);
}

#[test]
fn chromaticities_that_cannot_be_are_refused() {
    let changed = |changes: &[(usize, f32)]| {
        let mut chromaticities = REC2020;
        changes.iter().for_each(|(at, value)| chromaticities[*at] = *value);
        chromaticities
    };
    for chromaticities in [
        [0.0; 8],
        [0.3127; 8],
        changed(&[(0, f32::NAN)]),
        changed(&[(3, f32::INFINITY)]),
        changed(&[(7, 0.0)]),
        changed(&[(7, -0.3)]),
        // Green on the line from red to blue; white outside the triangle; a primary that is white.
        changed(&[(2, 0.4195), (3, 0.169)]),
        changed(&[(6, 0.8), (7, 0.1)]),
        changed(&[(4, 0.3127), (5, 0.329)]),
    ] {
        let found = decode(&with_primaries(chromaticities), &limits());
        let Err(ImageError::Broken(reason)) = found else { panic!("{chromaticities:?}: {found:?}") };
        assert!(reason.contains("no primaries"), "{reason}");
    }
    let mut short = Exr::of(1, 1).channel("Y", |_, _| 0.5);
    short.attributes = attribute("chromaticities", "chromaticities", &[0; 31]);
    assert!(matches!(decode(&short.write(), &limits()), Err(ImageError::Broken(_))));
}

/// Samples stay as the file has them: a map of thickness has no colours.
#[test]
fn samples_are_not_converted_on_reading() {
    let image = decode(&with_primaries(ACES_CG), &limits()).unwrap();
    assert_eq!(image.data[3..6], [1.0 / 9.0, 0.4, 0.3]);
}

#[test]
fn an_image_is_made_of_texels_that_fit_its_size() {
    let make = |width, height, channels, count| {
        Image::new(width, height, channels, vec![0.5; count], ImageEncoding::Float).is_ok()
    };
    assert!(make(3, 2, 1, 6) && make(3, 2, 3, 18));
    assert!(!make(3, 2, 1, 5) && !make(3, 2, 2, 12) && !make(0, 2, 1, 0) && !make(3, 2, 0, 0) && !make(3, 2, 4, 24));
}
