//! One thing, one name: the normal form of a normal form is itself, to the letter.

use crate::{layer, read};
use proptest::prelude::*;
use serde_json::{Value, json};
use skyloom::scene::{Cumulus, Scene, SceneError};

/// Numbers as clients write them: ordinary ones, both zeros, the smallest, those that rounding joins with others.
fn spelt(low: f64, high: f64) -> BoxedStrategy<Value> {
    let odd =
        [0.0, -0.0, -1e-20, -5.7e-16, 1e-320, -1e-320, 1e-15, 0.1, 360.0_f64.next_down(), -360.0, 90.0, 1.0, low, high];
    let odd: Vec<f64> = odd.into_iter().filter(|number| (low..=high).contains(number)).collect();
    let whole = (low.ceil() as i64)..=(high.floor().min(1e6) as i64);
    prop_oneof![
        (low..=high).prop_map(|number| json!(number)),
        prop::sample::select(odd).prop_map(|number| json!(number)),
        whole.clone().prop_map(|number| json!(number)),
        whole.prop_map(|number| json!(number as f64)),
    ]
    .boxed()
}

fn colour(low: f64, high: f64) -> impl Strategy<Value = Value> {
    let channels = prop::array::uniform3(spelt(low, high)).prop_map(|channels| json!(channels));
    prop_oneof![spelt(low, high), channels]
}

