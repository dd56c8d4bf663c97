//! Where a stratiform layer's cloud is: between two edges, of which the one that is not given follows from a thickness.

use super::image_reference::ImagePurpose;
use super::model::{Droplets, ImageName, Resolve, Thickness, Wind};
use super::parse::{BASE_M, default, image, thickness};
use super::quantity::*;
use super::read::{Object, Reader};
use super::synthetic::DepthLaw;
use super::write;
use serde_json::{Value, json};

/// Fields of a stratiform layer that tell its shape.
pub(super) const FIELDS: [&str; 9] =
    ["flat", "base_m", "top_m", "base", "top", "thickness", "optical_depth", "effective_radius", "profile"];
/// Which edge of a layer may be flat.
pub(super) const FLAT: [&str; 2] = ["base", "top"];

/// How extinction may change with height.
pub(super) const PROFILES: [&str; 2] = ["uniform", "adiabatic"];

/// Where a stratiform layer's cloud is, and how dense: at least one of the edges is given; where both are, there is no
/// thickness of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// The lower edge.
    pub base: Edge<BaseM>,
    /// The upper edge.
    pub top: Edge<TopM>,
    /// From one edge to the other. Where neither it nor the other edge is given, it is the same everywhere, and such that
    /// the droplets' extinction makes the mean optical depth of the cloudy columns.
    pub thickness: Option<Thickness>,
    /// Optical depth of the columns; without it their extinction is the droplets'.
    pub optical_depth: Option<DepthMap>,
    /// Effective radius of the columns' droplets, where it isn't that of the layer's.
    pub effective_radius: Option<RadiusMap>,
    /// How a column's extinction changes from its base to its top.
    pub profile: ExtinctionProfile,
}

/// How extinction changes within a column, whose optical depth is the same with any profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExtinctionProfile {
    /// Not at all.
    Uniform,
    /// It grows with the height above the base, to the power of 2/3: as where rising air condenses water in proportion to height on as many
    /// droplets everywhere (Brenguier et al. 2000, J. Atmos. Sci. 57, 803).
    Adiabatic,
}

impl ExtinctionProfile {
    /// As maps of columns tell it: 1 where extinction grows.
    pub(crate) fn on_device(self) -> u32 {
        (self == Self::Adiabatic).into()
    }
}

/// An edge of a layer.
#[derive(Debug, Clone, PartialEq)]
pub enum Edge<Height> {
    /// Follows from the other edge and the thickness.
    Open,
    /// At the same height everywhere.
    Flat(Height),
    /// A map of heights above the ground.
    Map(HeightMap),
}

/// Heights above the ground: an image's first channel times a scale, plus an offset; bilinear and periodic.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    /// Name of the image.
    pub image: ImageName,
    /// Metres for a sample of 1.
    pub scale_m: ThicknessM,
    /// Height of a sample of 0.
    pub offset_m: OffsetM,
    /// The sample that stands for "no cloud".
    pub fill: Option<FillValue>,
}

/// Optical depth at 550 nm: an image's first channel times a scale, bilinear and periodic.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthMap {
    /// Name of the image.
    pub image: ImageName,
    /// Optical depth for a sample of 1.
    pub scale: DepthScale,
    /// The sample that stands for "no cloud".
    pub fill: Option<FillValue>,
}

/// Effective radius of the droplets of columns: an image's first channel times a scale.
#[derive(Debug, Clone, PartialEq)]
pub struct RadiusMap {
    /// Name of the image.
    pub image: ImageName,
    /// Micrometres for a sample of 1.
    pub scale_um: RadiusScaleUm,
    /// The sample that stands for "no cloud".
    pub fill: Option<FillValue>,
}

impl HeightMap {
    /// The height that a sample stands for; `None` where there is no cloud.
    pub(crate) fn height_m(&self, sample: f32) -> Option<f64> {
        let height_m = || self.offset_m.get() + self.scale_m.get() * f64::from(sample);
        (!is_fill(self.fill, sample)).then(height_m)
    }
}

impl DepthMap {
    /// The optical depth that a sample stands for; `None` where there is no cloud.
    pub(crate) fn depth(&self, sample: f32) -> Option<f64> {
        (!is_fill(self.fill, sample)).then(|| self.scale.get() * f64::from(sample))
    }
}

impl RadiusMap {
    /// The radius that a sample stands for, µm; `None` where there is no cloud.
    pub(crate) fn radius_um(&self, sample: f32) -> Option<f64> {
        (!is_fill(self.fill, sample)).then(|| self.scale_um.get() * f64::from(sample))
    }
}

