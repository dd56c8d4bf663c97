//! The plan: cheaper for larger tolerances, never beyond them, and its march is as exact as it says.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::Sky;
use serde_json::{Value, json};
use skyloom::method::{Method, SlabMethod, Told, Transport};
use skyloom::plan::{Plan, expected_error};
use skyloom::projection::Side;
use skyloom::reference::Map;
use skyloom::reference::path::path_in_layer;
use skyloom::render::Watch;
use skyloom::request::Request;
use skyloom::scene::Scene;
use skyloom::tables::Detail;

fn request(tolerance: f64) -> Request {
    asked(&[("tolerance", &tolerance.to_string())])
}

fn asked(query: &[(&str, &str)]) -> Request {
    let query: Vec<_> = query.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
    Request::parse("cloud", "exr", &query).unwrap()
}

fn scene(layers: &Value) -> Scene {
    Scene::from_json(json!({ "layers": layers }).to_string().as_bytes()).unwrap()
}

fn empty() -> Scene {
    scene(&json!([]))
}

/// Layers whose tops do not tell how deep they are have no bright and dark sides; what eddies do not change is solved.
#[test]
fn flat_tops_are_taken_as_columns() {
    let (hanging, standing) = (
        json!({"flat": "top", "top_m": 1500, "thickness": {"kind": "stratocumulus"}, "wind": {"turbulence_m_s": 1}}),
        json!({"thickness": {"kind": "stratocumulus"}}),
    );
    let even = json!({"base_m": 3000, "thickness": {"kind": "uniform", "metres": 100}});
    for (layers, transport) in [
        (json!([hanging]), Transport::Columns),
        (json!([hanging, even]), Transport::Columns),
        (json!([standing]), Transport::Blended),
        (json!([hanging, {"base_m": 4000, "thickness": {"kind": "stratocumulus"}}]), Transport::Blended),
        (json!([even]), Transport::Blended),
    ] {
        assert_eq!(Plan::new(&request(0.02), &scene(&layers)).transport, transport, "{layers}");
    }
    let sky = |tolerance: &str, layers: Value| {
        let query = [("tolerance".to_owned(), tolerance.to_owned())];
        Plan::new(&Request::parse("sky", "exr", &query).unwrap(), &scene(&layers)).transport
    };
    // What is seen of a sky is solved for, unless much may err or nothing is uneven.
    assert_eq!(sky("0.02", json!([hanging])), Transport::Lattice);
    assert_eq!(sky("0.02", json!([standing])), Transport::Lattice);
    assert_eq!(sky("0.16", json!([standing])), Transport::Blended);
    assert_eq!(sky("0.55", json!([standing])), Transport::Columns);
    assert_eq!(sky("0.02", json!([even])), Transport::Blended);
    // And so is what an eye sees of a plane.
    let eye = |layers: &Value| Plan::new(&asked(&[("eye", "0,0,2")]), &scene(layers)).transport;
    assert_eq!([eye(&json!([standing])), eye(&json!([hanging]))], [Transport::Lattice; 2]);
    let asked = Plan::new(&asked(&[("transport", "tilted")]), &scene(&json!([hanging])));
    assert_eq!(asked.transport, Transport::Tilted);
}

