//! Claims about the passes of the texture sky: each computes what its twin in `reference` computes, for every projection,
//! place of the eye and method. See `tests/twins.rs` for how the two are compared.
//!
//! What rounding of a ray's direction, of the place on a map and of the cloud's height do to a texel is asked from the twin
//! itself, on rays, maps and views that are changed by just that: so texels whose number of rays or samples changes there are
//! allowed to be either.

#![expect(clippy::unwrap_used, reason = "a test stops where it fails")]
#![expect(clippy::panic, reason = "a test fails by panicking")]

#[path = "common/compare.rs"]
mod compare;
#[path = "common/twin_sky.rs"]
mod sky;
#[path = "common/twin.rs"]
mod twin;

use compare::Tolerance;
use glam::{DVec2, DVec3, dvec2};
use serde_json::json;
use sky::{Sky, WAVES_SIZES, pattern, water, waves_of};
use skyloom::axes::Axes;
use skyloom::cumulus::dressed;
use skyloom::gpu::layout::{Backdrop, Frame, SkyView};
use skyloom::projection::{Sphere, SphereLayout};
use skyloom::reference::cloud::{Reaches, Shaded, ViewRay};
use skyloom::reference::cloud_lattice::{self, LatticeSeen};
use skyloom::reference::{self, Map, sphere};
use skyloom::render::{SkyStages, Stages, Watch};
use skyloom::slice::HostSlab;
use std::f64::consts::PI;
use twin::{
    CANCEL, DIRECTION, ROUND, SLICE_REL, TABLE_REL, check, check_each, check_map, largest, lifted, map, maps,
    place_error, unfiltered, values,
};

/// Error of a direction, radians: a place in the picture is rounded twice and multiplied by up to 2 pi (4e-7), its sine is a
/// polynomial (1e-7) of few roundings (2e-7), its vector is made a unit.
const ANGLE: f64 = 1e-6;
/// Logarithm of the device, absolute, of up to 16; products behind a count: relative.
const COUNT: f32 = 1e-5;
const PROJECTIONS: [&[(&str, &str)]; 6] = [
    &[("projection", "equirect"), ("size", "24")],
    &[("projection", "octahedral"), ("size", "40")],
    &[("projection", "cube"), ("size", "17")],
    &[("projection", "fisheye"), ("fov", "180"), ("size", "40")],
    &[("projection", "fisheye"), ("fov", "360"), ("size", "40")],
    &[("projection", "camera"), ("look", "200,-3"), ("fov", "50"), ("aspect", "1.5"), ("size", "24")],
];
/// Near the ground, below the layer, in it, above it, and high.
const EYES: [&str; 5] = ["0,0,2", "300,-2000,700", "-900,40,1100", "3000,5000,2500", "100,-7000,20000"];

/// What the twins are given: changed, to ask what that does.
#[derive(Clone)]
struct Given {
    frame: Frame,
    levels: Vec<Map>,
    backdrop: Backdrop,
    turned: fn(SkyView) -> SkyView,
    shift: DVec2,
}

impl Given {
    fn of(stages: &Stages, sky: &SkyStages) -> Self {
        Self {
            frame: stages.frame,
            levels: maps(&sky.levels[0]),
            backdrop: sky.backdrop,
            turned: |view| view,
            shift: DVec2::ZERO,
        }
    }