/// Whether a sample is a stated fill value, as exactly as single precision and the sample's division by the largest allow.
pub(crate) fn is_fill(fill: Option<FillValue>, sample: f32) -> bool {
    fill.is_some_and(|fill| (f64::from(sample) - fill.get()).abs() <= 1e-6 * fill.get().abs())
}

impl Shape {
    /// The images that it names, by field, and what for.
    pub(super) fn images(&self) -> Vec<(&'static str, &ImageName, ImagePurpose)> {
        let mut found = Vec::new();
        let height = |map: &HeightMap, most_m: f64| ImagePurpose::Height {
            scale_m: map.scale_m.get(),
            offset_m: map.offset_m.get(),
            most_m,
            fill: map.fill,
        };
        if let Edge::Map(map) = &self.base {
            found.push(("base", &map.image, height(map, *BaseM::RANGE.end())));
        }
        if let Edge::Map(map) = &self.top {
            found.push(("top", &map.image, height(map, *TopM::RANGE.end())));
        }
        if let Some(Thickness::Map { image, scale_m, fill }) = &self.thickness {
            found.push(("thickness", image, ImagePurpose::Thickness { scale_m: scale_m.get(), fill: *fill }));
        }
        if let Some(map) = &self.optical_depth {
            let purpose = ImagePurpose::OpticalDepth { scale: map.scale.get(), fill: map.fill };
            found.push(("optical_depth", &map.image, purpose));
        }
        if let Some(map) = &self.effective_radius {
            let purpose = ImagePurpose::EffectiveRadius { scale_um: map.scale_um.get(), fill: map.fill };
            found.push(("effective_radius", &map.image, purpose));
        }
        found
    }

    /// Names of the images of its maps, which have one size.
    pub(crate) fn image_names(&self) -> impl Iterator<Item = &ImageName> {
        self.images().into_iter().map(|(_, image, _)| image)
    }

    /// Whether columns have bases, tops or extinctions of their own, by maps.
    pub(crate) fn has_maps(&self) -> bool {
        let edges = matches!(self.base, Edge::Map(_)) || matches!(self.top, Edge::Map(_));
        edges || self.optical_depth.is_some() || self.effective_radius.is_some()
    }

    /// Height of the flat top that cloud hangs down from, if it is a thickness alone that makes its base.
    pub(crate) fn hangs_from_m(&self) -> Option<f64> {
        match (&self.top, self.has_maps()) {
            (Edge::Flat(top_m), false) => Some(top_m.get()),
            _ => None,
        }
    }

    /// Whether the top does not tell how deep the cloud is: it is flat, or optical depth has a map of its own.
    pub(crate) fn is_deep_below(&self) -> bool {
        matches!(self.top, Edge::Flat(_)) || self.optical_depth.is_some()
    }

    /// Whether it is a synthetic field of columns that thin out at gaps.
    pub(crate) fn thins_out(&self) -> bool {
        matches!(&self.thickness, Some(Thickness::Stratocumulus(field)) if field.law != DepthLaw::Lognormal)
    }

    /// Whether all columns are the same.
    pub(crate) fn is_even(&self) -> bool {
        !self.has_maps() && matches!(self.thickness, Some(Thickness::Uniform(_)))
    }

    /// Whether the sky may be seen between its clouds: of maps nothing else is known without their images.
    pub(crate) fn may_have_gaps(&self) -> bool {
        let closed = match &self.thickness {
            Some(Thickness::Uniform(_)) => true,
            Some(Thickness::Stratocumulus(field)) => field.coverage.get() >= 1.0,
            Some(Thickness::Map { .. }) | None => false,
        };
        self.has_maps() || !closed
    }

    /// The least height that is known without images.
    pub(crate) fn flat_base_m(&self) -> Option<f64> {
        match (&self.base, &self.thickness) {
            (Edge::Flat(base_m), _) => Some(base_m.get()),
            (Edge::Open, Some(Thickness::Uniform(metres))) => self.hangs_from_m().map(|top_m| top_m - metres.get()),
            _ => None,
        }
    }
}

/// Height that a layer's JSON gives, or that of a flat base that it does not give, and the field that does: to compare it with its
/// neighbours before all is valid.
pub(super) fn stated_height(
    layer: &Value,
    misspelt: impl Fn(&str) -> bool,
    fallback_m: f64,
) -> Option<(f64, &'static str)> {
    let map = layer.as_object()?;
    let number = |key: &str| map.get(key).and_then(Value::as_f64);
    match map.get("base_m") {
        Some(_) => number("base_m").filter(|height| BaseM::RANGE.contains(height)).map(|height| (height, "base_m")),
        None if map.contains_key("base") => None,
        // A map of the top and no word of the base: hung from the map. With `flat` the base is flat, and its height the default.
        None if map.contains_key("top") && !map.contains_key("flat") => None,
        None if map.contains_key("top_m") || map.get("flat").is_some_and(|flat| flat == "top") => {
            number("top_m").filter(|height| TopM::RANGE.contains(height)).map(|height| (height, "top_m"))
        }
        // Misspelt, which is told elsewhere.
        None if misspelt("base_m") => None,
        None => Some((fallback_m, "base_m")),
    }
}

