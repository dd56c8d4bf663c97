//! What a series is asked for: which points, which times, and how its light is computed.

use skyloom::request::{Request, RequestError};
use skyloom::scene::Scene;

use crate::config::Limits;
use crate::problem::{FieldProblem, field_problems};
use crate::span::{Span, number};
use crate::textures;

/// Parameters of the series itself.
const OWN: [&str; 4] = ["at", "from", "to", "every"];
/// Those of the irradiance that are taken too.
const TAKEN: [&str; 4] = ["tolerance", "transport", "wavelength", "peak"];
/// Farthest point, m, as of an `eye`.
const FARTHEST_M: f64 = 1e7;

/// A valid query.
#[derive(Debug)]
pub(super) struct Wanted {
    /// Metres east and north of the domain's middle; at least one.
    pub(super) points: Vec<[f64; 2]>,
    pub(super) times: Span,
    /// Of the irradiance at the first time.
    pub(super) request: Request,
}

/// Reads a query and gives every error in it.
pub(super) fn read(query: &[(String, String)], scene: &Scene, limits: &Limits) -> Result<Wanted, Vec<FieldProblem>> {
    let mut errors = Vec::new();
    let mut wrong = |name: &str, detail: String| errors.push(FieldProblem { pointer: name.to_owned(), detail });
    let mut passed_on = Vec::new();
    for (i, (name, value)) in query.iter().enumerate() {
        if !OWN.contains(&name.as_str()) && !TAKEN.contains(&name.as_str()) {
            let known: Vec<_> = OWN.into_iter().chain(TAKEN).collect();
            wrong(name, format!("unknown parameter; there are {}", known.join(", ")));
        } else if name != "at" && query[..i].iter().any(|(earlier, _)| earlier == name) {
            wrong(name, "given more than once; at alone may be repeated".to_owned());
        } else if TAKEN.contains(&name.as_str()) {
            passed_on.push((name.clone(), value.clone()));
        }
    }
    let given =
        |wanted: &'static str| query.iter().filter(move |(name, _)| name == wanted).map(|(_, value)| value.as_str());
    let mut points = Vec::new();
    for text in given("at") {
        match point(text) {
            Some(point) => points.push(point),
            None => wrong(
                "at",
                format!("\"{text}\" is not allowed; allowed: X,Y, each -1e7 to 1e7 metres from the domain's middle"),
            ),
        }
    }
    if given("at").next().is_none() {
        wrong(
            "at",
            "is missing: X,Y in metres east and north of the domain's middle; repeat it for several points".to_owned(),
        );
    }
    let times = Span::read(query, scene, &mut errors);
    let mut wrong = |name: &str, detail: String| errors.push(FieldProblem { pointer: name.to_owned(), detail });
    let count = times.count;
    let values = count.saturating_mul(points.len() as u64);
    if values > limits.series_values {
        let detail = format!(
            "{count} times at {} points are {values}; this server allows {} (limits.series_values): a longer step, a shorter \
             time, or fewer points",
            points.len(),
            limits.series_values
        );
        wrong("every", detail);
    }
    // The part that `peak` touches.
    let own = [("time", times.from_s.to_string()), ("component", "direct".to_owned())];
    passed_on.extend(own.map(|(name, value)| (name.to_owned(), value)));
    // No map is made, so that its size matters to nobody.
    let limits = Limits { max_side: Scene::MAX_SIDE, ..limits.clone() };
    let request = match Request::parse("irradiance", "f32", &passed_on) {
        Ok(request) => textures::fitted(scene, &request, &limits),
        Err(RequestError::Invalid(found)) => Err(field_problems(found)),
        Err(other) => Err(vec![FieldProblem { pointer: "at".to_owned(), detail: other.to_string() }]),
    };
    match request {
        Ok(request) if errors.is_empty() => Ok(Wanted { points, times, request }),
        Ok(_) => Err(errors),
        Err(found) => {
            errors.extend(found);
            Err(errors)
        }
    }
}

fn point(text: &str) -> Option<[f64; 2]> {
    let (east, north) = text.split_once(',')?;
    Some([number(east, -FARTHEST_M, FARTHEST_M)?, number(north, -FARTHEST_M, FARTHEST_M)?])
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    fn asked(scene: &str, query: &[(&str, &str)]) -> Result<Wanted, Vec<String>> {
        let query: Vec<_> = query.iter().map(|&(name, value)| (name.to_owned(), value.to_owned())).collect();
        let limits = Limits { series_values: 1441, ..Limits::default() };
        let scene = Scene::from_json(scene.as_bytes()).unwrap();
        read(&query, &scene, &limits).map_err(|errors| errors.into_iter().map(|error| error.pointer).collect())
    }

    const FIXED: &str = "{}";
    const OVER: &str = r#"{"sun": {"latitude_deg": 50, "longitude_deg": 8, "utc": "2026-06-21T00:00:00Z"}}"#;

    #[test]
    fn times_are_counted_with_both_ends() {
        for (from, to, every, count) in [
            ("0", "86400", "60", 1441),
            ("0", "0", "1", 1),
            ("5", "6", "0.1", 11),
            ("0", "59.9", "60", 1),
            ("0", "1e-3", "0.001", 2),
        ] {
            let wanted = asked(FIXED, &[("at", "0,0"), ("from", from), ("to", to), ("every", every)]).unwrap();
            assert_eq!(wanted.times.count, count, "{from} {to} {every}");
        }
        let day = asked(
            OVER,
            &[
                ("at", "-5,1e3"),
                ("from", "2026-06-21T04:00:00%2B02:00".replace("%2B", "+").as_str()),
                ("to", "2026-06-21T03:00:00.5Z"),
            ],
        );
        let day = day.unwrap();
        assert_eq!((day.times.time_s(0), day.times.time_s(60), day.times.count), (7200.0, 10_800.0, 61));
        assert_eq!(day.points, [[-5.0, 1000.0]]);
    }

    #[test]
    fn whatever_is_wrong_is_named() {
        for (query, wrong) in [
            (&[][..], &["at"][..]),
            (&[("at", "1"), ("at", "1,2,3"), ("at", "nan,0"), ("at", "1e8,0")], &["at"; 4]),
            (
                &[("at", "0,0"), ("from", "-1"), ("to", "2026-06-21T00:00:00Z"), ("every", "0")],
                &["from", "to", "every"],
            ),
            (&[("at", "0,0"), ("from", "10"), ("to", "9")], &["to"]),
            (&[("at", "0,0"), ("to", "86400"), ("every", "59")], &["every"]),
            (&[("at", "0,0"), ("at", "0,1"), ("to", "86400")], &["every"]),
            (&[("at", "0,0"), ("to", "1e9"), ("every", "0.001")], &["every"]),
            (&[("at", "0,0"), ("size", "8"), ("to", "1"), ("to", "2")], &["size", "to"]),
            (&[("at", "0,0"), ("tolerance", "2"), ("wavelength", "20")], &["tolerance", "wavelength"]),
        ] {
            assert_eq!(asked(FIXED, query).unwrap_err(), wrong, "{query:?}");
        }
        assert_eq!(asked(OVER, &[("at", "0,0"), ("from", "2026-06-20T23:59:59Z")]).unwrap_err(), ["from"]);
    }
}