    /// Every change that rounding can be.
    fn others(&self, view: &SkyView) -> Vec<Self> {
        let texel = f64::from(view.size[1]).max(f64::from(view.size[0])) * ANGLE;
        // Far places ask for more: those are the same as another direction.
        let misread_m = place_error(&self.levels[0], 1.0) + 4.0 * ROUND * f64::from(self.frame.place.depth_m);
        // The rays of a texel err each on its own, and a shift moves them alike: several shifts find what one cancels.
        let shifts = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1)];
        let shifted = shifts.map(|(x, y)| Self { shift: dvec2(x.into(), y.into()) * texel, ..self.clone() });
        let lifts = [misread_m, -misread_m]
            .map(|by_m| Self { levels: self.levels.iter().map(|map| lifted(map, by_m)).collect(), ..self.clone() });
        let turns: [fn(SkyView) -> SkyView; 6] = [
            |view| SkyView { coarseness: view.coarseness + COUNT, ..view },
            |view| SkyView { coarseness: view.coarseness - COUNT, ..view },
            |view| SkyView { steps: view.steps * (1.0 + COUNT), ..view },
            |view| SkyView { steps: view.steps * (1.0 - COUNT), ..view },
            |view| SkyView { texels_per_ray: view.texels_per_ray * (1.0 + COUNT), ..view },
            |view| SkyView { texels_per_ray: view.texels_per_ray * (1.0 - COUNT), ..view },
        ];
        let turned = turns.map(|turned| Self { turned, ..self.clone() });
        let mut sun = self.clone();
        sun.frame.sun.towards[0] += DIRECTION;
        let wider = [1.0 + COUNT, 1.0 - COUNT].map(|by| {
            let extent_m = self.backdrop.extent_m * by;
            Self { backdrop: Backdrop { extent_m, ..self.backdrop }, ..self.clone() }
        });
        shifted.into_iter().chain(lifts).chain(turned).chain(wider).chain([sun]).collect()
    }
}

/// What changes do to a twin's values, in sum.
fn sensitivity(twin: &[f64], others: impl Iterator<Item = Vec<f64>>) -> Vec<f64> {
    let mut sum = vec![0.0; twin.len()];
    for other in others {
        sum.iter_mut().zip(twin.iter().zip(&other)).for_each(|(sum, (a, b))| *sum += (a - b).abs());
    }
    sum
}

fn check_levels(sky: &SkyStages, fine: &Map) {
    for (number, level) in sky.levels[0].iter().enumerate() {
        let size = [level.width as usize, level.height as usize];
        let twin = match number {
            0 => fine.clone(),
            _ => reference::field_level::main(&map(&sky.levels[0][number - 1]), size),
        };
        // Sixteen weights, of which each is a product of two differences of places, and their sums.
        check_map(
            "field_level",
            level,
            &twin,
            Tolerance::new(1e-36, 32.0 * ROUND * fine.width.max(fine.height) as f64),
        );
        let mean = |map: &Map| map.texels.iter().map(|texel| texel[0]).sum::<f64>() / map.texels.len() as f64;
        let (kept, all) = (mean(&map(level)), mean(fine));
        assert!((kept - all).abs() < 1e-4 * all + 1e-9, "cloud is lost: {kept} of {all} m at level {number}");
    }
}

fn check_ground(sky: &SkyStages) {
    let twin = reference::sky_ground::main(&sky.ground_view, &map(&sky.albedo), &sky.irradiance);
    let device: Vec<f32> = sky.ground[0].data.chunks(4).flat_map(|texel| &texel[..3]).copied().collect();
    let twin: Vec<f64> = twin.texels.iter().flat_map(|texel| &texel[..3]).copied().collect();
    let places = place_error(&map(&sky.albedo), 1.0);
    let brightest = sky.irradiance.iter().copied().fold(0.0_f32, f32::max);
    // Where all texels are the same, so is their rounding: one counts.
    let count = if device.chunks(3).all(|texel| texel == &device[..3]) { 3 } else { device.len() };
    check("sky_ground", &device[..count], &twin[..count], Tolerance::new(places * f64::from(brightest), 8.0 * ROUND));
    for pair in sky.ground.windows(2) {
        let twin = reference::downsample::main(&map(&pair[0]));
        check("ground, level", &pair[1].data, &values(&twin, &pair[1]), Tolerance::new(0.0, 3.0 * ROUND));
    }
}

