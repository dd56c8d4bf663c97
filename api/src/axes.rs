//! The frame of an engine in which a JSON answer tells its directions.

use crate::problem::{ApiError, FieldProblem};
use skyloom::axes::Axes;

/// Takes `axes` out of a query, so that what is rendered for the answer is the same in every frame; east, north, up if none is
/// given.
pub(crate) fn taken_from(query: &mut Vec<(String, String)>) -> Result<Axes, ApiError> {
    let wrong = |detail| ApiError::InvalidQuery(vec![FieldProblem { pointer: "axes".to_owned(), detail }]);
    let given: Vec<String> = query.extract_if(.., |(name, _)| name == "axes").map(|(_, text)| text).collect();
    match given.as_slice() {
        [] => Ok(Axes::Enu),
        [text] => {
            let not_allowed = || wrong(format!("\"{text}\" is not allowed; allowed: {}", Axes::WORDS));
            Axes::named(text).ok_or_else(not_allowed)
        }
        _ => Err(wrong("given more than once".to_owned())),
    }
}

/// Its name and where its axes point.
pub(crate) fn in_words(axes: Axes) -> String {
    format!("{}: {}", axes.name(), axes.in_words())
}
