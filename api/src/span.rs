//! Times of a series, as queries name them: from, to, a step.

use skyloom::illumination::Illumination;
use skyloom::request::Request;
use skyloom::scene::Scene;
use skyloom::sun::Utc;

use crate::problem::FieldProblem;

/// The parameters.
pub const PARAMETERS: [&str; 3] = ["from", "to", "every"];
/// Allowed steps of time.
const EVERY_S: [f64; 2] = [1e-3, Request::MAX_TIME_S];
/// Step unless another is asked for.
const DEFAULT_EVERY_S: f64 = 60.0;

/// Times with equal steps between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// The first one, s since the scene's start.
    pub from_s: f64,
    /// From one to the next.
    pub every_s: f64,
    /// How many; at least one.
    pub count: u64,
}

impl Span {
    /// A time by its number.
    pub fn time_s(&self, number: u64) -> f64 {
        self.from_s + number as f64 * self.every_s
    }

    /// Reads `from` (0), `to` (`from`) and `every` (60) and adds what is wrong to the errors.
    pub fn read(query: &[(String, String)], scene: &Scene, errors: &mut Vec<FieldProblem>) -> Self {
        let mut wrong = |name: &str, detail: String| errors.push(FieldProblem { pointer: name.to_owned(), detail });
        let given = |wanted: &str| query.iter().find(|(name, _)| name == wanted).map(|(_, value)| value.as_str());
        let most = Request::MAX_TIME_S;
        let start = Illumination::place(scene, 0.0).and_then(|(_, start)| start.ok());
        let mut moment = |name: &'static str, fallback: f64| {
            let Some(text) = given(name) else { return fallback };
            time(text, start).unwrap_or_else(|| {
                let or = if start.is_some() {
                    ", or an instant from the scene's start on (RFC 3339; a + is written %2B)"
                } else {
                    ""
                };
                wrong(
                    name,
                    format!("\"{text}\" is not allowed; allowed: 0 to {most} seconds since the scene's start{or}"),
                );
                fallback
            })
        };
        let from_s = moment("from", 0.0);
        let to_s = moment("to", from_s);
        let [least, longest] = EVERY_S;
        let every_s = match given("every") {
            None => DEFAULT_EVERY_S,
            Some(text) => number(text, least, longest).unwrap_or_else(|| {
                wrong("every", format!("\"{text}\" is not allowed; allowed: {least} to {longest} seconds"));
                DEFAULT_EVERY_S
            }),
        };
        if to_s < from_s {
            wrong("to", format!("{to_s} s is before from, {from_s} s"));
        }
        // A step that is a part of the span meets its end in spite of rounding.
        let count = (((to_s - from_s) / every_s * (1.0 + 1e-12)).floor().max(0.0) as u64).saturating_add(1);
        Self { from_s, every_s, count }
    }
}

/// A number between two ends, both included.
pub fn number(text: &str, least: f64, most: f64) -> Option<f64> {
    text.parse::<f64>().ok().filter(|number| (least..=most).contains(number)).map(|number| number + 0.0)
}

/// Seconds since the scene's start, said so or as an instant.
fn time(text: &str, start: Option<Utc>) -> Option<f64> {
    let instant = || Some(text.parse::<Utc>().ok()?.unix_s() - start?.unix_s());
    let time_s = text.parse::<f64>().ok().or_else(instant)?;
    // Instants are told to the millisecond at least; doubles of seconds since 1970 are good to less than a microsecond.
    let time_s = (time_s * 1e6).round() / 1e6;
    (0.0..=Request::MAX_TIME_S).contains(&time_s).then_some(time_s)
}
