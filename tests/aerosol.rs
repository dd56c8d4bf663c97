//! Scenes whose aerosol has a phase function of its own, through the renderer.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

mod common;

use common::sky::{Sky, hg_layer};
use serde_json::{Value, json};
use skyloom::atmosphere::{View, march};
use skyloom::axes::Axes;
use skyloom::projection::{Sphere, SphereLayout};
use skyloom::spectrum::rec709;

/// Coarse requests take fast tables.
const FAST: (&str, &str) = ("tolerance", "0.05");

fn clear(zenith_deg: f64, aerosol: Value) -> Value {
    json!({
        "domain": { "extent_m": 20000, "resolution": 8 },
        "sun": { "zenith_deg": zenith_deg, "azimuth_deg": 150 },
        "atmosphere": { "aerosol": aerosol }, "ground": { "albedo": 0.2 },
    })
}

fn henyey_greenstein(g: f64) -> Value {
    let value = |degrees: f64| (1.0 - g * g) / (1.0 + g * g - 2.0 * g * degrees.to_radians().cos()).powf(1.5);
    let angle = |i: u32| 180.0 * (f64::from(i) / 600.0).powi(2);
    (0..=600).map(angle).map(|degrees| json!([degrees, value(degrees)])).collect()
}

#[test]
fn aerosol_has_the_light_of_its_own_phase_function() {
    // One device for all: opening it takes longer than each of them.
    let mut sky = Sky::open();
    table_of_henyey_and_greenstein_gives_the_same_textures(&mut sky);
    sky_of_coarse_particles_is_that_of_direct_integration(&mut sky);
    aureole_of_coarse_particles_is_diffuse_light(&mut sky);
}

/// A picture of the sky towards the sun, each texel against direct integration.
fn sky_of_coarse_particles_is_that_of_direct_integration(sky: &mut Sky) {
    let scene =
        clear(55.0, json!({ "optical_depth": 0.3, "effective_radius_um": 2.5, "refractive_index": [1.5, 0.004] }));
    let query = [("size", "24"), ("projection", "camera"), ("look", "150,35"), ("fov", "40"), ("eye", "0,0,300"), FAST];
    let job = sky.job(&scene, "sky", &query);
    let output = sky.renderer.render(&job, &Default::default()).unwrap().data;
    let tables = job.air().unwrap();
    let sun = job.illumination().towards_sun;
    let layout = SphereLayout::Camera { look_deg: [150.0, 35.0], fov_deg: 40.0, aspect: 1.0 };
    let sphere = Sphere { layout, axes: Axes::Enu, eye: [0.0, 0.0, 300.0] };
    let (mut squares, mut nearest_squares, mut count, mut nearest) = (0.0, 0.0, 0, 0);
    for y in 0..24_u32 {
        for x in (y % 3..24).step_by(3) {
            let place = [f64::from(x) + 0.5, f64::from(y) + 0.5];
            let Some([east, north, up]) = sphere.direction(place, [24, 24]) else { continue };
            let view = View::new(up.asin().to_degrees(), east.atan2(north).to_degrees() - 150.0, sun[2]);
            let waves = tables.clear.waves.each_ref();
            let exact = rec709(waves.map(|wave| march(wave, 300.0, sun[2], view, 200).radiance()));
            for c in 0..3 {
                let found = f64::from(output[3 * (24 * y + x) as usize + c]);
                let square = (found / exact[c] - 1.0).powi(2);
                if view.sun > 5.0_f64.to_radians().cos() {
                    (nearest_squares, nearest) = (nearest_squares + square, nearest + 1);
                } else {
                    (squares, count) = (squares + square, count + 1);
                }
            }
        }
    }
    let [far, near] = [squares / f64::from(count), nearest_squares / f64::from(nearest)].map(f64::sqrt);
    println!("{:.3} % rms, {:.3} % within 5 degrees of the sun", 100.0 * far, 100.0 * near);
    assert!(far < 0.006 && near < 0.01 && nearest > 20, "{far} {near}");
}

