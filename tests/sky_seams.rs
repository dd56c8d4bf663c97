//! Seams of the texture sky: pictures go on over the edges of faces and of themselves, and along them they show what a camera does.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

mod common;

use common::sky::{Sky, hg_layer, texel_side};
use serde_json::{Value, json};
use skyloom::axes::Axes;
use skyloom::projection::{Sphere, SphereLayout};
use skyloom::render::Texture;

/// Cloud edges lie along a seam of some by chance.
const EYES: [[f64; 3]; 3] = [[300.0, -200.0, 2.0], [-7000.0, 4000.0, 300.0], [2000.0, 8000.0, 6000.0]];
const SIDE: u32 = 96;

fn scenes() -> [(&'static str, Value); 3] {
    let scene = |layers: Value| {
        json!({
            "domain": { "extent_m": 20_000, "resolution": 128 },
            "sun": { "zenith_deg": 50, "azimuth_deg": 150 },
            "atmosphere": "continental", "ground": { "albedo": [0.1, 0.15, 0.05] }, "layers": layers,
        })
    };
    let field = json!({ "kind": "stratocumulus", "pattern": "open", "mean_m": 250, "coverage": 0.5, "cell_m": 3000, "seed": 7 });
    let cumulus = json!([{ "kind": "cumulus", "base_m": 1200, "coverage": 0.2, "width_m": [800, 1500], "seed": 4,
        "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.03, "albedo": 1 } }]);
    [("clear", scene(json!([]))), ("broken", scene(json!([hg_layer(field, 0.04, 1.0)]))), ("cumulus", scene(cumulus))]
}

/// Layouts of the whole sphere, and the sizes at which their texels are as wide as each other's, about a degree.
fn layouts() -> [(SphereLayout, u32); 4] {
    [
        (SphereLayout::Equirect, 180),
        (SphereLayout::Octahedral, 203),
        (SphereLayout::Cube, SIDE),
        (SphereLayout::Fisheye { fov_deg: 360.0 }, 360),
    ]
}

fn place([x, y, z]: [f64; 3]) -> String {
    format!("{x},{y},{z}")
}

struct Picture {
    eye: [f64; 3],
    layout: SphereLayout,
    texture: Texture,
}

impl Picture {
    fn new(sky: &mut Sky, scene: &Value, at: [f64; 3], layout: SphereLayout, size: u32) -> Self {
        let (eye, size) = (place(at), size.to_string());
        let query = [("eye", &*eye), ("projection", layout.name()), ("size", &*size)];
        let fov: &[_] = if matches!(layout, SphereLayout::Fisheye { .. }) { &[("fov", "360")] } else { &[] };
        Self { eye: at, layout, texture: sky.render(scene, "sky", &[&query[..], fov].concat()) }
    }

    fn size(&self) -> [u32; 2] {
        [self.texture.width, self.texture.height]
    }

    fn direction(&self, [x, y]: [f64; 2]) -> Option<[f64; 3]> {
        let sphere = Sphere { layout: self.layout, axes: Axes::Enu, eye: self.eye };
        sphere.direction([x, y], self.size())
    }

    fn middle(&self, [x, y]: [u32; 2]) -> Option<[f64; 3]> {
        self.direction([f64::from(x) + 0.5, f64::from(y) + 0.5])
    }

    fn texel(&self, [x, y]: [u32; 2]) -> [f64; 3] {
        let at = 3 * (y * self.texture.width + x) as usize;
        std::array::from_fn(|c| f64::from(self.texture.data[at + c]))
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A texel beside a seam, the one behind it and the one beyond the seam, with that one's own one behind.
type Step = [[u32; 2]; 4];

/// The texels of a cube's faces along all 12 edges, twice each: from both sides. Which texel lies beyond is found by direction.
fn across_cube(picture: &Picture) -> Vec<Step> {
    let last = SIDE - 1;
    let rim = |face: u32| {
        (0..SIDE).flat_map(move |i| {
            [([i, 0], [i, 1]), ([i, last], [i, last - 1]), ([0, i], [1, i]), ([last, i], [last - 1, i])]
                .map(|pair| [pair.0, pair.1].map(|[x, y]| [x, y + SIDE * face]))
        })
    };
    let all: Vec<_> = (0..6).flat_map(|face| rim(face).map(move |pair| (face, pair))).collect();
    let towards = |texel| picture.middle(texel).unwrap();
    let beyond = |(face, [texel, behind]): &(u32, [[u32; 2]; 2])| {
        // As far beyond the edge as the texel lies before it.
        let [here, inner] = [*texel, *behind].map(towards);
        let mirrored: [f64; 3] = std::array::from_fn(|i| 2.0 * here[i] - inner[i]);
        let nearest = |a: &&(u32, [[u32; 2]; 2]), b: &&(u32, [[u32; 2]; 2])| {
            dot(towards(a.1[0]), mirrored).total_cmp(&dot(towards(b.1[0]), mirrored))
        };
        let found = all.iter().filter(|other| other.0 != *face).max_by(nearest).unwrap();
        [*behind, *texel, found.1[0], found.1[1]]
    };
    // Texels at a corner lie at two edges: which of them is meant is not clear, and every third is enough.
    let inside = |(_, [[x, y], _]): &&(u32, [[u32; 2]; 2])| {
        let place = [*x, *y % SIDE];
        place.iter().any(|i| (3..SIDE - 3).contains(i) && i % 3 == 0)
    };
    all.iter().filter(inside).map(beyond).collect()
}

fn across_octahedron(size: u32) -> Vec<Step> {
    let last = size - 1;
    let half = (1..size / 2).flat_map(|i| {
        [
            [[i, 1], [i, 0], [last - i, 0], [last - i, 1]],
            [[i, last - 1], [i, last], [last - i, last], [last - i, last - 1]],
            [[1, i], [0, i], [0, last - i], [1, last - i]],
            [[last - 1, i], [last, i], [last, last - i], [last - 1, last - i]],
        ]
    });
    half.collect()
}

fn across_equirect([width, height]: [u32; 2]) -> Vec<Step> {
    (0..height).map(|y| [[1, y], [0, y], [width - 1, y], [width - 2, y]]).collect()
}

/// Sums of steps of light over a seam and of those beside it, the mean of both sides, and of light, over all texels along it.
fn steps(picture: &Picture, seam: &[Step]) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for step in seam {
        let [a, b, c, d] = step.map(|texel| picture.texel(texel));
        for i in 0..3 {
            sums[0] += (b[i] - c[i]).abs();
            sums[1] += 0.5 * ((a[i] - b[i]).abs() + (c[i] - d[i]).abs());
            sums[2] += b[i];
        }
    }
    sums
}

/// Steps over a seam are no larger than those beside it, but for chance: of some hundred texels with clouds a few decide.
const OVER: f64 = 1.25;

#[test]
fn light_goes_on_over_every_seam() {
    let mut sky = Sky::open();
    for (name, scene) in scenes() {
        // The rim of a whole fisheye is a point.
        for (layout, size) in &layouts()[..3] {
            let (layout, size) = (*layout, *size);
            let mut sums = [0.0; 3];
            for eye in EYES {
                let picture = Picture::new(&mut sky, &scene, eye, layout, size);
                let seam = match layout {
                    SphereLayout::Equirect => across_equirect(picture.size()),
                    SphereLayout::Octahedral => across_octahedron(size),
                    _ => across_cube(&picture),
                };
                steps(&picture, &seam).into_iter().zip(&mut sums).for_each(|(step, sum)| *sum += step);
            }
            let [over, beside] = [sums[0] / sums[2], sums[1] / sums[2]];
            println!("{name}, {}: {over:.5} of the light over the seam, {beside:.5} beside it", layout.name());
            assert!(over <= OVER * beside, "{name}, {}: {over}, {beside}", layout.name());
        }
    }
}

/// Texels along a seam, and everywhere.
fn looked_at(picture: &Picture) -> [Vec<[u32; 2]>; 2] {
    let [width, height] = picture.size();
    let seam = match picture.layout {
        SphereLayout::Equirect => (0..height).step_by(3).map(|y| [0, y]).collect(),
        SphereLayout::Octahedral => across_octahedron(width).iter().step_by(6).map(|step| step[1]).collect(),
        SphereLayout::Cube => across_cube(picture).iter().step_by(7).map(|step| step[1]).collect(),
        _ => (0..width).step_by(4).map(|i| [i, height / 2]).collect(),
    };
    [seam, (0..width * height).step_by(977).map(|i| [i % width, i / width]).collect()]
}

/// A camera's texel as wide as that of a picture, so many of its widths above it.
fn camera(sky: &mut Sky, scene: &Value, picture: &Picture, towards: [f64; 3], widths_up: f64) -> [f64; 3] {
    let [east, north, up] = towards;
    let size = match picture.layout {
        SphereLayout::Cube => picture.texture.width,
        _ => picture.texture.height,
    };
    let fov_deg = 2.0 * (0.5 * texel_side(picture.layout, size, towards)).atan().to_degrees();
    // No picture is narrower than a degree.
    let across = if fov_deg < 1.0 { 3_u32 } else { 1 };
    let fov = (f64::from(across) * fov_deg).max(1.0).to_string();
    let look = format!("{},{}", east.atan2(north).to_degrees(), up.asin().to_degrees() + widths_up * fov_deg);
    let (wide, eye) = (across.to_string(), place(picture.eye));
    let query = [("projection", "camera"), ("look", &*look), ("eye", &*eye), ("fov", &*fov), ("size", &*wide)];
    let found = sky.render(scene, "sky", &query).data;
    std::array::from_fn(|c| f64::from(found[3 * (across * across / 2) as usize + c]))
}

/// Single precision through tables.
const SAME: f64 = 2e-4;
/// Texels of cloud that have several rays have them at other places in other projections: root mean square of the mean light, along seams as
/// elsewhere. With the mean width of texels in place of each one's own, cubes were off by 0.032 along their seams.
const CLOUDS: f64 = 0.025;
/// Sine of an elevation within which a texel may show sky and ground. Its shape decides how much of each.
const HORIZON: f64 = 0.02;

#[test]
fn a_camera_sees_what_texels_along_seams_show() {
    let mut sky = Sky::open();
    for (name, scene) in scenes() {
        for (layout, size) in layouts() {
            let picture = Picture::new(&mut sky, &scene, EYES[0], layout, size);
            for (what, texels) in ["along seams", "elsewhere"].into_iter().zip(looked_at(&picture)) {
                // Above the horizon and below: how many, squares of differences, light.
                let mut sums = [[0.0_f64; 3]; 2];
                for at in texels {
                    let Some(towards) = picture.middle(at) else { continue };
                    let found = picture.texel(at);
                    if towards[2].abs() < HORIZON {
                        let around =
                            [-2.0, -1.0, 0.0, 1.0, 2.0].map(|up| camera(&mut sky, &scene, &picture, towards, up));
                        for c in 0..3 {
                            let least = around.iter().map(|light| light[c]).fold(f64::INFINITY, f64::min);
                            let most = around.iter().map(|light| light[c]).fold(0.0, f64::max);
                            let between = found[c] > 0.95 * least && found[c] < 1.05 * most;
                            assert!(between, "{name}, {layout:?}, {at:?}: {found:?} is not among {around:?}");
                        }
                        continue;
                    }
                    let wanted = camera(&mut sky, &scene, &picture, towards, 0.0);
                    for c in 0..3 {
                        let sum = &mut sums[usize::from(towards[2] < 0.0)];
                        *sum = [sum[0] + 1.0, sum[1] + (found[c] - wanted[c]).powi(2), sum[2] + wanted[c]];
                    }
                }
                let [above, below] = sums.map(|[count, squares, light]| (squares * count).sqrt() / light.max(1e-9));
                println!("{name}, {} {what}: {above:.5} above, {below:.5} below", layout.name());
                let most = if name == "clear" { SAME } else { CLOUDS };
                assert!(above < most && below < SAME, "{name}, {layout:?} {what}: {above}, {below}");
            }
        }
    }
}