/// What maps tell of a cloud beside the optical depth of its columns says which transport its light is carried by.
#[test]
fn maps_are_taken_by_what_they_tell() {
    let image = "0".repeat(64);
    let (heights, depth) = (json!({"image": image, "scale_m": 1}), json!({"image": image}));
    let mut thickness = heights.clone();
    thickness["kind"] = json!("image");
    let sheet = json!({"base_m": 900, "optical_depth": depth});
    let tops = json!({"base_m": 900, "top": heights, "optical_depth": depth});
    let over = json!({"base_m": 900, "thickness": thickness, "optical_depth": depth});
    let product = json!({"top": heights, "optical_depth": depth});
    let whole = json!({"base": heights, "top": heights, "optical_depth": depth});
    let hung = json!({"flat": "top", "top_m": 1500, "thickness": thickness, "optical_depth": depth});
    let even = json!({"base_m": 3000, "thickness": {"kind": "uniform", "metres": 100}});
    let standing = json!({"base_m": 4000, "thickness": {"kind": "stratocumulus"}});
    let still = json!({"flat": "top", "top_m": 1500, "thickness": {"kind": "stratocumulus"}});
    let (columns, blended, lattice) = (Transport::Columns, Transport::Blended, Transport::Lattice);
    for (layers, wanted) in [
        (json!([sheet]), [blended, columns, columns, columns]),
        (json!([tops]), [columns; 4]),
        (json!([over]), [columns; 4]),
        (json!([product]), [columns; 4]),
        (json!([whole]), [lattice; 4]),
        (json!([hung]), [lattice; 4]),
        (json!([whole, even]), [lattice; 4]),
        // The least that is told of one is told of all.
        (
            json!([sheet, {"base": heights, "top": heights, "optical_depth": depth}]),
            [blended, columns, columns, columns],
        ),
        (json!([whole, standing]), [blended, blended, columns, lattice]),
        (json!([still]), [columns, lattice, lattice, lattice]),
    ] {
        let scene = scene(&layers);
        let plan = |texture: &str, view: &str| {
            let view = (!view.is_empty()).then(|| ("view".to_owned(), view.to_owned()));
            let query: Vec<_> = view.into_iter().chain([("tolerance".to_owned(), "0.02".to_owned())]).collect();
            let request = Request::parse(texture, "exr", &query).unwrap();
            let plan = Plan::new(&request, &scene);
            let choices = plan.explain(&scene, &request);
            let told = choices.iter().find(|choice| choice.stage == "sunlight").unwrap().error;
            (plan.transport, told)
        };
        let found = [plan("irradiance", ""), plan("cloud", "below"), plan("cloud", "above"), plan("sky", "")];
        assert_eq!(found.map(|(transport, _)| transport), wanted, "{layers}");
        if wanted == [lattice; 4] {
            assert_eq!(found.map(|(_, error)| error)[..3], lattice.format_errors(Told::Shapes), "{layers}");
        }
    }
    // A tolerance that columns meet is met by columns.
    let rough = Plan::new(&asked(&[("tolerance", "0.2")]), &scene(&json!([whole])));
    assert_eq!(rough.transport, columns);
}

/// Where nothing is within the tolerance, the plan takes the cheapest that errs by no more than 1.3 times the least, of those that keep the light's
/// mean: columns, which do not, only where they err least.
#[test]
fn defaults_are_the_cheapest_of_those_near_the_best() {
    let synthetic = |coverage: f64| scene(&json!([{"thickness": {"kind": "stratocumulus", "coverage": coverage}}]));
    for (coverage, gaps) in [(1.0, false), (0.6, true)] {
        for (view, side) in [("below", Side::Below), ("above", Side::Above)] {
            let error = |transport: Transport| transport.radiance_error(side, gaps);
            let taken = Plan::new(&asked(&[("view", view)]), &synthetic(coverage)).transport;
            let (columns, blended) = (error(Transport::Columns), error(Transport::Blended));
            let wanted = if columns <= blended { Transport::Columns } else { Transport::Blended };
            assert_eq!(taken, wanted, "{coverage} {view}");
            assert!(error(taken) <= 1.3 * columns.min(blended));
        }
    }
    // Under no charted sun is the light of a default worse than that of columns.
    for (field, gaps) in KINDS {
        let coverage = if gaps { 0.6 } else { 1.0 };
        let request = Request::parse("irradiance", "exr", &[]).unwrap();
        let taken = Plan::new(&request, &synthetic(coverage)).transport;
        for light in ["base", "ground"] {
            for sun in ["0", "30", "60", "70", "80"] {
                let [error, columns] = [taken, Transport::Columns].map(|of| charted(field, light, of, sun));
                assert!(error <= 1.01 * columns, "{field} {light} {sun}: {error}, columns {columns}");
            }
        }
    }
}

