//! How thick a layer is, as a distribution: without its map, and the same at all times.

use super::columns::ColumnMap;
use super::gamma::GammaLaw;
use super::image_metres::metres;
use super::synthetic;
use super::transfer::{Distribution, calibrate};
use crate::image::{Image, MissingImage};
use crate::scene::quantity::Quantity as _;
use crate::scene::{DepthLaw, Layer, Thickness};
use std::collections::HashMap;
use std::sync::Arc;

/// Columns that stand for a field. Means over them of what a cloud does with light differ from those over 2048 by 1e-3 at most.
const COLUMNS: usize = 48;

/// A column of a layer, and the part of the domain that is like it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Part of the domain, 0 to 1.
    pub part: f64,
    /// Thickness of the cloud, m; 0 where there is none.
    pub thickness_m: f64,
}

/// How deep a layer is, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Mean height of the cloudy columns' bases above the ground, m.
    pub base_m: f64,
    /// Mean height of their tops above that, m, where it is not the mean of the columns' thickness.
    pub own_thickness_m: Option<f64>,
    /// Its columns: as thick as cloud of the layer's extinction had to be for their optical depths.
    pub columns: Vec<Column>,
}

/// Where the cloud of a layer is, without its map. `images` are those that the scene names, `extinction_per_m` is that of the
/// layer's droplets at 550 nm.
///
/// # Errors
/// The layer's image is not among them.
pub fn profile(
    layer: &Layer,
    images: &HashMap<String, Arc<Image>>,
    extinction_per_m: f64,
) -> Result<Profile, MissingImage> {
    let shape = &layer.shape;
    if shape.has_maps() {
        let map = ColumnMap::new(layer, images, extinction_per_m)?;
        let [base_m, top_m] = map.mean_m;
        let paths_m: Vec<f32> = map.paths_m().collect();
        return Ok(Profile { base_m, own_thickness_m: Some(top_m - base_m), columns: of_metres(&paths_m) });
    }
    let (columns, lift_m) = match &shape.thickness {
        Some(thickness) => columns(thickness, images)?,
        None => (Vec::new(), 0.0),
    };
    let base_m = match (shape.flat_base_m(), shape.hangs_from_m()) {
        (Some(base_m), _) => base_m + lift_m,
        (None, top_m) => top_m.unwrap_or(0.0) - mean_m(&columns),
    };
    Ok(Profile { base_m, own_thickness_m: None, columns })
}

/// Mean thickness of the cloudy columns, m.
pub(crate) fn mean_m(columns: &[Column]) -> f64 {
    let cloudy = columns.iter().filter(|column| column.thickness_m > 0.0);
    let (part, sum) = cloudy.fold((0.0, 0.0), |(part, sum), c| (part + c.part, sum + c.part * c.thickness_m));
    if part > 0.0 { sum / part } else { 0.0 }
}

/// The columns of a layer by its thickness; their parts add up to 1. A synthetic field is taken as its distribution is meant: that of any one
/// field of finite size differs a little. And the mean height of the cloudy columns' bases above the lowest one, m, where cloud stands.
/// `images` are those that the scene names.
fn columns(thickness: &Thickness, images: &HashMap<String, Arc<Image>>) -> Result<(Vec<Column>, f64), MissingImage> {
    let columns = match thickness {
        Thickness::Uniform(metres) => vec![Column { part: 1.0, thickness_m: metres.get() }],
        Thickness::Stratocumulus(wanted) => match wanted.law {
            DepthLaw::Lognormal => {
                let spread = synthetic::spread(wanted.pattern);
                let gaussian = Distribution::gaussian(synthetic::RANGE);
                let transfer = calibrate(&gaussian, wanted.coverage.get(), wanted.mean_m.get(), spread);
                grouped(&gaussian, |g| transfer.thickness((spread * g).exp()))
            }
            DepthLaw::Gamma(spread) => {
                let law = GammaLaw::new(wanted, spread.get());
                return Ok((grouped(&Distribution::ranks(), |rank| law.path(rank)), law.mean_lift_m()));
            }
        },
        Thickness::Map { image: name, scale_m, fill } => {
            let image = images.get(&name.0).ok_or_else(|| MissingImage(name.0.clone()))?;
            of_metres(&metres(image, scale_m.get(), *fill))
        }
    };
    Ok((columns, 0.0))
}

fn of_metres(metres: &[f32]) -> Vec<Column> {
    let greatest_m = f64::from(metres.iter().copied().fold(0.0, f32::max));
    if greatest_m <= 0.0 {
        return vec![Column { part: 1.0, thickness_m: 0.0 }];
    }
    grouped(&Distribution::of(metres, 0.0, greatest_m), |metres| metres)
}

/// A distribution in groups of like size, each with its mean; what is no cloud stands alone.
fn grouped(values: &Distribution, thickness_m: impl Fn(f64) -> f64) -> Vec<Column> {
    let bins: Vec<(f64, f64)> = values.parts().map(|(part, value)| (part, thickness_m(value))).collect();
    let none: f64 = bins.iter().filter(|(_, metres)| *metres <= 0.0).map(|(part, _)| part).sum();
    let mut columns = vec![Column { part: none, thickness_m: 0.0 }];
    let least = (1.0 - none) / COLUMNS as f64;
    let (mut part, mut sum) = (0.0, 0.0);
    let mut close = |part: &mut f64, sum: &mut f64| {
        columns.push(Column { part: *part, thickness_m: *sum / *part });
        (*part, *sum) = (0.0, 0.0);
    };
    for (bin_part, metres) in bins.into_iter().filter(|(_, metres)| *metres > 0.0) {
        part += bin_part;
        sum += bin_part * metres;
        if part >= least {
            close(&mut part, &mut sum);
        }
    }
    if part > 0.0 {
        close(&mut part, &mut sum);
    }
    columns.retain(|column| column.part > 0.0);
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn of(thickness: &str) -> Vec<Column> {
        let text = format!(
            r#"{{"layers": [{{"base_m": 900, "thickness": {thickness}, "droplets": {{"effective_radius_um": 7}}}}]}}"#
        );
        let scene = Scene::from_json(text.as_bytes()).unwrap();
        profile(&scene.layers[0], &HashMap::new(), 0.05).unwrap().columns
    }

    #[test]
    fn a_synthetic_field_has_its_coverage_and_mean() {
        for (coverage, mean) in [(0.0, 200.0), (0.02, 50.0), (0.55, 300.0), (1.0, 250.0)] {
            let columns = of(&format!(
                r#"{{"kind": "stratocumulus", "pattern": "fractal", "coverage": {coverage}, "mean_m": {mean}}}"#
            ));
            let parts: f64 = columns.iter().map(|column| column.part).sum();
            assert!((parts - 1.0).abs() < 1e-12);
            let cloudy: f64 = columns.iter().filter(|c| c.thickness_m > 0.0).map(|c| c.part).sum();
            let metres: f64 = columns.iter().map(|c| c.part * c.thickness_m).sum();
            // Rims below a metre count as no cloud in the coverage, and a bin is as wide as it is.
            assert!((cloudy - coverage).abs() < 0.01, "{coverage}: {cloudy}");
            assert!((metres - coverage * mean).abs() < 0.01 * mean, "{coverage}: {metres}");
        }
    }

    #[test]
    fn an_even_layer_is_one_column() {
        assert_eq!(of(r#"{"kind": "uniform", "metres": 120}"#), [Column { part: 1.0, thickness_m: 120.0 }]);
    }
}
