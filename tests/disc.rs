//! Claims about the sun's disc in a sky: its light is the beam's in every projection and size, it is darker towards its limb as
//! the sun is, it stands where the sun appears, and clouds and ground hide it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::{Sky, hg_layer};
use serde_json::{Value, json};
use skyloom::axes::Axes;
use skyloom::projection::{Sphere, SphereLayout};
use skyloom::render::Texture;
use skyloom::sun::{Place, SunPosition};
use std::f64::consts::{PI, TAU};

const BEAM: [f64; 3] = [30.0, 20.0, 10.0];

/// A sun of the caller's own light.
fn given(zenith_deg: f64, azimuth_deg: f64, diameter_deg: f64) -> Value {
    json!({
        "domain": { "resolution": 16 },
        "sun": { "zenith_deg": zenith_deg, "azimuth_deg": azimuth_deg, "angular_diameter_deg": diameter_deg },
        "atmosphere": { "sun": BEAM, "sky": [0.1, 0.2, 0.3] },
    })
}

fn in_air(sun: Value) -> Value {
    json!({ "domain": { "resolution": 16 }, "sun": sun, "atmosphere": "clear" })
}

/// What the disc adds to each texel.
fn added(sky: &mut Sky, scene: &Value, query: &[(&str, &str)]) -> (Texture, Vec<[f64; 3]>) {
    let without = sky.render(scene, "sky", query);
    let with = sky.render(scene, "sky", &[query, &[("disc", "true")]].concat());
    let pairs = with.data.chunks(3).zip(without.data.chunks(3));
    let added = pairs.map(|(a, b)| std::array::from_fn(|c| f64::from(a[c]) - f64::from(b[c]))).collect();
    (with, added)
}

/// Solid angle of a texel by the projection's own measure, from the middle of many parts.
fn solid_angle(layout: SphereLayout, [x, y]: [f64; 2], [across, down]: [f64; 2]) -> f64 {
    const PARTS: u32 = 64;
    let measure = |right: f64, top: f64| match layout {
        // Azimuth and elevation.
        SphereLayout::Equirect => PI * 0.5 * PI * (0.5 * PI * top).cos(),
        // A plane one from the eye; the measure of a face is told in its own coordinates.
        SphereLayout::Cube => (1.0 + right * right + top * top).powf(-1.5),
        // Faces of an octahedron.
        SphereLayout::Octahedral => {
            let up = 1.0 - right.abs() - top.abs();
            let [a, b] = if up >= 0.0 { [right, top] } else { [1.0 - top.abs(), 1.0 - right.abs()] };
            (a * a + b * b + up * up).powf(-1.5)
        }
        SphereLayout::Fisheye { fov_deg } => {
            let (half, out) = (0.5 * fov_deg.to_radians(), right.hypot(top));
            if out > 1.0 { 0.0 } else { half * (half * out).sin() / out.max(1e-9) }
        }
        SphereLayout::Camera { fov_deg, aspect, .. } => {
            let half = (0.5 * fov_deg.to_radians()).tan();
            let [a, b] = [half * aspect * right, half * top];
            half * half * aspect * (1.0 + a * a + b * b).powf(-1.5)
        }
    };
    let faces = if layout == SphereLayout::Cube { 6.0 } else { 1.0 };
    let part = |i: u32| {
        let inside = |step: u32| (f64::from(step) + 0.5) / f64::from(PARTS);
        let place = [(x + inside(i % PARTS)) / across, faces * (y + inside(i / PARTS)) / down % 1.0];
        measure(2.0 * place[0] - 1.0, 1.0 - 2.0 * place[1])
    };
    (0..PARTS * PARTS).map(part).sum::<f64>() / f64::from(PARTS * PARTS) * 4.0 * faces / (across * down)
}

/// Irradiance of what the disc adds, on a plane that faces it.
fn irradiance(picture: &Texture, added: &[[f64; 3]], layout: SphereLayout) -> [f64; 3] {
    let size = [picture.width, picture.height].map(f64::from);
    let mut sum = [0.0; 3];
    for (i, light) in added.iter().enumerate().filter(|(_, light)| **light != [0.0; 3]) {
        let place = [i as u32 % picture.width, i as u32 / picture.width].map(f64::from);
        let angle = solid_angle(layout, place, size);
        (0..3).for_each(|c| sum[c] += light[c] * angle);
    }
    sum
}

