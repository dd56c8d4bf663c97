//! Claims about layers that are drawn together: each pass computes what its twin in `reference` computes, one behind the
//! other. See `tests/twins.rs` for how the two are compared.

#![expect(clippy::unwrap_used, reason = "a test stops where it fails")]
#![expect(clippy::panic, reason = "a test fails by panicking")]

#[path = "common/compare.rs"]
mod compare;
#[path = "common/twin_sky.rs"]
mod sky;
#[path = "common/twin.rs"]
mod twin;

use compare::Tolerance;
use glam::DVec2;
use serde_json::json;
use sky::{Sky, pattern};
use skyloom::gpu::layout::View;
use skyloom::reference::cloud::Shaded;
use skyloom::reference::{self, Map};
use skyloom::render::Stages;
use skyloom::slice::HostSlab;
use twin::{
    BEAM_REL, CANCEL, SLICE_REL, TABLE_REL, allowed, check_each, largest, lifted, map, maps, place_error, values,
};

/// A layer's stages, and its number.
fn layers(sky: &Sky, texture: &str, query: &[(&str, &str)]) -> Vec<Stages> {
    let number = |number: usize| sky.stages(texture, &[query, &[("layer", ["0", "1", "2"][number])]].concat());
    (0..=sky.above.len()).map(number).collect()
}

/// Maps of a layer as its twin reads them.
struct Maps {
    thickness: Map,
    tables: [Map; 2],
    light: [Map; 2],
    shares: [Map; 2],
}

impl Maps {
    fn new(stages: &Stages) -> Self {
        let tables = &stages.tables;
        let side = stages.light.from_below.len().isqrt();
        let light = [&stages.light.from_below, &stages.light.from_above];
        Self {
            thickness: map(&stages.thickness),
            tables: [&tables.transmittance, &tables.reflectance].map(map),
            light: light.map(|light| Map::from_f32(side, side, 3, light.as_flattened())),
            shares: stages.shares.each_ref().map(map),
        }
    }

    fn read<'a>(&'a self, from_above: bool, behind: &'a Map) -> reference::cloud::Maps<'a> {
        let [transmittance, reflectance] = &self.tables;
        let [from_below, from_above_light] = &self.light;
        let sun_share = &self.shares[usize::from(from_above)];
        reference::cloud::Maps {
            transmittance,
            reflectance,
            from_below,
            from_above: from_above_light,
            sun_share,
            behind,
            reaches: None,
        }
    }

    /// By how much its light may be misread, and that of its sun relative.
    fn places(&self) -> (f64, f64) {
        let share = self.shares.iter().map(|map| place_error(map, 4.0) / largest(map).max(1e-30)).fold(0.0, f64::max);
        (self.light.iter().map(|light| place_error(light, 4.0)).sum(), share)
    }
}

fn of_method(stages: &Stages) -> f64 {
    match stages.slab.as_ref().unwrap() {
        HostSlab::Forward(_) | HostSlab::Analytic(_) => TABLE_REL,
        HostSlab::Tabulated(_) => SLICE_REL,
    }
}

fn skies() -> [Sky; 3] {
    let high = json!({"henyey_greenstein": 0.8, "extinction_per_m": 0.03, "albedo": 0.999});
    let even = json!({"kind": "uniform", "metres": 40});
    [
        Sky { thickness: even.clone(), above: vec![(3000.0, even.clone(), high.clone())], ..Sky::at(50.0) },
        Sky { above: vec![(3000.0, pattern("closed", 0.7), high.clone())], ..Sky::at(70.0) },
        Sky { above: vec![(3000.0, even, high.clone()), (5000.0, pattern("open", 0.5), high)], ..Sky::at(30.0) },
    ]
}

#[test]
fn clouds_of_layers_that_are_drawn_together() {
    for (number, sky) in skies().iter().enumerate() {
        for query in [
            [("view", "below"), ("direction", "40,20"), ("method", "tabulated")],
            [("view", "below"), ("direction", "48,330"), ("method", "analytic")],
            [("view", "below"), ("direction", "45,160"), ("method", "forward")],
            [("view", "above"), ("direction", "30,100"), ("method", "tabulated")],
        ] {
            let whole = sky.stages("cloud", &query);
            let mut stages = layers(sky, "cloud", &query);
            let from_above = whole.view.from_above == 1;
            if from_above {
                stages.reverse();
            }
            let maps: Vec<Maps> = stages.iter().map(Maps::new).collect();
            let behind = &maps.last().unwrap().light[usize::from(!from_above)];
            let view = View { together: 1, ..whole.view };
            let twin = |by_m: f64| {
                let mut texels = vec![Shaded::default(); (view.size[0] * view.rows) as usize];
                for (stages, maps) in stages.iter().zip(&maps) {
                    let sunlight =
                        reference::cloud::sunlight(&stages.frame, &stages.tables, stages.slab.as_ref().unwrap());
                    let (thickness, read) = (lifted(&maps.thickness, by_m), maps.read(from_above, behind));
                    texels = reference::cloud_plane::behind(&stages.frame, &view, &thickness, &read, sunlight, &texels);
                }
                texels.iter().flat_map(|texel| texel.texel().to_array()).collect::<Vec<f64>>()
            };
            let cloud = twin(0.0);
            // The place of a texel is misread by a few roundings, and with it the height of every layer.
            let misread_m = maps.iter().map(|maps| 4.0 * place_error(&maps.thickness, 4.0)).fold(0.0, f64::max);
            let (places, shares) =
                maps.iter().map(Maps::places).fold((0.0, 0.0), |(a, b), (c, d)| (a + c, f64::max(b, d)));
            let light: f64 = maps.iter().flat_map(|maps| maps.light.iter().map(largest)).sum();
            let relative = shares + stages.iter().map(of_method).sum::<f64>() + BEAM_REL;
            let mut bounds =
                allowed(&cloud, &twin(misread_m), Tolerance::new(CANCEL * light.max(1.0) + places, relative));
            bounds
                .iter_mut()
                .zip(cloud.iter().zip(twin(-misread_m)))
                .for_each(|(bound, (a, b))| *bound += (a - b).abs());
            check_each(&format!("sky {number}, {query:?}"), &whole.output, &cloud, &bounds);
        }
    }
}