/// Reads a stratiform layer's shape.
pub(super) fn read(reader: &mut Reader, layer: &Object<'_>, resolve: Resolve<'_>) -> Option<Shape> {
    let flat_top = layer.has("flat") && reader.word(layer, "flat", &FLAT) == Some("top");
    one_of(reader, layer, flat_top);
    let base = match (layer.has("base"), layer.has("base_m") || layer.has("flat") || !layer.has("top")) {
        (true, _) => height_map(reader, layer, "base", resolve).map(Edge::Map),
        (false, true) if !flat_top => Some(Edge::Flat(reader.number_or(layer, "base_m", default(BASE_M)?))),
        (false, _) => Some(Edge::Open),
    };
    let top = match (layer.has("top"), flat_top) {
        (true, _) => height_map(reader, layer, "top", resolve).map(Edge::Map),
        (false, true) => reader.number(layer, "top_m").map(Edge::Flat),
        (false, false) => Some(Edge::Open),
    };
    let optical_depth = match layer.has("optical_depth") {
        true => Some(depth_map(reader, layer, resolve)),
        false => None,
    };
    let effective_radius = match layer.has("effective_radius") {
        true => Some(radius_map(reader, layer, resolve)),
        false => None,
    };
    let both = !matches!((&base, &top), (Some(Edge::Open), _) | (_, Some(Edge::Open)));
    let thickness = match (layer.has("thickness"), both) {
        (true, true) => {
            reader.wrong(layer.at("thickness"), "base and top are given, so that it follows from them: leave it out");
            return None;
        }
        (false, true) => None,
        (false, false) if optical_depth.is_some() => None,
        (_, false) => Some(thickness(reader, layer, resolve)),
    };
    let optical_depth = if let Some(read) = optical_depth { Some(read?) } else { None };
    let effective_radius = if let Some(read) = effective_radius { Some(read?) } else { None };
    let thickness = if let Some(read) = thickness { Some(read?) } else { None };
    let profile = match layer.has("profile") {
        true => match reader.word(layer, "profile", &PROFILES)? {
            "adiabatic" => ExtinctionProfile::Adiabatic,
            _ => ExtinctionProfile::Uniform,
        },
        false => ExtinctionProfile::Uniform,
    };
    let shape = Shape { base: base?, top: top?, thickness, optical_depth, effective_radius, profile };
    fits(reader, layer, &shape);
    Some(shape)
}

/// Each edge is given once.
fn one_of(reader: &mut Reader, layer: &Object<'_>, flat_top: bool) {
    for (number, map) in [("base_m", "base"), ("top_m", "top")] {
        if layer.has(number) && layer.has(map) {
            reader.wrong(layer.at(number), format!("given beside `{map}`, which is a map of it: leave one out"));
        }
    }
    if flat_top && layer.has("base_m") && !layer.has("base") {
        let detail =
            "the top is flat, at `top_m`, and the base follows from `thickness` or from a map `base`: leave it out";
        reader.wrong(layer.at("base_m"), detail);
    }
    if flat_top && layer.has("top") {
        reader.wrong(layer.at("flat"), "the top is a map: leave `flat` out");
    }
    if layer.has("flat") && !flat_top && layer.has("base") {
        reader.wrong(layer.at("flat"), "the base is a map: leave `flat` out");
    }
    if layer.has("top_m") && !flat_top && !layer.has("top") {
        reader.wrong(layer.at("top_m"), "is the height of a flat top: say `\"flat\": \"top\"` with it");
    }
}

/// Rules between fields that are valid by themselves.
fn fits(reader: &mut Reader, layer: &Object<'_>, shape: &Shape) {
    if shape.has_maps() && matches!(shape.thickness, Some(Thickness::Stratocumulus(_))) {
        let detail = "a synthetic field has columns of its own and none of the maps `base`, `top`, `optical_depth`, \
                      `effective_radius`; allowed beside them: uniform, image";
        reader.wrong(format!("{}/kind", layer.at("thickness")), detail);
    }
    let Some(top_m) = shape.hangs_from_m() else { return };
    let (deepest_m, field, what) = match &shape.thickness {
        Some(Thickness::Uniform(metres)) => (metres.get(), "metres", "is"),
        // The soft clip of synthetic fields.
        Some(Thickness::Stratocumulus(field)) => {
            (2.5 * field.mean_m.get(), "mean_m", "times 2.5, its deepest cloud, is")
        }
        _ => return,
    };
    if deepest_m > top_m {
        let detail = format!("{what} {deepest_m} m, and the flat top is {top_m} m above the ground; at most that");
        reader.wrong(format!("{}/{field}", layer.at("thickness")), detail);
    }
}

