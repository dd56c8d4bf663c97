//! Pictures of cumulus by Monte Carlo in three dimensions: `tests/data/cumulus`, see its README.

use crate::chart::file::ChartError;
use crate::cumulus::{Body, Sphere};
use glam::DVec3;
use half::f16;
use serde_json::Value;

/// A cloud.
pub(super) struct Cloud {
    pub(super) name: &'static str,
    pub(super) extinction_per_m: f64,
    /// Repeats so far away that it is alone.
    pub(super) body: Body,
    pub(super) pictures: Vec<Picture>,
    json: Value,
}

/// A picture of it.
pub(super) struct Picture {
    pub(super) view: &'static str,
    pub(super) eye: DVec3,
    pub(super) rays: Vec<DVec3>,
    /// Names of suns.
    pub(super) suns: Vec<String>,
    columns: Vec<(String, Vec<f64>)>,
}

macro_rules! data {
    ($name:literal) => {
        include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/cumulus/", $name))
    };
}

/// View, rays, columns.
type View = (&'static str, &'static [u8], &'static [u8]);

const CLOUDS: [(&str, &[u8], &[View]); 3] = [
    ("one", data!("one.spheres.f32"), &[("side", data!("one_side.rays.f32"), data!("one_side.columns.f16"))]),
    ("three", data!("three.spheres.f32"), &[("side", data!("three_side.rays.f32"), data!("three_side.columns.f16"))]),
    (
        "hier",
        data!("hier.spheres.f32"),
        &[
            ("side", data!("hier_side.rays.f32"), data!("hier_side.columns.f16")),
            ("above", data!("hier_above.rays.f32"), data!("hier_above.columns.f16")),
            ("below", data!("hier_below.rays.f32"), data!("hier_below.columns.f16")),
        ],
    ),
];

const DAMAGED: ChartError = ChartError::Empty("the pictures of cumulus are damaged");

fn floats(bytes: &[u8]) -> Vec<f64> {
    bytes.as_chunks::<4>().0.iter().map(|&b| f64::from(f32::from_le_bytes(b))).collect()
}

fn vector(json: &Value) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|i| json[i].as_f64().unwrap_or(0.0)))
}

fn words(json: &Value) -> Vec<String> {
    json.as_array().into_iter().flatten().filter_map(|word| word.as_str().map(str::to_owned)).collect()
}

/// All of them.
pub(super) fn clouds() -> Result<Vec<Cloud>, ChartError> {
    let all: Value = serde_json::from_slice(data!("cumulus.json")).map_err(|_json| DAMAGED)?;
    let cloud = |&(name, spheres, views): &(&'static str, &[u8], &[View])| {
        let json = all[name].clone();
        let numbers = floats(spheres);
        let sphere = |n: &[f64; 4]| Sphere { centre: DVec3::new(n[0], n[1], n[2]), radius_m: n[3] };
        let body = Body {
            spheres: numbers.as_chunks::<4>().0.iter().map(sphere).collect(),
            base_m: json["base_m"].as_f64().unwrap_or(0.0),
            edge_m: 0.0,
            relief_m: 0.0,
            extent_m: 4000.0,
        };
        let pictures = views.iter().map(|view| Picture::new(&json["views"][view.0], view)).collect();
        Ok(Cloud { name, extinction_per_m: json["extinction_per_m"].as_f64().ok_or(DAMAGED)?, body, pictures, json })
    };
    CLOUDS.iter().map(cloud).collect()
}

impl Cloud {
    /// Towards a sun.
    pub(super) fn sun(&self, name: &str) -> DVec3 {
        vector(&self.json["suns"][name])
    }
}

impl Picture {
    fn new(json: &Value, (view, rays, columns): &View) -> Self {
        let rays = floats(rays);
        let rays = rays.as_chunks::<3>().0.iter().map(|&ray| DVec3::from_array(ray).normalize()).collect();
        let values: Vec<f64> = columns.as_chunks::<2>().0.iter().map(|&b| f16::from_le_bytes(b).to_f64()).collect();
        let names = words(&json["columns"]);
        let column = |i: usize| values.iter().skip(i).step_by(names.len()).copied().collect();
        let columns = names.iter().enumerate().map(|(i, name)| (name.clone(), column(i))).collect();
        Self { view, eye: vector(&json["eye"]), rays, suns: words(&json["suns"]), columns }
    }

    fn column(&self, name: &str) -> &[f64] {
        self.columns.iter().find(|(own, _)| own == name).map_or(&[], |(_, values)| values)
    }

    /// Its rays that meet cloud.
    pub(super) fn cloudy(&self) -> Vec<DVec3> {
        let rays = self.rays.iter().zip(self.column("tau"));
        rays.filter(|(_, depth)| **depth > 0.2).map(|(ray, _)| *ray).collect()
    }

    /// Root mean square of what light errs beyond the noise of the truth, against the truth's own, over pixels with an optical depth above
    /// .2; and how much brighter it is in the mean. Of the sun's light, or of an even sky's.
    pub(super) fn score(&self, light: &[f64], sun: Option<&str>) -> [f64; 2] {
        let (first, more, noise) = match sun {
            Some(sun) => (format!("{sun}.order1"), format!("{sun}.orders2up"), format!("{sun}.se_orders2up")),
            None => (String::new(), "sky".to_owned(), "se_sky".to_owned()),
        };
        let first = self.column(&first).iter().copied().chain(std::iter::repeat(0.0));
        let truth = first.zip(self.column(&more)).zip(self.column(&noise));
        let mut sums = [0.0; 4];
        for ((light, depth), ((first, more), noise)) in light.iter().zip(self.column("tau")).zip(truth) {
            if *depth > 0.2 {
                let exact = first + more;
                sums[0] += (light - exact).powi(2) - noise * noise;
                sums[1] += exact * exact;
                sums[2] += light;
                sums[3] += exact;
            }
        }
        [(sums[0].max(0.0) / sums[1]).sqrt(), sums[2] / sums[3] - 1.0]
    }
}