/// What goes on from layer to layer, and the beam on the ground below them.
#[test]
fn sunlight_from_layer_to_layer() {
    for sky in skies() {
        for stages in layers(&sky, "cloud", &[]) {
            let read = Maps::new(&stages);
            let [above, above_beam, entry, entering] =
                [&stages.above, &stages.above_beam, &stages.entry, &stages.entering].map(map);
            let [transmittance, reflectance] = &read.tables;
            let twin = |by_m: f64| {
                let thickness = lifted(&read.thickness, by_m);
                let maps = reference::base_light::Maps {
                    thickness: &thickness,
                    transmittance,
                    reflectance,
                    entry: &entry,
                    blurred: &entering,
                    above: &above,
                };
                let beam = reference::base_beam::main(&stages.frame, &thickness, transmittance, &above_beam);
                (reference::base_light::main(&stages.frame, &maps), beam)
            };
            let misread_m = 4.0 * place_error(&read.thickness, 4.0);
            let ((light, beam), (other, other_beam)) = (twin(0.0), twin(misread_m));
            let scale = 1.0 + largest(&entry);
            let places = (place_error(&above, 1.0) + place_error(&above_beam, 1.0)) * scale;
            let tolerance = Tolerance::new(TABLE_REL * scale + places, TABLE_REL);
            let mut found = vec![
                ("beam", &stages.beam, &light.beam, &other.beam),
                ("tilted", &stages.tilted, &light.tilted, &other.tilted),
                ("entered", &stages.entered, &light.entered, &other.entered),
                ("reflected", &stages.reflected, &light.reflected, &other.reflected),
            ];
            if let Some(gpu) = &stages.ground_beam {
                found.push(("ground beam", gpu, &beam, &other_beam));
            }
            for (name, gpu, twin, other) in found {
                let (twin, other) = (values(twin, gpu), values(other, gpu));
                check_each(
                    &format!("{name}, lowest {}", stages.frame.place.lowest),
                    &gpu.data,
                    &twin,
                    &allowed(&twin, &other, tolerance),
                );
            }
        }
    }
}

/// A sky of several layers, texel by texel: what rounding does to rays is the subject of `tests/sky_twins.rs`; here a few texels
/// whose ray meets cloud elsewhere are left out of the comparison.
#[test]
fn skies_of_layers_that_are_drawn_together() {
    for sky in skies() {
        let query = [("projection", "fisheye"), ("fov", "120"), ("size", "24"), ("method", "tabulated")];
        let whole = sky.stages("sky", &query);
        let clouds = &whole.sky.as_ref().unwrap().clouds;
        let each = layers(&sky, "sky", &query);
        let maps_of: Vec<Maps> = each.iter().map(Maps::new).collect();
        let behind = &maps_of.last().unwrap().light[1];
        let levels: Vec<Vec<Map>> = whole.sky.as_ref().unwrap().levels.iter().map(|levels| maps(levels)).collect();
        let rising: Vec<_> = clouds.passes.iter().zip(&clouds.air).filter(|(view, _)| view.rising == 1).collect();
        assert_eq!(rising.len(), each.len());
        let mut texels = vec![Shaded::default(); clouds.texels.len() / 4];
        for (i, (view, air)) in rising.into_iter().enumerate() {
            assert_eq!(view.together, 1);
            let (stages, read) = (&each[i], maps_of[i].read(false, behind));
            let sunlight = reference::cloud::sunlight(&stages.frame, &stages.tables, stages.slab.as_ref().unwrap());
            let given = (&levels[i][..], &twin::air(air));
            texels = reference::cloud_sky::main(&stages.frame, view, given, &read, sunlight, &texels, DVec2::ZERO);
        }
        let twin: Vec<f64> = texels.iter().flat_map(|texel| texel.texel().to_array()).collect();
        let bright = twin.iter().copied().fold(0.0, f64::max);
        let far = twin
            .iter()
            .zip(&clouds.texels)
            .filter(|(a, b)| (**a - f64::from(**b)).abs() > 2e-3 * (a.abs() + 0.01 * bright));
        let count = far.count();
        assert!(count <= twin.len() / 100, "{count} of {}", twin.len());
    }
}