fn assert_near(found: [f64; 3], expected: [f64; 3], part: f64, what: &str) {
    for (found, expected) in found.into_iter().zip(expected) {
        assert!((found - expected).abs() <= part * expected, "{what}: {found} not {expected}");
    }
}

/// Layouts with their queries; all of them show the sun at azimuth 150.
fn layouts() -> [(SphereLayout, &'static [(&'static str, &'static str)]); 6] {
    [
        (SphereLayout::Equirect, &[("projection", "equirect")]),
        (SphereLayout::Cube, &[("projection", "cube")]),
        (SphereLayout::Octahedral, &[("projection", "octahedral")]),
        (SphereLayout::Fisheye { fov_deg: 180.0 }, &[("projection", "fisheye")]),
        (SphereLayout::Fisheye { fov_deg: 360.0 }, &[("projection", "fisheye"), ("fov", "360")]),
        (
            SphereLayout::Camera { look_deg: [150.0, 40.0], fov_deg: 120.0, aspect: 1.0 },
            &[("projection", "camera"), ("look", "150,40"), ("fov", "120")],
        ),
    ]
}

#[test]
fn its_light_is_the_beam_however_few_texels_it_covers() {
    let mut sky = Sky::open();
    let mut worst = 0.0_f64;
    for (layout, query) in layouts() {
        for size in ["1", "2", "7", "33", "200"] {
            for (zenith, diameter) in [(50.0, 0.533), (33.0, 0.0), (0.0, 0.533), (52.3, 5.0)] {
                let scene = given(zenith, 150.0, diameter);
                let (picture, added) = added(&mut sky, &scene, &[query, &[("size", size)]].concat());
                let found = irradiance(&picture, &added, layout);
                worst = found.iter().zip(BEAM).map(|(a, b)| (a / b - 1.0).abs()).fold(worst, f64::max);
                let what = format!("{layout:?} of {size}, sun at {zenith}, {diameter} degrees");
                assert_near(found, BEAM, 0.01, &what);
            }
        }
    }
    eprintln!("largest difference {worst:.1e}");
}

/// On the edge of a face, on a fold, across the picture's seam, in the middle between four texels.
#[test]
fn it_is_whole_where_a_picture_is_cut() {
    let mut sky = Sky::open();
    for (layout, query) in &layouts()[..3] {
        for axes in [Axes::Enu, Axes::Unity, Axes::Three] {
            for [zenith, azimuth] in
                [[60.0, 0.0], [60.0, 45.0], [45.0, 90.0], [54.7356, 45.0], [80.0, 180.0], [89.0, 270.0]]
            {
                let query = [query, &[("size", "32"), ("axes", axes.name()), ("eye", "0,0,3000")][..]].concat();
                let (picture, added) = added(&mut sky, &given(zenith, azimuth, 0.533), &query);
                let what = format!("{layout:?} for {axes:?}, sun at {zenith}, {azimuth}");
                assert_near(irradiance(&picture, &added, *layout), BEAM, 0.01, &what);
            }
        }
    }
}

/// A picture of bands, as large ones are.
#[test]
fn it_is_whole_in_large_pictures() {
    let mut sky = Sky::open();
    let (picture, added) = added(&mut sky, &given(45.0, 150.0, 0.533), &[("size", "1200")]);
    assert_near(irradiance(&picture, &added, SphereLayout::Equirect), BEAM, 0.01, "equirect of 1200");
}

const SIZE: usize = 161;

/// A telescope's picture of the disc. A camera's field is at least one degree.
fn close(sky: &mut Sky, scene: &Value, look: &str) -> Vec<[f64; 3]> {
    let size = SIZE.to_string();
    let query = [("projection", "camera"), ("look", look), ("fov", "1"), ("size", &*size)];
    added(sky, scene, &query).1
}

#[test]
fn it_darkens_towards_its_limb_as_the_sun_does() {
    let mut sky = Sky::open();
    let found = close(&mut sky, &given(50.0, 150.0, 0.8), "150,40");
    let middle = found[SIZE / 2 * SIZE + SIZE / 2];
    // Of the disc's radius, by columns; a texel is a hundredth of it.
    for out in [0.0, 0.3, 0.6, 0.8, 0.9, 0.95] {
        let radius = 0.4 * SIZE as f64;
        let x = (SIZE / 2) as f64 + (out * radius).round();
        let out = (x - (SIZE / 2) as f64) / radius;
        let mu = (1.0 - out * out).sqrt();
        let light = found[SIZE / 2 * SIZE + x as usize];
        // C. W. Allen's Astrophysical Quantities, 4th edition (2000), at 550 nm; it falls short of none of the laws in use by more
        // than a few percent.
        let allen = 0.3 + 0.93 * mu - 0.23 * mu * mu;
        let green = light[1] / middle[1];
        assert!((green / allen - 1.0).abs() < 0.04, "green at {out}: {green} not {allen}");
        // The limb is redder.
        let [red, blue] = [light[0] / middle[0], light[2] / middle[2]];
        assert!(out == 0.0 || (red > green && green > blue), "{out}: {red}, {green}, {blue}");
        for (c, nm) in [650.0, 550.0, 450.0].into_iter().enumerate() {
            let law = mu.powf(-0.023 + 292.0 / nm);
            assert!((light[c] / middle[c] - law).abs() < 0.01, "{nm} nm at {out}");
        }
    }
    let covered = found.iter().filter(|light| light[1] > 0.5 * middle[1]).count() as f64;
    let disc = PI * (0.4 * SIZE as f64).powi(2);
    assert!(covered > 0.9 * disc && covered < 1.01 * disc, "{covered} of {disc} texels");
}

/// Clouds between the eye and the sun leave of it what they leave of the beam.
#[test]
fn clouds_hide_it_by_their_transmittance() {
    let mut sky = Sky::open();
    for (depth, zenith) in [(0.5, 30.0), (2.0, 50.0), (5.0, 10.0)] {
        let mut scene = given(zenith, 150.0, 0.533);
        scene["layers"] = json!([hg_layer(json!({ "kind": "uniform", "metres": 100 }), depth / 100.0, 1.0)]);
        for (eye, left) in [("0,0,2", (-depth / zenith.to_radians().cos()).exp()), ("0,0,5000", 1.0)] {
            let (picture, added) = added(&mut sky, &scene, &[("size", "256"), ("eye", eye), ("method", "analytic")]);
            let found = irradiance(&picture, &added, SphereLayout::Equirect);
            // A texel shows the cloud over 0.7 degrees as in its middle.
            assert_near(found, BEAM.map(|beam| left * beam), 0.05, &format!("depth {depth}, eye at {eye}"));
        }
    }
}

/// Share of a darkened disc above a line through it, by its own law.
fn share_above(line: f64, exponent: f64) -> f64 {
    let (mut above, mut all) = (0.0, 0.0);
    for i in 0..400 * 400 {
        let at = |step: i32| (f64::from(step) + 0.5) / 200.0 - 1.0;
        let (x, y) = (at(i % 400), at(i / 400));
        let rest = 1.0 - x * x - y * y;
        if rest > 0.0 {
            let light = rest.powf(0.5 * exponent);
            all += light;
            above += if y > line { light } else { 0.0 };
        }
    }
    above / all
}

#[test]
fn the_ground_hides_what_is_below_the_horizon() {
    let mut sky = Sky::open();
    for elevation in [0.02, 0.15, 0.3] {
        for size in ["64", "500"] {
            let scene = given(90.0 - elevation, 150.0, 0.533);
            let (picture, added) = added(&mut sky, &scene, &[("size", size), ("eye", "0,0,0")]);
            let found = irradiance(&picture, &added, SphereLayout::Equirect);
            let line = -elevation / (0.5 * 0.533);
            let expected: [f64; 3] =
                std::array::from_fn(|c| BEAM[c] * share_above(line, -0.023 + 0.292 / [0.65, 0.55, 0.45][c]));
            assert_near(found, expected, 0.01, &format!("sun {elevation} up, {size}"));
        }
    }
    // Below the horizon there is none.
    assert!(close(&mut sky, &given(90.5, 150.0, 0.533), "150,0").iter().all(|light| *light == [0.0; 3]));
}

#[test]
fn through_air_it_has_the_beam_at_the_eye() {
    let mut sky = Sky::open();
    for zenith in [0.0, 30.0, 60.0, 80.0, 86.0, 89.0, 89.9] {
        let scene = in_air(json!({ "zenith_deg": zenith, "azimuth_deg": 150 }));
        let beam = sky.job(&scene, "sky", &[]).illumination().beam;
        for size in ["16", "150"] {
            let (picture, added) = added(&mut sky, &scene, &[("size", size), ("eye", "0,0,0")]);
            assert_near(irradiance(&picture, &added, SphereLayout::Equirect), beam, 0.01, &format!("sun at {zenith}"));
        }
    }
    // From above the air there is more of it, by what air takes.
    let scene = in_air(json!({ "zenith_deg": 70, "azimuth_deg": 150 }));
    let [low, high] = ["0,0,2", "0,0,100000"].map(|eye| {
        let (picture, added) = added(&mut sky, &scene, &[("size", "64"), ("eye", eye)]);
        irradiance(&picture, &added, SphereLayout::Equirect)
    });
    // The bare sun: 133 klx (G. Kopp and J. Lean's total irradiance in the spectrum that the matrix was fitted to).
    let illuminance = |[r, g, b]: [f64; 3]| 0.2127 * r + 0.7152 * g + 0.0722 * b;
    assert!((illuminance(high) - 133.0).abs() < 2.0, "{high:?}");
    assert!(illuminance(low) < 0.8 * illuminance(high) && low[2] / low[0] < high[2] / high[0], "{low:?}");
}

/// Middle of what the disc adds to a camera's picture of one degree: azimuth and elevation.
fn centre(found: &[[f64; 3]], look_deg: [f64; 2]) -> [f64; 2] {
    let layout = SphereLayout::Camera { look_deg, fov_deg: 1.0, aspect: 1.0 };
    let sphere = Sphere { layout, axes: Axes::Enu, eye: [0.0; 3] };
    let mut sum = [0.0; 3];
    for (i, light) in found.iter().enumerate() {
        let place = [(i % SIZE) as f64 + 0.5, (i / SIZE) as f64 + 0.5];
        let direction = sphere.direction(place, [SIZE as u32; 2]).unwrap();
        (0..3).for_each(|axis| sum[axis] += light[1] * direction[axis]);
    }
    let [east, north, up] = sum;
    [east.atan2(north).to_degrees().rem_euclid(360.0), up.atan2(east.hypot(north)).to_degrees()]
}

#[test]
fn it_stands_where_the_sun_appears() {
    let mut sky = Sky::open();
    let (latitude, longitude, altitude) = (48.14, 11.58, 520.0);
    let place = Place::new(latitude, longitude, altitude).unwrap();
    for (utc, least_lift_deg) in [("2026-06-21T10:00:00Z", 0.0), ("2026-06-21T03:40:00Z", 0.1)] {
        let sun = SunPosition::at(place, utc.parse().unwrap()).unwrap();
        let lift = sun.zenith_deg - sun.apparent_zenith_deg;
        assert!(lift > least_lift_deg && sun.zenith_deg < 89.0, "{sun:?}");
        let scene = json!({ "latitude_deg": latitude, "longitude_deg": longitude, "altitude_m": altitude, "utc": utc });
        let look = [sun.azimuth_deg, 90.0 - sun.apparent_zenith_deg];
        let found = close(&mut sky, &in_air(scene), &format!("{},{}", look[0], look[1]));
        let [azimuth, elevation] = centre(&found, look);
        let off = [(azimuth - look[0]) * look[1].to_radians().cos(), elevation - look[1]];
        // The lower limb is dimmer through more air.
        assert!(off[0].abs() < 0.002 && off[1].abs() < 0.02, "{utc}: {off:?} from where it appears, lifted by {lift}");
    }
    // The caller's own light goes straight.
    let look = [150.0, 1.0];
    let [azimuth, elevation] = centre(&close(&mut sky, &given(89.0, 150.0, 0.533), "150,1"), look);
    assert!((azimuth - 150.0).abs() < 1e-3 && (elevation - 1.0).abs() < 1e-3, "{azimuth}, {elevation}");
}

#[test]
fn it_is_left_out_unless_it_is_asked_for() {
    let mut sky = Sky::open();
    let scene = given(50.0, 150.0, 0.533);
    let plain = sky.render(&scene, "sky", &[("size", "32")]).data;
    assert_eq!(sky.render(&scene, "sky", &[("size", "32"), ("disc", "false")]).data, plain);
    assert_ne!(sky.render(&scene, "sky", &[("size", "32"), ("disc", "true")]).data, plain);
    // All of it lies within the disc's own distance, and a texel's, of the sun.
    let (picture, added) = added(&mut sky, &scene, &[("size", "180")]);
    for (i, _) in added.iter().enumerate().filter(|(_, light)| **light != [0.0; 3]) {
        let (x, y) = (i as u32 % picture.width, i as u32 / picture.width);
        let azimuth = TAU * (f64::from(x) + 0.5) / f64::from(picture.width);
        let elevation = 90.0 - (f64::from(y) + 0.5);
        assert!((azimuth.to_degrees() - 150.0).abs() < 1.2 && (elevation - 40.0).abs() < 1.2, "{x}, {y}");
    }
}