/// `dressed`: tables of light scattered once, for skies by the lattice.
fn check_clouds(stages: &Stages, sky: &SkyStages, given: &Given, dressed: &[Vec<f64>; 3]) {
    let tables = &stages.tables;
    let slab = stages.slab.as_ref().unwrap();
    let [transmittance, reflectance] = [&tables.transmittance, &tables.reflectance].map(map);
    let side = stages.light.from_below.len().isqrt();
    let light_map = |light: &[[f32; 3]]| Map::from_f32(side, side, 3, light.as_flattened());
    let (from_below, from_above) = (light_map(&stages.light.from_below), light_map(&stages.light.from_above));
    let shares = stages.shares.each_ref().map(map);
    let lattice = stages.lattice.as_ref().map(|maps| LatticeSeen::new(maps, dressed.each_ref().map(Vec::as_slice)));
    let twin = |given: &Given| {
        let of_lattice = lattice.map(|seen| {
            move |ray: &ViewRay, share: DVec3| cloud_lattice::reaches(&given.frame, &seen, &given.levels, ray, share)
        });
        let mut clouds = vec![Shaded::default(); sky.clouds.texels.len() / 4];
        for (view, air) in sky.clouds.passes.iter().zip(&sky.clouds.air) {
            let air = twin::air(air);
            let maps = reference::cloud::Maps {
                transmittance: &transmittance,
                reflectance: &reflectance,
                from_below: &from_below,
                from_above: &from_above,
                sun_share: &shares[usize::from(view.rising == 0)],
                behind: &from_above,
                reaches: of_lattice.as_ref().map(|reaches| reaches as Reaches<'_>),
            };
            let sunlight = reference::cloud::sunlight(&given.frame, tables, slab);
            let view = (given.turned)(*view);
            clouds = reference::cloud_sky::main(
                &given.frame,
                &view,
                (&given.levels, &air),
                &maps,
                sunlight,
                &clouds,
                given.shift,
            );
        }
        clouds.iter().flat_map(|texel| texel.texel().to_array()).collect::<Vec<f64>>()
    };
    let clouds = twin(given);
    let rounding = sensitivity(&clouds, given.others(&sky.view).iter().map(twin));
    let light = largest(&from_above) + largest(&from_below);
    let places = place_error(&from_below, 1.0) + place_error(&from_above, 1.0);
    // As a part of the light of the sun there.
    let share = shares.iter().map(|share| place_error(share, 1.0)).fold(0.0, f64::max);
    let of_method = match slab {
        HostSlab::Forward(_) | HostSlab::Analytic(_) => TABLE_REL,
        HostSlab::Tabulated(_) => SLICE_REL,
    };
    let bright = clouds.chunks(4).flat_map(|texel| &texel[..3]).copied().fold(0.0, f64::max);
    let steady = CANCEL * light.max(1.0) + places + share * bright;
    let bounds: Vec<f64> =
        clouds.iter().zip(&rounding).map(|(value, rounding)| steady + of_method * value.abs() + rounding).collect();
    check_each("cloud_sky", &sky.clouds.texels, &clouds, &bounds);
}

fn check_sky(stages: &Stages, sky: &SkyStages, given: &Given) {
    let (ground, air) = (maps(&sky.ground), sky.air.each_ref().map(twin::air));
    let clouds: Vec<f64> = sky.clouds.texels.iter().copied().map(f64::from).collect();
    let twin = |given: &Given| {
        let view = (given.turned)(sky.view);
        let behind = reference::sky::Behind { ground: &ground, air: &air };
        reference::sky::main(&given.backdrop, &view, &behind, &clouds, given.shift)
    };
    let texels = twin(given);
    let rounding = sensitivity(&texels, given.others(&sky.view).iter().map(twin));
    let steady = place_error(&ground[0], 1.0);
    let bounds: Vec<f64> =
        texels.iter().zip(&rounding).map(|(value, rounding)| steady + 16.0 * ROUND * value.abs() + rounding).collect();
    check_each("sky", &stages.output, &texels, &bounds);
}

fn check_all(stages: &Stages) {
    check_all_with(stages, &Default::default());
}

fn check_all_with(stages: &Stages, dressed: &[Vec<f64>; 3]) {
    let sky = stages.sky.as_ref().unwrap();
    let given = Given::of(stages, sky);
    check_levels(sky, &map(&stages.thickness));
    check_ground(sky);
    check_clouds(stages, sky, &given, dressed);
    check_sky(stages, sky, &given);
}

fn query<'a>(projection: &[(&'a str, &'a str)], eye: &'a str, method: &'a str) -> Vec<(&'a str, &'a str)> {
    [projection, &[("eye", eye), ("method", method), ("time", "300")]].concat()
}

#[test]
fn skies_of_every_projection_and_eye() {
    for (number, projection) in PROJECTIONS.into_iter().enumerate() {
        for (eye_number, eye) in EYES.into_iter().enumerate() {
            let method = ["analytic", "tabulated"][(number + eye_number) % 2];
            eprintln!("{projection:?}, eye at {eye}, {method}");
            check_all(&Sky::at(50.0).stages("sky", &query(projection, eye, method)));
        }
    }
}