fn object(fields: Vec<(&'static str, BoxedStrategy<Value>)>) -> BoxedStrategy<Value> {
    let given = fields.into_iter().map(|(name, value)| (Just(name), proptest::option::weighted(0.8, value)));
    let given: Vec<_> = given.collect();
    given
        .prop_map(|fields| {
            fields
                .into_iter()
                .filter_map(|(name, value)| Some((name.to_owned(), value?)))
                .collect::<serde_json::Map<_, _>>()
                .into()
        })
        .boxed()
}

fn with(fields: BoxedStrategy<Value>, more: Value) -> BoxedStrategy<Value> {
    fields
        .prop_map(move |mut fields| {
            let entries = more.as_object().unwrap().clone();
            fields.as_object_mut().unwrap().extend(entries);
            fields
        })
        .boxed()
}

fn droplets() -> BoxedStrategy<Value> {
    let water = object(vec![
        ("effective_radius_um", spelt(0.5, 50.0)),
        ("broadness", spelt(0.5, 20.0)),
        ("number_per_cm3", spelt(0.01, 1e4)),
        ("extinction_per_m", spelt(1e-4, 1.0)),
        ("refractive_index", colour(1.01, 2.0).boxed()),
    ]);
    let given = |more: Value| {
        let albedo = object(vec![("albedo", spelt(0.0, 1.0))]);
        (albedo, spelt(1e-4, 1.0)).prop_map(move |(mut droplets, extinction)| {
            droplets.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
            droplets["extinction_per_m"] = extinction;
            droplets
        })
    };
    let table =
        (spelt(0.1, 1e12), spelt(0.1, 1e12), prop_oneof![Just(json!(0)), Just(json!(-0.0)), Just(json!(-1e-9))]);
    let table = table
        .prop_flat_map(move |(first, last, start)| given(json!({ "phase_function": [[start, first], [180.0, last]] })));
    let given_again = |more: Value| {
        with(object(vec![("albedo", spelt(0.0, 1.0)), ("extinction_per_m", Just(json!(1)).boxed())]), more)
    };
    let closed = spelt(-0.9, 0.98)
        .prop_flat_map(move |g| given_again(json!({ "henyey_greenstein": g, "extinction_per_m": 1e-4 })));
    prop_oneof![water, table, closed].boxed()
}

fn scene() -> impl Strategy<Value = Value> {
    let wind = object(vec![
        ("speed_m_s", spelt(0.0, 200.0)),
        ("from_deg", spelt(-360.0, 360.0)),
        ("turbulence_m_s", spelt(0.0, 50.0)),
    ]);
    let field = object(vec![
        ("pattern", prop::sample::select(vec![json!("closed"), json!("open"), json!("fractal")]).boxed()),
        ("mean_m", spelt(0.0, 4e4)),
        ("coverage", spelt(0.0, 1.0)),
        ("cell_m", spelt(1.0, 1e6)),
        ("law", prop::sample::select(vec![json!("lognormal"), json!("gamma")]).boxed()),
        ("seed", any::<u32>().prop_map(|seed| json!(f64::from(seed))).boxed()),
    ]);
    let uniform = spelt(0.0, 1e5).prop_map(|metres| json!({ "kind": "uniform", "metres": metres }));
    let map = spelt(0.0, 1e5).prop_map(|scale| json!({ "kind": "image", "image": "5".repeat(64), "scale_m": scale }));
    let thickness = prop_oneof![with(field, json!({ "kind": "stratocumulus" })), uniform, map];
    let layer = object(vec![("base_m", spelt(0.0, 2e4)), ("droplets", droplets()), ("wind", wind)]);
    let stratiform = (layer, thickness).prop_map(|(mut layer, thickness)| {
        layer["thickness"] = thickness;
        json!([layer])
    });
    let width = (50.0..2e4_f64, 0.0..1.0_f64).prop_map(|(least, part)| json!([least, least + part * (2e4 - least)]));
    let cumulus = object(vec![
        ("base_m", spelt(0.0, 2e4)),
        ("droplets", droplets()),
        ("coverage", spelt(0.0, 0.6)),
        ("width_m", width.boxed()),
        ("seed", any::<u32>().prop_map(|seed| json!(seed)).boxed()),
        ("edge_m", spelt(0.0, 200.0)),
    ]);
    let cumulus = with(cumulus, json!({ "kind": "cumulus" })).prop_map(|layer| json!([layer]));
    let layer = prop_oneof![3 => stratiform, 1 => cumulus];
    let ground = prop_oneof![colour(0.0, 1.0), Just(json!({ "image": "a".repeat(64), "linear": true }))];
    object(vec![
        (
            "domain",
            object(vec![
                ("extent_m", spelt(1.0, 1e6)),
                ("resolution", (1..=4096_u32).prop_map(|n| json!(f64::from(n))).boxed()),
            ]),
        ),
        (
            "sun",
            object(vec![
                ("zenith_deg", spelt(0.0, 180.0)),
                ("azimuth_deg", spelt(-360.0, 360.0)),
                ("angular_diameter_deg", spelt(0.0, 10.0)),
            ]),
        ),
        ("atmosphere", object(vec![("sun", colour(0.0, 1e6).boxed()), ("sky", colour(0.0, 1e6).boxed())])),
        ("ground", object(vec![("albedo", ground.boxed())])),
        ("layers", layer.boxed()),
    ])
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// The normal form of a normal form is itself, to the letter.
    #[test]
    fn a_normal_form_is_its_own(scene in scene()) {
        let once = read(&scene);
        let text = once.to_json().to_string();
        let again = Scene::from_json(text.as_bytes()).unwrap();
        prop_assert_eq!(&again, &once);
        prop_assert_eq!(&again.to_json().to_string(), &text);
        prop_assert_eq!(again.id(), once.id());
        prop_assert!(text.len() <= Scene::MAX_BYTES);
        // Also when it was laid out for people.
        let pretty = serde_json::to_string_pretty(&once.to_json()).unwrap();
        prop_assert_eq!(Scene::from_json(pretty.as_bytes()).unwrap().id(), once.id());
    }
}

#[test]
fn directions_have_one_number_each() {
    for field in ["/sun/azimuth_deg", "/layers/0/wind/from_deg"] {
        let written = |degrees: f64| {
            let mut scene = layer(json!({ "wind": { "from_deg": 0 } }));
            scene["sun"] = json!({ "azimuth_deg": 0 });
            *scene.pointer_mut(field).unwrap() = json!(degrees);
            read(&scene).to_json().pointer(field).unwrap().to_string()
        };
        for north in [0.0, -0.0, 360.0, -360.0, -1e-20, -5.7e-16, -1e-320, -f64::MIN_POSITIVE] {
            assert_eq!(written(north), "0.0", "{field} {north:e}");
        }
        assert_eq!(written(-90.0), "270.0");
        assert_eq!(written(360.0_f64.next_down()), "359.99999999999994");
        assert_eq!(written(-360.0_f64.next_down()), "5.684341886080802e-14");
        assert_eq!(written(1e-320), "1e-320");
    }
}

/// What is stored has to be readable again: a scene is not taken if its normal form is too long for that.
#[test]
fn a_scene_that_is_too_long_when_written_out_is_refused() {
    let points: Vec<_> = (0..4096).map(|i| (if i == 4095 { 180.0 } else { f64::from(i) * 0.04 }, 1e11)).collect();
    let table = points.iter().map(|(angle, value)| format!("[{angle},{value:e}]")).collect::<Vec<_>>().join(",");
    let layer = |i: usize| {
        format!(
            r#"{{"base_m":{i},"thickness":{{"kind":"uniform","metres":1}},"droplets":{{"extinction_per_m":1,"phase_function":[{table}]}}}}"#
        )
    };
    // Short numbers that are long when they are written out.
    let spheres = vec!["[-4e5,-4e5,3e4,2e4]"; Cumulus::MAX_SPHERES].join(",");
    let cumulus = format!(
        r#"{{"kind":"cumulus","base_m":9,"spheres":[{spheres}],"droplets":{{"extinction_per_m":1,"phase_function":[{table}]}}}}"#
    );
    let of = |layers: usize| {
        let layers: Vec<_> = (0..layers).map(layer).chain([cumulus.clone()]).collect();
        format!(r#"{{"domain":{{"extent_m":4e5}},"layers":[{}]}}"#, layers.join(","))
    };
    let fits = Scene::from_json(of(1).as_bytes()).unwrap();
    assert_eq!(Scene::from_json(fits.to_json().to_string().as_bytes()).unwrap(), fits);
    assert!(of(3).len() < Scene::MAX_BYTES);
    match Scene::from_json(of(3).as_bytes()) {
        Err(SceneError::Invalid(errors)) => {
            assert_eq!(errors.len(), 1);
            assert!(errors[0].pointer.is_empty() && errors[0].detail.contains("spelled out"), "{}", errors[0].detail);
        }
        other => panic!("{other:?}"),
    }
}
