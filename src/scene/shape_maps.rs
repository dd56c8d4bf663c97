//! The maps of a layer's shape, texel by texel, and whether they fit together.

use super::images::ImageFindings;
use super::model::{Droplets, FieldError, Layer, Scene, Thickness};
use super::quantity::Quantity as _;
use super::shape::{Edge, Shape, is_fill};
use crate::image::{Image, MissingImage};
use std::collections::HashMap;
use std::sync::Arc;

/// Images by SHA-256.
type Images = HashMap<String, Arc<Image>>;

/// Radii whose mean is so many times that of the droplets, or the droplets' so many times theirs, are told: similar droplets err less.
const FAR_RADIUS: f64 = 1.3;

/// The maps of one layer, which has one at least. They have one size.
pub(crate) struct ShapeMaps<'a> {
    shape: &'a Shape,
    base: Option<&'a Image>,
    top: Option<&'a Image>,
    thickness: Option<&'a Image>,
    optical_depth: Option<&'a Image>,
    effective_radius: Option<&'a Image>,
    /// Texels across and down.
    pub(crate) size: [u32; 2],
}

/// A column of cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Column {
    /// Heights above the ground.
    pub(crate) base_m: f64,
    pub(crate) top_m: f64,
    /// Where it has one of its own.
    pub(crate) optical_depth: Option<f64>,
    /// Of its droplets, where it isn't the layer's.
    pub(crate) effective_radius_um: Option<f64>,
}

impl Column {
    /// Whether there is cloud in it, if it has any height.
    fn counts(&self) -> bool {
        self.optical_depth.is_none_or(|depth| depth > 0.0)
    }
}

impl<'a> ShapeMaps<'a> {
    /// # Errors
    /// One of the images is missing.
    pub(crate) fn new(shape: &'a Shape, images: &'a Images) -> Result<Self, MissingImage> {
        let named = |name: &str| match images.get(name) {
            Some(image) => Ok(&**image),
            None => Err(MissingImage(name.to_owned())),
        };
        let base = if let Edge::Map(map) = &shape.base { Some(named(&map.image.0)?) } else { None };
        let top = if let Edge::Map(map) = &shape.top { Some(named(&map.image.0)?) } else { None };
        let thickness = match &shape.thickness {
            Some(Thickness::Map { image, .. }) => Some(named(&image.0)?),
            _ => None,
        };
        let optical_depth = shape.optical_depth.as_ref().map(|map| named(&map.image.0)).transpose()?;
        let effective_radius = shape.effective_radius.as_ref().map(|map| named(&map.image.0)).transpose()?;
        let first = [base, top, thickness, optical_depth, effective_radius].into_iter().flatten().next();
        let size = first.map_or([1; 2], |image| [image.width, image.height]);
        Ok(Self { shape, base, top, thickness, optical_depth, effective_radius, size })
    }