#[test]
fn tolerance_picks_the_cheapest_method_within_it() {
    for (tolerance, method) in [
        (1.0, SlabMethod::Forward),
        (SlabMethod::Forward.error(), SlabMethod::Forward),
        (0.3, SlabMethod::Tabulated(Detail::Coarse)),
        (SlabMethod::Tabulated(Detail::Coarse).error(), SlabMethod::Tabulated(Detail::Coarse)),
        (0.02, SlabMethod::Tabulated(Detail::Fine)),
        (0.01, SlabMethod::Tabulated(Detail::Fine)),
        (0.003, SlabMethod::Tabulated(Detail::Finest)),
        (1e-6, SlabMethod::Tabulated(Detail::Finest)),
    ] {
        assert_eq!(Plan::new(&request(tolerance), &empty()).slab, Some(method), "tolerance {tolerance}");
    }
}

#[test]
fn expected_errors_of_the_slab_are_those_of_the_chart() {
    let chart = include_str!("../docs/charts/slab.csv");
    let measured = |method: &str| {
        let row = chart.lines().find(|line| line.starts_with(&format!("{method},all,"))).unwrap();
        let cells: Vec<&str> = row.split(',').collect();
        // Root mean squares of reflected light, and of transmitted light beyond 10 degrees from the sun.
        [cells[5], cells[7]].map(|cell| cell.parse::<f64>().unwrap()).into_iter().fold(0.0, f64::max)
    };
    for (method, error) in SlabMethod::ALL.map(|method| (method.name(), method.error())) {
        let found = measured(method);
        assert!(found <= error && error < 2.5 * found, "{method}: {error} is promised, {found} was measured");
    }
}

/// The veil's errors by depth are the largest up to there of a chart over depths and suns, rounded up.
#[test]
fn the_veil_is_taken_of_sheets_that_are_thin_enough() {
    let chart = include_str!("../docs/charts/slab-validity.csv");
    let rows: Vec<Vec<&str>> = chart.lines().map(|line| line.split(',').collect()).collect();
    for (side, light, depths) in [
        (Side::Below, "transmitted", &[0.0625, 0.125, 0.25, 0.353, 0.5, 0.7, 0.72][..]),
        (Side::Above, "reflected", &[0.044, 0.0625, 0.07]),
    ] {
        for &depth in depths {
            let mut squares: Vec<(f64, Vec<f64>)> = Vec::new();
            for row in rows.iter().filter(|row| row[..3] == ["forward", "depth_sun", light]) {
                let [to, error] = [4, 7].map(|column| row[column].parse::<f64>().unwrap());
                match squares.iter_mut().find(|(column, _)| *column == to) {
                    Some((_, of_column)) => of_column.push(error * error),
                    None => squares.push((to, vec![error * error])),
                }
            }
            let mean = |of_column: &Vec<f64>| (of_column.iter().sum::<f64>() / of_column.len() as f64).sqrt();
            let within = squares.iter().filter(|(to, _)| *to <= 1.02 * depth);
            let worst = within.map(|(_, of_column)| mean(of_column)).fold(0.0, f64::max);
            let promised = SlabMethod::Forward.error_of(Some((depth, side)));
            let sheet = scene(&json!([{ "kind": "sheet", "optical_depth": depth }]));
            let view = if side == Side::Above { "above" } else { "below" };
            let taken = |tolerance: f64| {
                let query = [("view", view), ("tolerance", &*tolerance.to_string())];
                Plan::new(&asked(&query), &sheet).slab == Some(SlabMethod::Forward)
            };
            assert!(taken(promised + 1e-6) && !taken(promised - 1e-6), "{light} {depth}");
            if promised < SlabMethod::Forward.error() {
                assert!(
                    worst <= promised && promised < 1.15 * worst,
                    "{light} {depth}: {promised}, {worst} was measured"
                );
            }
        }
    }
    // Nothing is known of a cloud that is not the same everywhere, nor of water by its number and size.
    let others = [
        json!([{ "thickness": { "kind": "stratocumulus", "mean_m": 10 } }]),
        json!([{ "thickness": { "kind": "uniform", "metres": 1 } }]),
    ];
    for layers in others {
        assert_ne!(Plan::new(&asked(&[("tolerance", "0.3")]), &scene(&layers)).slab, Some(SlabMethod::Forward));
    }
}

