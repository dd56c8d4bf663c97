//! What a film is asked for: which texture, seen how, at which times, from which frame on.

use skyloom::request::{QUERY_PARAMETERS, Request, RequestError};
use skyloom::scene::Scene;

use crate::config::Limits;
use crate::problem::{FieldProblem, field_problems};
use crate::span::{PARAMETERS, Span};
use crate::textures;

/// Parameters of the film beside its times; all others go to the texture.
const OWN: [&str; 2] = ["texture", "skip"];
/// Digits of a frame's number at least.
const DIGITS: usize = 5;

/// A valid query.
#[derive(Debug)]
pub(super) struct Wanted {
    pub(super) times: Span,
    /// The first frame that is sent; below the count.
    pub(super) skip: u64,
    /// At the first time.
    pub(super) request: Request,
}

impl Wanted {
    /// The file of a frame: the same whichever frame a film begins with.
    pub(super) fn name(&self, frame: u64) -> String {
        let digits = DIGITS.max((self.times.count - 1).to_string().len());
        let (texture, format) = (self.request.texture().name(), self.request.format().extension());
        format!("{texture}-{frame:0digits$}.{format}")
    }
}

/// Reads a query and gives every error in it.
pub(super) fn read(query: &[(String, String)], scene: &Scene, limits: &Limits) -> Result<Wanted, Vec<FieldProblem>> {
    let mut errors = Vec::new();
    let mut wrong = |name: &str, detail: String| errors.push(FieldProblem { pointer: name.to_owned(), detail });
    let mut passed_on = Vec::new();
    let of_texture = || QUERY_PARAMETERS.iter().map(|parameter| parameter.name).filter(|name| *name != "time");
    for (i, (name, value)) in query.iter().enumerate() {
        let own = OWN.iter().chain(&PARAMETERS).any(|own| own == name);
        if name == "time" {
            wrong(name, "frames have their times by from, to and every".to_owned());
        } else if !own && !of_texture().any(|known| known == name) {
            let known: Vec<_> = OWN.into_iter().chain(PARAMETERS).chain(of_texture()).collect();
            wrong(name, format!("unknown parameter; there are {}", known.join(", ")));
        } else if query[..i].iter().any(|(earlier, _)| earlier == name) {
            wrong(name, "given more than once".to_owned());
        } else if !own {
            passed_on.push((name.clone(), value.clone()));
        }
    }
    let times = Span::read(query, scene, &mut errors);
    let mut wrong = |name: &str, detail: String| errors.push(FieldProblem { pointer: name.to_owned(), detail });
    if times.count > limits.film_frames {
        let (count, most) = (times.count, limits.film_frames);
        wrong(
            "every",
            format!("{count} frames; this server allows {most} (limits.film_frames): a longer step, or a shorter time"),
        );
    }
    let given = |wanted: &str| query.iter().find(|(name, _)| name == wanted).map(|(_, value)| value.as_str());
    let skip = given("skip").map_or(Some(0), |text| text.parse().ok().filter(|skip| *skip < times.count));
    if skip.is_none() {
        let last = times.count - 1;
        wrong(
            "skip",
            format!(
                "\"{}\" is not allowed; allowed: 0 to {last}, a frame of the film",
                given("skip").unwrap_or_default()
            ),
        );
    }
    let file = given("texture").unwrap_or("cloud.exr");
    let request = match file.rsplit_once('.').map(|(texture, format)| Request::parse(texture, format, &passed_on)) {
        None => {
            wrong("texture", format!("{file:?} names no texture: it is {{texture}}.{{format}}"));
            None
        }
        Some(Ok(request)) => {
            let first = Request { time_s: times.from_s, ..request };
            textures::fitted(scene, &first, limits).map_err(|found| errors.extend(found)).ok()
        }
        Some(Err(RequestError::Invalid(found))) => {
            errors.extend(field_problems(found));
            None
        }
        Some(Err(unknown)) => {
            wrong("texture", unknown.to_string());
            None
        }
    };
    match (skip, request) {
        (Some(skip), Some(request)) if errors.is_empty() => Ok(Wanted { times, skip, request }),
        _ => Err(errors),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    fn asked(query: &[(&str, &str)]) -> Result<Wanted, Vec<String>> {
        let query: Vec<_> = query.iter().map(|&(name, value)| (name.to_owned(), value.to_owned())).collect();
        let limits = Limits { film_frames: 100, ..Limits::default() };
        let scene = Scene::from_json(b"{}").unwrap();
        read(&query, &scene, &limits).map_err(|errors| errors.into_iter().map(|error| error.pointer).collect())
    }

    #[test]
    fn frames_keep_their_names_wherever_a_film_begins() {
        let film =
            asked(&[("from", "5"), ("to", "104"), ("every", "1"), ("texture", "shadow.png"), ("skip", "99")]).unwrap();
        assert_eq!((film.times.count, film.skip, film.times.time_s(99)), (100, 99, 104.0));
        assert_eq!((film.name(7), film.request.time_s), ("shadow-00007.png".to_owned(), 5.0));
        let one = asked(&[]).unwrap();
        assert_eq!((one.times.count, one.name(0).as_str()), (1, "cloud-00000.exr"));
    }

    #[test]
    fn whatever_is_wrong_is_named() {
        for (query, wrong) in [
            (&[("texture", "cloud")][..], &["texture"][..]),
            (&[("texture", "clouds.exr")], &["texture"]),
            (&[("texture", "cloud.bmp")], &["texture"]),
            (&[("to", "100"), ("every", "1")], &["every"]),
            (&[("to", "10"), ("every", "1"), ("skip", "11")], &["skip"]),
            (&[("skip", "-1")], &["skip"]),
            (&[("time", "1"), ("size", "8"), ("size", "9"), ("frames", "3")], &["time", "size", "frames"]),
            (&[("from", "2"), ("to", "1"), ("size", "0")], &["to", "size"]),
            (&[("layer", "2")], &["layer"]),
        ] {
            assert_eq!(asked(query).unwrap_err(), wrong, "{query:?}");
        }
    }
}