/// The same aerosol by its asymmetry and by a table, in every texture.
fn table_of_henyey_and_greenstein_gives_the_same_textures(sky: &mut Sky) {
    let scenes = [json!({ "asymmetry": 0.7 }), json!({ "phase_function": henyey_greenstein(0.7) })].map(|aerosol| {
        let mut scene = clear(60.0, aerosol);
        scene["layers"] = json!([hg_layer(json!({ "kind": "uniform", "metres": 100 }), 0.01, 1.0)]);
        scene
    });
    for (texture, query) in [("sky", vec![FAST, ("size", "16")]), ("irradiance", vec![FAST]), ("cloud", vec![FAST])] {
        let [number, table] = scenes.each_ref().map(|scene| sky.render(scene, texture, &query).data);
        let worst = number.iter().zip(&table).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f32::max);
        println!("{texture}: {worst:.1e}");
        assert!(worst < 1e-3, "{texture}: {worst}");
    }
}

/// Light of the aureole is the sky's: a panorama shines on the ground as diffuse irradiance says, and the rest is the beam.
fn aureole_of_coarse_particles_is_diffuse_light(sky: &mut Sky) {
    let aerosol = json!({ "optical_depth": 0.3, "effective_radius_um": 2.5, "refractive_index": 1.5, "angstrom": 0, "albedo": 0.95 });
    let scene = clear(55.0, aerosol);
    let job = sky.job(&scene, "irradiance", &[FAST]);
    let wave = &job.air().unwrap().clear.waves[2].air;
    // Given numbers stand in place of those of Mie theory.
    let aerosol = &wave.whole_medium().aerosol;
    assert!((aerosol.depth - 0.3).abs() < 1e-12 && (aerosol.albedo - 0.95).abs() < 1e-12);
    assert!(wave.depth.transmittance(0.0, 0.57) > 1.1 * wave.whole_depth().transmittance(0.0, 0.57));
    let part = |sky: &mut Sky, component| {
        let query = [("component", component), ("peak", "false"), FAST];
        [0, 1, 2].map(|c| f64::from(sky.render(&scene, "irradiance", &query).data[c]))
    };
    let (direct, diffuse) = (part(sky, "direct"), part(sky, "diffuse"));
    let cosine = 55.0_f64.to_radians().cos();
    let beam = rec709(
        job.air()
            .unwrap()
            .clear
            .waves
            .each_ref()
            .map(|wave| cosine * wave.air.whole_depth().transmittance(0.0, cosine)),
    );
    let seen = sky.render(&scene, "sky", &[("size", "160"), ("eye", "0,0,0"), FAST]);
    let sphere = Sphere { layout: SphereLayout::Equirect, axes: Axes::Enu, eye: [0.0; 3] };
    let mut shone = [0.0; 3];
    for (i, texel) in seen.data.chunks(3).enumerate() {
        let (x, y) = ((i % 320) as f64 + 0.5, (i / 320) as f64 + 0.5);
        let edge = |y: f64| (std::f64::consts::PI * (0.5 - y / 160.0)).sin();
        let solid = std::f64::consts::TAU / 320.0 * (edge(y - 0.5) - edge(y + 0.5));
        let up = sphere.direction([x, y], [320, 160]).unwrap()[2].max(0.0);
        (0..3).for_each(|c| shone[c] += solid * up * f64::from(texel[c]));
    }
    println!("direct {direct:.2?}, beam {beam:.2?}, diffuse {diffuse:.2?}, panorama {shone:.2?}");
    for c in 0..3 {
        assert!((direct[c] / beam[c] - 1.0).abs() < 1e-3, "{direct:?} {beam:?}");
        assert!((diffuse[c] / shone[c] - 1.0).abs() < 0.015, "{diffuse:?} {shone:?}");
    }
}
