//! Truth for light in cumulus: `tests/data/cumulus`, see its README.

use glam::DVec3;
use skyloom::cumulus::{Body, Sphere};
use std::path::PathBuf;

/// A cloud of the truth.
pub(crate) struct Shape {
    pub(crate) name: &'static str,
    pub(crate) extinction_per_m: f64,
    /// Repeats so far away that it is alone.
    pub(crate) body: Body,
    json: serde_json::Value,
}

/// A picture of it: 36 rows of 48, the top one first.
pub(crate) struct Picture {
    pub(crate) eye: DVec3,
    pub(crate) rays: Vec<DVec3>,
    /// Names of suns.
    pub(crate) suns: Vec<String>,
    columns: Vec<(String, Vec<f64>)>,
}

fn read(name: &str) -> Vec<u8> {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "tests/data/cumulus", name].iter().collect();
    std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn floats(name: &str) -> Vec<f64> {
    let bytes = read(name);
    bytes.as_chunks::<4>().0.iter().map(|&b| f64::from(f32::from_le_bytes(b))).collect()
}

fn vector(json: &serde_json::Value) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|i| json[i].as_f64().unwrap()))
}

impl Shape {
    pub(crate) fn named(name: &'static str) -> Self {
        let all: serde_json::Value = serde_json::from_slice(&read("cumulus.json")).unwrap();
        let json = all[name].clone();
        let numbers = floats(&format!("{name}.spheres.f32"));
        let sphere = |n: &[f64; 4]| Sphere { centre: DVec3::new(n[0], n[1], n[2]), radius_m: n[3] };
        let spheres = numbers.as_chunks::<4>().0.iter().map(sphere).collect();
        let base_m = json["base_m"].as_f64().unwrap_or(0.0);
        let body = Body { spheres, base_m, edge_m: 0.0, relief_m: 0.0, extent_m: 4000.0 };
        Self { name, extinction_per_m: json["extinction_per_m"].as_f64().unwrap(), body, json }
    }

    /// Towards a sun.
    pub(crate) fn sun(&self, name: &str) -> DVec3 {
        vector(&self.json["suns"][name])
    }

    /// `side` of all, `above` and `below` of `hier`.
    pub(crate) fn picture(&self, view: &str) -> Picture {
        let json = &self.json["views"][view];
        let words = |json: &serde_json::Value| -> Vec<String> {
            json.as_array().unwrap().iter().map(|word| word.as_str().unwrap().to_owned()).collect()
        };
        let rays = floats(&format!("{}_{view}.rays.f32", self.name));
        let rays = rays.as_chunks::<3>().0.iter().map(|&ray| DVec3::from_array(ray).normalize()).collect();
        let bytes = read(&format!("{}_{view}.columns.f16", self.name));
        let values: Vec<f64> = bytes.as_chunks::<2>().0.iter().map(|&b| half::f16::from_le_bytes(b).to_f64()).collect();
        let names = words(&json["columns"]);
        let column = |i: usize| values.iter().skip(i).step_by(names.len()).copied().collect();
        let columns = names.iter().enumerate().map(|(i, name)| (name.clone(), column(i))).collect();
        Picture { eye: vector(&json["eye"]), rays, suns: words(&json["suns"]), columns }
    }
}

impl Picture {
    pub(crate) fn column(&self, name: &str) -> &[f64] {
        &self.columns.iter().find(|(own, _)| own == name).unwrap_or_else(|| panic!("no column {name}")).1
    }

    /// Light of a sun, all orders, and its standard error.
    pub(crate) fn truth(&self, sun: &str) -> (Vec<f64>, &[f64]) {
        let (first, more) = (self.column(&format!("{sun}.order1")), self.column(&format!("{sun}.orders2up")));
        let all = first.iter().zip(more).map(|(a, b)| a + b).collect();
        (all, self.column(&format!("{sun}.se_orders2up")))
    }

    /// Root mean square of what `picture` errs beyond the noise of the truth, against the truth's own, over pixels with an optical
    /// depth above .2; and how much brighter it is in the mean.
    pub(crate) fn score(&self, picture: &[f64], sun: &str) -> (f64, f64) {
        let (truth, se) = self.truth(sun);
        let mut sums = [0.0; 4];
        for (i, &depth) in self.column("tau").iter().enumerate() {
            if depth > 0.2 {
                sums[0] += (picture[i] - truth[i]).powi(2) - se[i].powi(2);
                sums[1] += truth[i].powi(2);
                sums[2] += picture[i];
                sums[3] += truth[i];
            }
        }
        ((sums[0].max(0.0) / sums[1]).sqrt(), sums[2] / sums[3] - 1.0)
    }
}