#[test]
fn skies_of_every_sun_and_method() {
    for zenith_deg in [0.0, 85.0, 89.9, 95.0] {
        for method in ["analytic", "tabulated"] {
            for (projection, eye) in [(PROJECTIONS[1], EYES[0]), (PROJECTIONS[0], EYES[3])] {
                eprintln!("sun at {zenith_deg}, {method}, eye at {eye}");
                check_all(&Sky::hazy(zenith_deg).stages("sky", &query(projection, eye, method)));
            }
        }
    }
    let rainy = Sky { droplets: water(), thickness: pattern("closed", 0.8), ..Sky::at(35.0) };
    for eye in EYES {
        check_all(&rainy.stages("sky", &query(PROJECTIONS[0], eye, "tabulated")));
    }
}

/// Of near clouds and those from above the light of cubes, of far ones from below their means over them.
#[test]
fn skies_by_the_lattice() {
    let lattice = [("transport", "lattice")];
    let mut thickness = pattern("open", 0.6);
    thickness["law"] = json!("gamma");
    for (number, eye) in EYES.into_iter().enumerate() {
        eprintln!("eye at {eye}");
        let query = [query(PROJECTIONS[number % PROJECTIONS.len()], eye, "tabulated"), lattice.to_vec()].concat();
        for sky in [Sky::at(50.0), Sky { thickness: thickness.clone(), droplets: water(), ..Sky::at(70.0) }] {
            let (stages, job) = (sky.stages("sky", &query), sky.job("sky", &query));
            let extinction = stages.frame.medium.extinction.map(f64::from);
            check_all_with(&stages, &dressed::tables(&job.tables()[0].channels, extinction));
        }
    }
}

/// The air's own light, with an aureole: between its nodes the device's filter rounds, in steps of the phase function of up to
/// a fifth.
#[test]
fn skies_in_air_of_coarse_particles() {
    let aerosol = json!({"optical_depth": 0.2, "effective_radius_um": 1.5, "refractive_index": [1.5, 0.01]});
    let hazy = Sky { atmosphere: json!({ "aerosol": aerosol }), ..Sky::hazy(60.0) };
    for projection in [PROJECTIONS[0], &[("projection", "camera"), ("look", "150,30"), ("fov", "30"), ("size", "24")]] {
        let query = [projection, &[("eye", EYES[0]), ("tolerance", "0.1")]].concat();
        let stages = hazy.stages("sky", &query);
        let sky = stages.sky.as_ref().unwrap();
        let (ground, air) = (maps(&sky.ground), sky.air.each_ref().map(twin::air));
        let clouds: Vec<f64> = sky.clouds.texels.iter().copied().map(f64::from).collect();
        let behind = reference::sky::Behind { ground: &ground, air: &air };
        let twin = reference::sky::main(&sky.backdrop, &sky.view, &behind, &clouds, DVec2::ZERO);
        let bounds: Vec<f64> = twin.iter().map(|value| 2e-3 * value.abs()).collect();
        check_each("sky in air", &stages.output, &twin, &bounds);
        // The aureole is there: its factor is that of each wavelength.
        let aureole = air[0].map.texel(0, air[0].map.height / 3 + 5);
        assert!(aureole.iter().all(|factor| *factor > 0.0) && aureole[0] != aureole[3], "{aureole:?}");
    }
}

#[test]
fn skies_in_the_axes_of_engines() {
    for (number, axes) in [
        [("projection", "equirect"), ("axes", "unity"), ("size", "24")],
        [("projection", "equirect"), ("axes", "three"), ("size", "24")],
        [("projection", "cube"), ("axes", "godot"), ("size", "17")],
        [("projection", "cube"), ("axes", "unreal"), ("size", "17")],
        [("projection", "cube"), ("axes", "three"), ("size", "17")],
    ]
    .iter()
    .enumerate()
    {
        check_all(&Sky::at(50.0).stages("sky", &query(axes, EYES[number % 2], "analytic")));
    }
}