    /// Columns in all.
    pub(crate) fn count(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// A column by its number, row by row; `None` where a map has its fill value. `derived_m`: thickness where none is given.
    /// No column reaches below the ground by a thickness that was not given.
    pub(crate) fn column(&self, number: usize, derived_m: f64) -> Option<Column> {
        let sample = |image: Option<&Image>| {
            image.and_then(|image| image.data.get(number * image.channels as usize)).copied().unwrap_or(0.0)
        };
        let optical_depth = match &self.shape.optical_depth {
            Some(map) => Some(map.depth(sample(self.optical_depth))?),
            None => None,
        };
        let effective_radius_um = match &self.shape.effective_radius {
            Some(map) => Some(map.radius_um(sample(self.effective_radius))?),
            None => None,
        };
        let given_m = match &self.shape.thickness {
            Some(Thickness::Uniform(metres)) => Some(metres.get()),
            Some(Thickness::Map { scale_m, fill, .. }) => {
                let sample = sample(self.thickness);
                if is_fill(*fill, sample) {
                    return None;
                }
                Some(f64::from(sample) * scale_m.get())
            }
            Some(Thickness::Stratocumulus(_)) | None => None,
        };
        let base = match &self.shape.base {
            Edge::Map(map) => Some(map.height_m(sample(self.base))?),
            Edge::Flat(base_m) => Some(base_m.get()),
            Edge::Open => None,
        };
        let top = match &self.shape.top {
            Edge::Map(map) => Some(map.height_m(sample(self.top))?),
            Edge::Flat(top_m) => Some(top_m.get()),
            Edge::Open => None,
        };
        let (base_m, top_m) = match (base, top) {
            (Some(base_m), Some(top_m)) => (base_m, top_m),
            (Some(base_m), None) => (base_m, base_m + given_m.unwrap_or(derived_m)),
            (None, Some(top_m)) => (given_m.map_or((top_m - derived_m).max(0.0), |metres| top_m - metres), top_m),
            (None, None) => return None,
        };
        Some(Column { base_m, top_m, optical_depth, effective_radius_um })
    }
}

/// The fields of a shape's maps and their sizes, against the first.
fn sizes_differ(maps: &ShapeMaps<'_>) -> Option<(&'static str, String)> {
    let named = [
        ("base", maps.base),
        ("top", maps.top),
        ("thickness", maps.thickness),
        ("optical_depth", maps.optical_depth),
        ("effective_radius", maps.effective_radius),
    ];
    let mut given = named.into_iter().filter_map(|(field, image)| image.map(|image| (field, image)));
    let (first, _) = given.next()?;
    let [width, height] = maps.size;
    let (field, image) = given.find(|(_, image)| [image.width, image.height] != maps.size)?;
    let detail = format!(
        "is {} x {} texels and that of `{first}` {width} x {height}; the maps of a layer must have one size",
        image.width, image.height
    );
    Some((field, detail))
}

impl Scene {
    /// Whether the maps of each layer fit together, and the layers on each other. What is wrong with one map alone was told.
    pub(super) fn check_shapes(&self, images: &Images, found: &mut ImageFindings) {
        let mut below: Option<(f64, usize)> = None;
        for (number, layer) in self.layers.iter().enumerate() {
            let place = self.place(number);
            let pointer = format!("/layers/{place}");
            if found.errors.iter().any(|error| error.pointer.starts_with(&format!("{pointer}/"))) {
                below = None;
                continue;
            }
            let mut wrong = |pointer: String, detail: String| found.errors.push(FieldError { pointer, detail });
            let lowest_m = match lowest_m(layer, images) {
                Ok(lowest_m) => lowest_m,
                Err((field, detail)) => {
                    wrong(format!("{pointer}{field}"), detail);
                    below = None;
                    continue;
                }
            };
            if let (Some(lowest_m), Some((below_m, under))) = (lowest_m, below)
                && lowest_m <= below_m
            {
                let detail = format!(
                    "its lowest base, {lowest_m} m, is not above that of layer {under}, {below_m} m; layers go bottom to top"
                );
                wrong(pointer, detail);
            }
            below = lowest_m.map(|lowest_m| (lowest_m, place));
            if let Some(detail) = far_radius(layer, images) {
                found.notes.push(FieldError { pointer: format!("/layers/{place}/effective_radius"), detail });
            }
        }
    }
}

/// A note where the radii of columns are far from that which the layer's tables are made for.
fn far_radius(layer: &Layer, images: &Images) -> Option<String> {
    let Droplets::Gamma { effective_radius_um, .. } = &layer.droplets else { return None };
    layer.shape.effective_radius.as_ref()?;
    let maps = ShapeMaps::new(&layer.shape, images).ok()?;
    let columns = (0..maps.count()).filter_map(|number| maps.column(number, 1.0)).filter(Column::counts);
    let radii = columns.filter_map(|column| column.effective_radius_um);
    let (count, sum) = radii.fold((0.0, 0.0), |(count, sum), radius| (count + 1.0, sum + radius));
    let (mean_um, own_um) = (sum / count, effective_radius_um.get());
    // Without columns there is no mean, and nothing is far from it.
    ((mean_um / own_um).ln().abs() > FAR_RADIUS.ln()).then(|| {
        format!(
            "{mean_um:.1} µm in the mean over the columns of cloud, and {own_um} µm in `droplets.effective_radius_um`, whose phase \
             function they have: give about the mean there"
        )
    })
}

/// Height of a layer's lowest base, if it is known; or the field that is wrong, and why.
fn lowest_m(layer: &Layer, images: &Images) -> Result<Option<f64>, (String, String)> {
    let shape = &layer.shape;
    if let (Some(top_m), Some(Thickness::Map { image, scale_m, .. })) = (shape.hangs_from_m(), &shape.thickness) {
        let greatest = images.get(&image.0).and_then(|image| image.extremes().first().map(|ends| ends.greatest));
        let deepest_m = f64::from(greatest.unwrap_or(0.0)) * scale_m.get();
        if deepest_m > top_m {
            let detail = format!("the deepest cloud is {deepest_m} m, and the flat top is {top_m} m above the ground");
            return Err(("/thickness/image".to_owned(), detail));
        }
        return Ok(Some(top_m - deepest_m));
    }
    if !shape.has_maps() {
        return Ok(shape.flat_base_m());
    }
    // A missing image was told.
    let Ok(maps) = ShapeMaps::new(shape, images) else { return Ok(None) };
    if let Some((field, detail)) = sizes_differ(&maps) {
        return Err((format!("/{field}/image"), detail));
    }
    let derived = shape.thickness.is_none() && (shape.base == Edge::Open || shape.top == Edge::Open);
    // What has no thickness of its own needs none to be told.
    let stand_in_m = if derived { 1.0 } else { 0.0 };
    let (mut lowest_m, mut flat, mut buried) = (f64::INFINITY, None, None);
    let (mut flat_count, mut buried_count) = (0_u64, 0_u64);
    for number in 0..maps.count() {
        let Some(column) = maps.column(number, stand_in_m).filter(Column::counts) else { continue };
        let least_m = if column.optical_depth.is_some() { f64::MIN_POSITIVE } else { 0.0 };
        if column.top_m - column.base_m < least_m {
            flat_count += 1;
            flat.get_or_insert((number, column));
        }
        if column.base_m < 0.0 {
            buried_count += 1;
            buried.get_or_insert((number, column));
        }
        lowest_m = lowest_m.min(column.base_m);
    }
    let place = |number: usize| {
        let width = maps.size[0] as usize;
        format!("the first in column {}, row {}", number % width, number / width)
    };
    let all = maps.count();
    if let Some((number, Column { base_m, top_m, .. })) = flat {
        let detail = format!(
            "the cloud's top is not above its base in {flat_count} of {all} texels, {} (base {base_m} m, top {top_m} m): \
             fill values for \"no data\" in one of the maps?",
            place(number)
        );
        return Err((String::new(), detail));
    }
    if let Some((number, Column { base_m, .. })) = buried {
        let detail = format!(
            "the cloud reaches below the ground in {buried_count} of {all} texels, {} (base {base_m} m)",
            place(number)
        );
        return Err((String::new(), detail));
    }
    Ok(lowest_m.is_finite().then_some(lowest_m))
}