#[test]
fn expected_errors_of_light_are_those_of_the_chart() {
    let chart = include_str!("../docs/charts/light.csv");
    for (transport, promised) in Transport::ALL.map(|(_, transport)| (transport, transport.error())) {
        let rows = chart.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let of_it = rows.filter(|row| row[1] == "base" && row[2] == transport.name() && ["60", "80"].contains(&row[3]));
        let errors: Vec<f64> =
            of_it.map(|row| row[4].parse::<f64>().unwrap() / row[7].parse::<f64>().unwrap()).collect();
        assert_eq!(errors.len(), 4);
        let found = errors.iter().sum::<f64>() / 4.0;
        // Rounded up to whole per cents.
        assert!(
            found <= promised && promised < found + 0.01,
            "{transport:?}: {promised} is promised, {found} was measured"
        );
    }
}

/// Relative error of a transport in a row of the chart.
fn charted(field: &str, light: &str, transport: Transport, sun: &str) -> f64 {
    let chart = include_str!("../docs/charts/light.csv");
    let name = format!("{field},{light},{},{sun},", transport.name());
    let row: Vec<&str> = chart.lines().find(|line| line.starts_with(&name)).expect(&name).split(',').collect();
    row[4].parse::<f64>().unwrap() / row[7].parse::<f64>().unwrap()
}

/// Kinds of field, and whether the plan knows that they have no gaps.
const KINDS: [(&str, bool); 2] = [("overcast", false), ("broken", true)];
const SIDES: [(&str, Side, &str); 2] =
    [("below", Side::Below, "radiance from below"), ("above", Side::Above, "radiance from above")];
const RADIANCE_SUNS: [&str; 2] = ["40", "60"];

#[test]
fn expected_errors_of_radiance_are_those_of_the_chart() {
    for (_, transport) in Transport::ALL {
        for ((field, gaps), (_, side, light)) in KINDS.into_iter().flat_map(|kind| SIDES.map(|side| (kind, side))) {
            let found = RADIANCE_SUNS.map(|sun| charted(field, light, transport, sun)).iter().sum::<f64>() / 2.0;
            let promised = transport.radiance_error(side, gaps);
            // Rounded up to whole per cents.
            assert!(
                found <= promised && promised < found + 0.01,
                "{transport:?} {field} {light}: {promised} is promised, {found} was measured"
            );
            // So no plan takes entry.
            assert!(transport != Transport::Entry || promised >= Transport::Blended.radiance_error(side, gaps));
        }
    }
}