#[test]
fn skies_looked_at_more_finely() {
    for tolerance in ["0.5", "0.02", "0.001"] {
        for eye in [EYES[0], EYES[4]] {
            eprintln!("tolerance {tolerance}, eye at {eye}");
            let query = [query(PROJECTIONS[0], eye, "analytic"), vec![("tolerance", tolerance)]].concat();
            check_all(&Sky::at(50.0).stages("sky", &query));
        }
    }
}

#[test]
fn skies_of_images_of_any_size() {
    for (number, size) in WAVES_SIZES.iter().enumerate() {
        eprintln!("{size:?}");
        let sky = Sky { thickness: waves_of(number), ..Sky::hazy(50.0) };
        check_all(&sky.stages("sky", &query(PROJECTIONS[0], EYES[0], "analytic")));
    }
    let even = Sky { thickness: json!({"kind": "uniform", "metres": 200}), ..Sky::at(60.0) };
    for eye in EYES {
        check_all(&even.stages("sky", &query(PROJECTIONS[1], eye, "tabulated")));
    }
}

/// Columns that stand or hang.
#[test]
fn skies_of_columns() {
    let mut thickness = pattern("open", 0.6);
    thickness["law"] = json!("gamma");
    for (top_m, profile) in [(None, "uniform"), (None, "adiabatic"), (Some(2400.0), "uniform")] {
        for (number, eye) in EYES.into_iter().enumerate() {
            eprintln!("top {top_m:?}, {profile}, eye at {eye}");
            let sky = Sky { thickness: thickness.clone(), top_m, profile, ..Sky::at(50.0) };
            check_all(&sky.stages("sky", &query(PROJECTIONS[number % PROJECTIONS.len()], eye, "tabulated")));
        }
    }
}

#[test]
fn unfiltered_skies() {
    for eye in EYES {
        let query = query(PROJECTIONS[0], eye, "analytic");
        check_all(&unfiltered().inspect(&Sky::at(50.0).job("sky", &query), &Watch::default()).unwrap());
    }
}

const LAYOUTS: [SphereLayout; 6] = [
    SphereLayout::Equirect,
    SphereLayout::Octahedral,
    SphereLayout::Cube,
    SphereLayout::Fisheye { fov_deg: 180.0 },
    SphereLayout::Fisheye { fov_deg: 360.0 },
    SphereLayout::Camera { look_deg: [210.0, 30.0], fov_deg: 80.0, aspect: 1.5 },
];

/// The view that the device gets of a layout.
fn view(layout: SphereLayout, axes: Axes) -> SkyView {
    let number = layout.number();
    let text = |value: f64| value.to_string();
    let query = match layout {
        SphereLayout::Fisheye { fov_deg } => vec![("fov", text(fov_deg))],
        SphereLayout::Camera { look_deg: [azimuth, elevation], fov_deg, aspect } => {
            vec![("look", format!("{azimuth},{elevation}")), ("fov", text(fov_deg)), ("aspect", text(aspect))]
        }
        _ => Vec::new(),
    };
    let mut query: Vec<_> = query.iter().map(|(name, value)| (*name, value.as_str())).collect();
    query.push(("axes", axes.name()));
    query.extend([("projection", SphereLayout::NAMES[number]), ("size", "60"), ("method", "analytic")]);
    Sky::at(50.0).stages("sky", &query).sky.unwrap().view
}

#[test]
fn directions_are_those_of_the_host() {
    for (layout, axes) in LAYOUTS.into_iter().flat_map(|layout| Axes::ALL.map(|axes| (layout, axes))) {
        let (view, sphere) = (view(layout, axes), Sphere { layout, axes, eye: [0.0; 3] });
        let mut most = 0.0_f64;
        for y in 0..view.size[1] {
            for x in 0..view.size[0] {
                let place = dvec2(f64::from(x) + 0.3, f64::from(y) + 0.6);
                let host = sphere.direction(place.to_array(), view.size);
                let twin = sphere::sphere_direction(&view, place).map(|direction| direction.to_array());
                assert_eq!(host.is_some(), twin.is_some(), "{layout:?} at {place}");
                let Some((host, twin)) = host.zip(twin) else { continue };
                most = host.iter().zip(twin).map(|(a, b)| (a - b).abs()).fold(most, f64::max);
            }
        }
        eprintln!("{layout:?}, {axes:?}: {most:.1e}");
        // Axes and sides of a camera are single precision.
        assert!(most < 4.0 * ROUND, "{layout:?}, {axes:?}: {most:.1e}");
    }
}