/// Eddies move what is a thickness alone.
pub(super) fn moves_as_asked(reader: &mut Reader, layer: &Object<'_>, shape: &Shape, wind: &Wind) {
    if shape.has_maps() && wind.turbulence_m_s.get() > 0.0 {
        let detail = "eddies move layers whose thickness alone is a map; with `base`, `top`, `optical_depth` or `effective_radius`: 0";
        reader.wrong(format!("{}/turbulence_m_s", layer.at("wind")), detail);
    }
}

/// Only of droplets of water are optics known by their size.
pub(super) fn sized_as_asked(reader: &mut Reader, layer: &Object<'_>, shape: &Shape, droplets: &Droplets) {
    if shape.effective_radius.is_some() && !matches!(droplets, Droplets::Gamma { .. }) {
        let detail = "is that of droplets of water, and `droplets` give a phase function: leave one of them out";
        reader.wrong(layer.at("effective_radius"), detail);
    }
}

fn height_map(reader: &mut Reader, layer: &Object<'_>, key: &str, resolve: Resolve<'_>) -> Option<HeightMap> {
    let object = reader.child(layer, key, &["image", "scale_m", "offset_m", "fill"])?;
    let image = image(reader, &object, resolve);
    let scale_m = reader.number(&object, "scale_m");
    let offset_m = reader.number_or(&object, "offset_m", default(0.0)?);
    let fill = fill(reader, &object);
    Some(HeightMap { image: image?, scale_m: scale_m?, offset_m, fill })
}

pub(super) fn depth_map(reader: &mut Reader, layer: &Object<'_>, resolve: Resolve<'_>) -> Option<DepthMap> {
    let object = reader.child(layer, "optical_depth", &["image", "scale", "fill"])?;
    let image = image(reader, &object, resolve);
    let scale = reader.number_or(&object, "scale", default(1.0)?);
    let fill = fill(reader, &object);
    Some(DepthMap { image: image?, scale, fill })
}

fn radius_map(reader: &mut Reader, layer: &Object<'_>, resolve: Resolve<'_>) -> Option<RadiusMap> {
    let object = reader.child(layer, "effective_radius", &["image", "scale_um", "fill"])?;
    let image = image(reader, &object, resolve);
    let scale_um = reader.number_or(&object, "scale_um", default(1.0)?);
    let fill = fill(reader, &object);
    Some(RadiusMap { image: image?, scale_um, fill })
}

/// The sample that stands for "no cloud", if one is stated.
pub(super) fn fill(reader: &mut Reader, map: &Object<'_>) -> Option<FillValue> {
    if map.has("fill") { reader.number(map, "fill") } else { None }
}

/// Adds a shape's fields to a layer's JSON.
pub(super) fn write(shape: &Shape, layer: &mut Value) {
    match &shape.base {
        Edge::Open => {}
        Edge::Flat(base_m) => layer["base_m"] = json!(base_m.get()),
        Edge::Map(map) => layer["base"] = height_map_json(map),
    }
    match &shape.top {
        Edge::Open => {}
        Edge::Flat(top_m) => {
            layer["flat"] = json!("top");
            layer["top_m"] = json!(top_m.get());
        }
        Edge::Map(map) => layer["top"] = height_map_json(map),
    }
    if let Some(thickness) = &shape.thickness {
        layer["thickness"] = write::thickness(thickness);
    }
    if let Some(map) = &shape.optical_depth {
        let text = json!({ "image": map.image.0, "scale": map.scale.get() });
        layer["optical_depth"] = write::with_fill(text, map.fill);
    }
    if let Some(map) = &shape.effective_radius {
        let text = json!({ "image": map.image.0, "scale_um": map.scale_um.get() });
        layer["effective_radius"] = write::with_fill(text, map.fill);
    }
    // Scenes without it keep their names.
    if shape.profile == ExtinctionProfile::Adiabatic {
        layer["profile"] = json!("adiabatic");
    }
}

fn height_map_json(map: &HeightMap) -> Value {
    let text = json!({ "image": map.image.0, "scale_m": map.scale_m.get(), "offset_m": map.offset_m.get() });
    write::with_fill(text, map.fill)
}
