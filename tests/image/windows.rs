//! The picture of an OpenEXR file is its display window, whatever part of it is stored.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image as ExrImage, IntegerBounds, Layer,
    LayerAttributes, LineOrder, Vec2, WritableImage as _, f16,
};
use proptest::prelude::*;
use skyloom::image::{ImageError, decode};

use crate::exr_file::Exr;
use crate::limits;

/// A value for every place of the plane, none of them 0.
fn value(x: i32, y: i32) -> f32 {
    (1000 + 37 * x + y) as f32
}

/// What a picture shows: the values inside the data window, 0 elsewhere.
fn shown([left, top, width, height]: [i32; 4], display: [i32; 4]) -> Vec<f32> {
    let (columns, rows) = (display[0]..display[0] + display[2], display[1]..display[1] + display[3]);
    let inside = |x: i32, y: i32| (left..left + width).contains(&x) && (top..top + height).contains(&y);
    rows.flat_map(|y| columns.clone().map(move |x| if inside(x, y) { value(x, y) } else { 0.0 })).collect()
}

/// A picture with alpha of which a corner is stored.
pub(crate) fn cropped_with_alpha() -> Vec<u8> {
    let file = Exr::cropped([2, 1, 4, 3], [0, 0, 8, 6]).channel("A", |_, _| 1.0).channel("B", value);
    file.channel("G", value).channel("R", value).write()
}

/// A file of another writer, with one channel.
fn written(data: [i32; 4], display: [i32; 4], encoding: Encoding, samples: fn(Vec<f32>) -> FlatSamples) -> Vec<u8> {
    let [left, top, width, height] = data;
    let samples = samples((0..width * height).map(|i| value(left + i % width, top + i / width)).collect());
    let channels = AnyChannels::sort([AnyChannel::new("h", samples)].into_iter().collect());
    let attributes = LayerAttributes { layer_position: Vec2(left, top), ..LayerAttributes::default() };
    let layer = Layer::new((width as usize, height as usize), attributes, encoding, channels);
    let mut image = ExrImage::from_layer(layer);
    image.attributes.display_window =
        IntegerBounds { position: Vec2(display[0], display[1]), size: Vec2(display[2] as usize, display[3] as usize) };
    let mut file = Cursor::new(Vec::new());
    image.write().to_buffered(&mut file).unwrap();
    file.into_inner()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn of_any_two_windows_the_picture_is_the_display_window(
        data in (-9..9, -9..9, 1..20, 1..20),
        display in (-9..9, -9..9, 1..20, 1..20),
        compression in prop::sample::select(vec![
            Compression::Uncompressed, Compression::RLE, Compression::ZIP1, Compression::ZIP16, Compression::PIZ,
        ]),
        tile in prop::option::of((1..7_usize, 1..7_usize)),
        decreasing: bool,
    ) {
        let [data, display] = [data, display].map(|(left, top, width, height)| [left, top, width, height]);
        let line_order = if decreasing { LineOrder::Decreasing } else { LineOrder::Increasing };
        let blocks = tile.map_or(Blocks::ScanLines, |(width, height)| Blocks::Tiles(Vec2(width, height)));
        let file = written(data, display, Encoding { compression, blocks, line_order }, FlatSamples::F32);
        let expected = shown(data, display);
        if expected.iter().all(|value| *value == 0.0) {
            let error = decode(&file, &limits()).unwrap_err().to_string();
            prop_assert!(error.contains("outside the displayWindow"), "{}", error);
        } else {
            let image = decode(&file, &limits()).unwrap();
            prop_assert_eq!([image.width as i32, image.height as i32], [display[2], display[3]]);
            prop_assert_eq!(image.empty, expected.iter().filter(|value| **value == 0.0).count() as u64);
            prop_assert_eq!(image.data, expected);
        }
    }
}

/// These compressions round, so the whole picture is held against a part of it.
#[test]
fn lossy_blocks_are_cut_as_the_others_are() {
    for compression in [Compression::PXR24, Compression::B44, Compression::B44A, Compression::DWAA(None)] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(7, 5))] {
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            let data = [-3, 4, 40, 70];
            let halves = |values: Vec<f32>| FlatSamples::F16(values.into_iter().map(f16::from_f32).collect());
            let read = |display| decode(&written(data, display, encoding, halves), &limits()).unwrap();
            let (whole, part) = (read(data), read([10, 20, 21, 43]));
            for (i, found) in part.data.iter().enumerate() {
                let (x, y) = (i % 21 + 13, i / 21 + 16);
                assert_eq!(*found, whole.data[y * 40 + x], "{compression:?} {blocks:?}");
            }
        }
    }
}

#[test]
fn channels_keep_their_place_in_a_part_of_a_picture() {
    let file = Exr::cropped([2, 1, 4, 3], [0, 0, 8, 6]);
    let file = file.channel("B", |_, _| 3.0).channel("G", |_, _| 2.0).channel("R", value);
    let image = decode(&file.write(), &limits()).unwrap();
    let texel = |x: usize, y: usize| &image.data[3 * (y * 8 + x)..][..3];
    assert_eq!(texel(2, 1), [value(2, 1), 2.0, 3.0]);
    assert_eq!(texel(5, 3), [value(5, 3), 2.0, 3.0]);
    assert_eq!([texel(1, 1), texel(6, 3), texel(2, 4)], [[0.0; 3].as_slice(); 3]);
}

#[test]
fn rows_from_below_are_the_same_picture() {
    let mut file = Exr::cropped([-2, 3, 6, 9], [0, 5, 3, 9]).channel("Y", value);
    let upright = decode(&file.write(), &limits()).unwrap();
    file.decreasing = true;
    assert_eq!(decode(&file.write(), &limits()).unwrap(), upright);
}

#[test]
fn a_display_window_that_is_missing_is_refused() {
    let mut file = Exr::of(3, 2).channel("Y", value);
    file.display = None;
    let error = decode(&file.write(), &limits()).unwrap_err().to_string();
    assert!(error.contains("displayWindow is missing"), "{error}");
}

/// What is not shown may hold anything: it is cut off before it is looked at.
#[test]
fn beyond_the_picture_nothing_is_looked_at() {
    let beyond = |inside: f32, outside: f32| {
        move |x: i32, y: i32| if (0..4).contains(&x) && (0..4).contains(&y) { inside } else { outside }
    };
    let over = || Exr::cropped([-2, -2, 8, 8], [0, 0, 4, 4]);
    let file = over().channel("A", beyond(1.0, 0.0)).channel("Y", beyond(0.5, f32::NAN));
    assert_eq!(decode(&file.write(), &limits()).unwrap().data, [0.5; 16]);
    // Alpha counts where there are samples: outside the data window a picture is empty by its nature.
    assert_eq!(decode(&cropped_with_alpha(), &limits()).unwrap().empty, 36);
    let file = over().channel("A", |x, y| if (x, y) == (1, 2) { 0.5 } else { 1.0 }).channel("Y", value);
    let Err(ImageError::Transparent(wrong)) = decode(&file.write(), &limits()) else { panic!("transparent") };
    assert_eq!((wrong.count, wrong.of, wrong.value, wrong.column, wrong.row), (1, 16, 0.5, 1, 2));
}