/// A texel's cone is near what the texel covers: its side as a mean over all of them, within a per cent but for the fisheye's, its rise at
/// each to a factor.
#[test]
fn cones_are_as_wide_as_texels() {
    for (layout, covered, part, [least, most]) in [
        (LAYOUTS[0], 4.0 * PI, 0.01, [0.98, 1.02]),
        // Rows and columns of these slant against the horizon: up to the diagonal, down to half of it.
        (LAYOUTS[1], 4.0 * PI, 0.01, [0.4, 2.0]),
        (LAYOUTS[2], 4.0 * PI, 0.01, [0.6, 1.5]),
        // The fisheye's texels are wider than their height near the edge: 7.75 for 6.28.
        (LAYOUTS[3], 2.0 * PI, 0.25, [0.6, 1.2]),
        (LAYOUTS[5], 0.0, 0.0, [0.4, 2.0]),
    ] {
        let view = view(layout, Axes::Enu);
        let (mut sum, mut reach) = (0.0, [f64::INFINITY, 0.0_f64]);
        for y in 0..view.size[1] {
            for x in 0..view.size[0] {
                let at =
                    |dx: f64, dy: f64| sphere::sphere_direction(&view, dvec2(f64::from(x) + dx, f64::from(y) + dy));
                let Some(middle) = at(0.5, 0.5) else { continue };
                let cone = sphere::sphere_cone(&view, middle);
                sum += cone.side * cone.side;
                let [Some(a), Some(b), Some(c), Some(d)] = [at(0.05, 0.5), at(0.95, 0.5), at(0.5, 0.05), at(0.5, 0.95)]
                else {
                    continue;
                };
                // How far the elevation changes over the texel, along the steepest way: near the horizon.
                if middle.z.abs() < 0.5 {
                    let elevation = |z: f64| z.asin();
                    let rise = (elevation(a.z) - elevation(b.z)).hypot(elevation(c.z) - elevation(d.z)) / 0.9;
                    reach = [reach[0].min(rise / cone.rise), reach[1].max(rise / cone.rise)];
                }
            }
        }
        eprintln!("{layout:?}: {sum:.3} sr; rises of {:.2} to {:.2} of the cone's", reach[0], reach[1]);
        assert!(covered == 0.0 || (sum / covered - 1.0).abs() < part, "{layout:?}: {sum} for {covered}");
        assert!(reach[0] > least && reach[1] < most, "{layout:?}: {reach:?}");
    }
}

/// Distances, heights and ways of the device are told by directions alone; those of the twin obey geometry.
#[test]
fn rays_over_the_sphere_obey_geometry() {
    for h_m in [0.0, 2.0, 1500.0, 20_000.0, 100_000.0] {
        for up in [-1.0, -0.3, -0.02, -1e-3, 0.0, 1e-4, 0.05, 0.7, 1.0] {
            let direction = glam::dvec3((1.0_f64 - up * up).sqrt(), 0.0, up);
            let lowest = sphere::lowest_m(h_m, up);
            for to_m in [0.0, 900.0, 1500.0, 12_000.0, 100_000.0] {
                if to_m < lowest || (up >= 0.0 && to_m < h_m) {
                    continue;
                }
                let mut ways = vec![sphere::rising_distance(h_m, up, to_m)];
                if up < 0.0 && to_m <= h_m {
                    ways.push(sphere::sinking_distance(h_m, up, to_m));
                }
                for way in ways {
                    let place = direction * way + glam::dvec3(0.0, 0.0, sphere::EARTH_RADIUS_M + h_m);
                    let height = place.length() - sphere::EARTH_RADIUS_M;
                    assert!((height - to_m).abs() < 1e-3, "{h_m}, {up}: {height} not {to_m}");
                    let over = sphere::ground_way(h_m, direction, way);
                    let angle = place.x.atan2(place.z) * sphere::EARTH_RADIUS_M;
                    assert!((over - angle).abs() < 1e-3, "{h_m}, {up}: way of {over}, not {angle}");
                    let cosine = direction.dot(place.normalize());
                    assert!((sphere::cosine_at(h_m, up, way, to_m) - cosine).abs() < 1e-8);
                }
            }
        }
    }
}
