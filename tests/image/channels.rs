//! Which channels of an OpenEXR file make a map, and what is said of those that do not.

use skyloom::image::{ImageError, decode};

use crate::exr_file::Exr;
use crate::limits;

/// A picture of 4 x 4 texels with these channels; each holds its number.
fn file(names: &[&str]) -> Vec<u8> {
    let numbered = names.iter().enumerate();
    numbered.fold(Exr::of(4, 4), |file, (number, name)| file.channel(name, move |_, _| number as f32)).write()
}

fn refusal(file: &[u8]) -> String {
    match decode(file, &limits()) {
        Err(ImageError::Broken(reason)) => reason,
        other => panic!("{other:?}"),
    }
}

#[test]
fn red_green_and_blue_or_any_single_channel_make_a_map() {
    let image = decode(&file(&["B", "G", "R"]), &limits()).unwrap();
    assert_eq!((image.channels, &image.data[..3]), (3, [2.0, 1.0, 0.0].as_slice()));
    for name in ["R", "G", "Y", "Z", "A", "height", "cloud.thickness"] {
        let image = decode(&file(&[name]), &limits()).unwrap();
        assert_eq!((image.channels, image.data), (1, vec![0.0; 16]), "{name}");
    }
}

#[test]
fn channels_that_would_be_passed_over_are_named() {
    for (names, reason) in [
        (["BY", "RY", "Y"].as_slice(), "luminance and chroma"),
        (&["RY", "Y"], "luminance and chroma"),
        (&["X", "Y", "Z"], "CIE XYZ"),
        (&["diffuse.B", "diffuse.G", "diffuse.R"], "several layers"),
        (&["B", "G", "R", "specular.R"], "several layers"),
        (&["B", "G", "R", "Z"], "beside R, G and B"),
        (&["AB", "AG", "AR", "B", "G", "R"], "beside R, G and B"),
        (&["A", "B", "G", "R", "id"], "beside R, G and B"),
        (&["G", "R"], "only a part"),
        (&["A", "B", "R"], "only a part"),
        (&["Y", "Z"], "none of them"),
        (&["A", "depth", "id"], "none of them"),
        (&["b", "g", "r"], "none of them"),
    ] {
        let found = refusal(&file(names));
        assert!(found.contains(reason), "{names:?}: {found}");
        let listed = names.iter().filter(|name| **name != "A").copied().collect::<Vec<_>>().join(", ");
        assert!(found.contains(&listed) && found.contains("R, G and B are wanted"), "{names:?}: {found}");
    }
}

#[test]
fn coarse_channels_are_named() {
    let chroma = Exr::of(4, 4).coarse_channel("BY", 2, |_, _| 0.1).coarse_channel("RY", 2, |_, _| 0.1);
    assert!(refusal(&chroma.channel("Y", |_, _| 0.5).write()).contains("luminance and chroma"));
    let coarse = Exr::of(4, 4).channel("B", |_, _| 0.1).coarse_channel("G", 2, |_, _| 0.1).channel("R", |_, _| 0.1);
    let found = refusal(&coarse.write());
    assert!(found.contains("G has a sample only for every 2 x 2 texels"), "{found}");
    assert!(refusal(&Exr::of(4, 4).coarse_channel("Y", 4, |_, _| 0.1).write()).contains("4 x 4"));
}

#[test]
fn channels_out_of_order_or_given_twice_are_refused() {
    for names in [["R", "G", "B"].as_slice(), &["B", "B", "G", "R"], &["Y", "A"]] {
        assert!(refusal(&file(names)).contains("order of their names"), "{names:?}");
    }
    assert!(refusal(&file(&[])).contains("no channels"));
}

#[test]
fn alpha_is_dropped_where_it_is_1_everywhere_and_refused_elsewhere() {
    let with = |alpha: fn(i32, i32) -> f32| {
        decode(&Exr::of(5, 3).channel("A", alpha).channel("Y", |_, _| 0.3).write(), &limits())
    };
    assert_eq!(with(|_, _| 1.0).unwrap().data, [0.3; 15]);
    // No tolerance: not even rounding, nor an alpha that is even.
    for (alpha, count, first, column, row) in [
        ((|_, _| 0.5) as fn(i32, i32) -> f32, 15, 0.5, 0, 0),
        (|x, y| if (x, y) == (4, 2) { 1.0 - f32::EPSILON } else { 1.0 }, 1, 1.0 - f32::EPSILON, 4, 2),
        (|x, _| if x > 2 { 1.5 } else { 1.0 }, 6, 1.5, 3, 0),
        (|_, _| 0.0, 15, 0.0, 0, 0),
    ] {
        let Err(error) = with(alpha) else { panic!("alpha is passed over") };
        let ImageError::Transparent(wrong) = error else { panic!("{error}") };
        assert_eq!((wrong.count, wrong.of, wrong.value), (count, 15, first));
        assert_eq!((wrong.column, wrong.row), (column, row));
        let text = error.to_string();
        assert!(text.contains("Flatten") && text.contains(&format!("{count} of 15 texels")), "{text}");
    }
    assert!(matches!(with(|_, _| f32::NAN), Err(ImageError::Transparent(_))));
}