/// Of what is seen, no default errs more than independent columns under any sun that was charted, nor takes what comes in around from
/// above where slanted rays are better; and it is the same under all suns and at all times, so that no film changes from one to another.
#[test]
fn pictures_by_default_are_no_worse_than_columns() {
    let synthetic = |coverage: f64| json!({"kind": "stratocumulus", "coverage": coverage});
    let image = json!({"kind": "image", "image": "0".repeat(64), "scale_m": 1});
    let plan = |layers: &Value, view: &str, tolerance: f64, sun_deg: f64, time: &str| {
        let text = json!({ "layers": layers, "sun": { "zenith_deg": sun_deg } }).to_string();
        let tolerance = tolerance.to_string();
        let asked = asked(&[("view", view), ("tolerance", &tolerance), ("time", time)]);
        Plan::new(&asked, &Scene::from_json(text.as_bytes()).unwrap()).transport
    };
    // Of a map it is not known whether it has gaps.
    let fields =
        [("overcast", synthetic(1.0)), ("broken", synthetic(0.6)), ("overcast", image.clone()), ("broken", image)];
    for (field, thickness) in &fields {
        for (view, _, light) in SIDES {
            for tolerance in [0.9, 0.5, 0.3, 0.2, 0.02, 1e-3] {
                let layers = json!([{ "thickness": thickness }]);
                let default = plan(&layers, view, tolerance, 40.0, "0");
                assert_eq!(plan(&layers, view, tolerance, 80.0, "5000"), default);
                for sun in RADIANCE_SUNS {
                    let [error, columns, tilted] = [default, Transport::Columns, Transport::Tilted]
                        .map(|transport| charted(field, light, transport, sun));
                    let name = format!("{field} {light} {sun}, {tolerance}: {default:?} errs by {error}");
                    assert!(error <= 1.02 * columns, "{name}, columns by {columns}");
                    let by_entry = view == "above" && [Transport::Entry, Transport::Blended].contains(&default);
                    assert!(!by_entry || error <= 1.02 * tilted, "{name}, tilted by {tilted}");
                }
            }
        }
    }
    // One broken layer of several is enough.
    let both = json!([{"thickness": synthetic(1.0)}, {"base_m": 5000, "thickness": synthetic(0.5)}]);
    assert_eq!(plan(&both, "above", 0.02, 40.0, "0"), Transport::Columns);
    assert_eq!(plan(&json!([{"thickness": synthetic(1.0)}]), "above", 0.02, 40.0, "0"), Transport::Blended);
    assert_eq!(plan(&both, "below", 0.02, 40.0, "0"), Transport::Blended);
}

#[test]
fn a_method_that_is_asked_for_is_used() {
    for (name, method) in Method::ALL {
        let plan = Plan::new(&asked(&[("method", name)]), &empty());
        assert_eq!(plan.reference, method.reference());
        // What is traced takes no other method.
        let used = plan.slab.map(SlabMethod::asked_as);
        assert_eq!(used, Some(method).filter(|method| method.reference().is_none()), "{name}");
    }
}

#[test]
fn larger_tolerances_never_do_more() {
    let mut tolerance = 1e-4;
    while tolerance < 0.9 {
        let (fine, rough) = (Plan::new(&request(tolerance), &empty()), Plan::new(&request(1.1 * tolerance), &empty()));
        assert!(rough.detail() <= fine.detail());
        assert!(rough.texels_per_length <= fine.texels_per_length);
        assert!(rough.texels_per_height <= fine.texels_per_height && rough.exchange_change > fine.exchange_change);
        tolerance *= 1.1;
    }
}

fn broken(sun_deg: f64) -> Value {
    json!({
        "domain": { "extent_m": 20000, "resolution": 256 },
        "sun": { "zenith_deg": sun_deg, "azimuth_deg": 130 },
        "layers": [{ "thickness": { "kind": "stratocumulus", "pattern": "open", "coverage": 0.6, "seed": 5 },
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.02 } }],
    })
}

/// Root mean square difference of a rendered shadow and one marched in f64.
fn shadow_error(sky: &mut Sky, sun_deg: f64, tolerance: f64) -> f64 {
    let text = tolerance.to_string();
    let job = sky.job(&broken(sun_deg), "shadow", &[("peak", "false"), ("tolerance", &text), ("size", "64")]);
    let stages = sky.renderer.inspect(&job, &Watch::default()).unwrap();
    let thickness = Map::from(&stages.thickness);
    let mut fine = stages.frame;
    fine.place.max_steps = 1 << 20;
    let sun = glam::DVec3::from_array(fine.sun.towards.map(f64::from));
    let shift = stages.frame.place.shift_uv.map(f64::from);
    let mut sum = 0.0;
    for (i, found) in stages.output.iter().enumerate() {
        let centre = |i: usize| (i as f64 + 0.5) / 64.0;
        let uv = glam::dvec2(centre(i % 64) + shift[0], centre(i / 64) + shift[1]);
        let exact = (-f64::from(fine.medium.extinction_550) * path_in_layer(&thickness, &fine, uv, sun)).exp();
        sum += (f64::from(*found) - exact).powi(2);
    }
    (sum / stages.output.len() as f64).sqrt()
}

#[test]
fn a_march_is_as_exact_as_the_plan_says() {
    let mut sky = Sky::open();
    for sun_deg in [0.0, 30.0, 60.0, 80.0] {
        for tolerance in [0.02, 0.1, 0.3] {
            let job = sky.job(&broken(sun_deg), "shadow", &[("tolerance", &tolerance.to_string())]);
            let choices = job.plan().explain(job.scene(), job.request());
            let promised = choices.iter().find(|choice| choice.stage == "march").unwrap().error;
            let error = shadow_error(&mut sky, sun_deg, tolerance);
            eprintln!("sun {sun_deg}, tolerance {tolerance}: rms {error:.1e}, promised {promised}");
            assert!(error <= promised, "sun {sun_deg}, tolerance {tolerance}: {error} is more than {promised}");
        }
    }
}

#[test]
fn every_plan_explains_itself() {
    let mut sky = Sky::open();
    for texture in ["cloud", "shadow", "irradiance", "thickness"] {
        let job = sky.job(&broken(50.0), texture, &[]);
        let choices = job.plan().explain(job.scene(), job.request());
        assert!(choices.iter().all(|choice| !choice.choice.is_empty() && !choice.reason.is_empty()));
        assert!(expected_error(&choices).is_finite());
    }
}

/// A field is no finer than the texture can show, and what is shown is the same field.
#[test]
fn fields_are_no_finer_than_the_texture() {
    let mut sky = Sky::open();
    let scene = json!({
        "domain": { "extent_m": 20000, "resolution": 1024 },
        "layers": [{ "thickness": { "kind": "stratocumulus", "coverage": 0.7, "seed": 3 },
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.04 } }],
    });
    let mut thickness = |size: &str, tolerance: &str| {
        let job = sky.job(&scene, "shadow", &[("size", size), ("tolerance", tolerance)]);
        let texels = skyloom::plan::field_resolution(job.scene(), job.request());
        (texels, sky.renderer.inspect(&job, &Watch::default()).unwrap().thickness.data)
    };
    let (coarse, small) = thickness("64", "0.1");
    let (fine, whole) = thickness("64", "0.02");
    assert_eq!((coarse, fine, thickness("16", "0.3").0, thickness("1024", "0.3").0), (128, 1024, 128, 1024));
    // Waves shorter than two texels of the small one are left out, 5 % of the variance; the rest is the same.
    let block = |i: usize| {
        let (x, y) = (i % 128 * 8, i / 128 * 8);
        (0..64).map(|j| f64::from(whole[(y + j / 8) * 1024 + x + j % 8])).sum::<f64>() / 64.0
    };
    let pairs: Vec<(f64, f64)> = small.iter().enumerate().map(|(i, height)| (f64::from(*height), block(i))).collect();
    let mean = |value: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(value).sum::<f64>() / pairs.len() as f64;
    let (a, b) = (mean(&|p| p.0), mean(&|p| p.1));
    let correlation =
        mean(&|p| (p.0 - a) * (p.1 - b)) / (mean(&|p| (p.0 - a).powi(2)) * mean(&|p| (p.1 - b).powi(2))).sqrt();
    assert!(correlation > 0.95 && (a / b - 1.0).abs() < 0.02, "{correlation}, means {a} and {b} m");
}
