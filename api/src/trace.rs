//! What a caller's tracing says of a request: W3C Trace Context, level 1, as far as it joins lines of the log to a trace.

use axum::http::HeaderMap;

/// The header.
const TRACEPARENT: &str = "traceparent";

/// The trace that a request belongs to, and the caller's part of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trace {
    /// 32 hexadecimal digits.
    pub trace_id: String,
    /// 16 hexadecimal digits: the span by which the caller knows this request.
    pub parent_id: String,
}

impl Trace {
    /// Of a request's headers; none where they name none, or not as the standard has it, which says that such a header is passed over.
    pub fn of(headers: &HeaderMap) -> Option<Self> {
        let mut values = headers.get_all(TRACEPARENT).iter();
        let (Some(only), None) = (values.next(), values.next()) else { return None };
        let mut fields = only.to_str().ok()?.split('-');
        let mut field = |digits: usize| {
            let text = fields.next()?;
            let is_hex = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
            (text.len() == digits && text.bytes().all(is_hex)).then_some(text)
        };
        let (version, trace_id, parent_id, _flags) = (field(2)?, field(32)?, field(16)?, field(2)?);
        // Later versions may have more fields, the present one has not; all zeros name nothing.
        let has_more = fields.next().is_some();
        let is_nothing = |id: &str| id.bytes().all(|digit| digit == b'0');
        let is_wrong =
            version == "ff" || (version == "00" && has_more) || is_nothing(trace_id) || is_nothing(parent_id);
        (!is_wrong).then(|| Self { trace_id: trace_id.to_owned(), parent_id: parent_id.to_owned() })
    }

    /// Both of its names, as lines of the log have them.
    pub fn ids(trace: Option<&Self>) -> (Option<&str>, Option<&str>) {
        trace.map_or((None, None), |trace| (Some(&trace.trace_id), Some(&trace.parent_id)))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    fn of(values: &[&str]) -> Option<Trace> {
        Trace::of(&values.iter().map(|value| (TRACEPARENT.parse().unwrap(), value.parse().unwrap())).collect())
    }

    /// The examples of the standard, and what it says is to be passed over.
    #[test]
    fn a_trace_is_read_as_the_standard_says_and_anything_else_is_none() {
        const TRACE: &str = "4bf92f3577b34da6a3ce929d0e0e4736";
        const PARENT: &str = "00f067aa0ba902b7";
        let told = Trace { trace_id: TRACE.to_owned(), parent_id: PARENT.to_owned() };
        for right in ["00-{}-{}-01", "00-{}-{}-00", "cc-{}-{}-01-what-comes-later"] {
            let value = right.replacen("{}", TRACE, 1).replacen("{}", PARENT, 1);
            assert_eq!(of(&[&value]), Some(told.clone()), "{value}");
        }
        let whole = format!("00-{TRACE}-{PARENT}-01");
        for wrong in [
            String::new(),
            "00".to_owned(),
            format!("00-{TRACE}-{PARENT}"),
            format!("00-{TRACE}-{PARENT}-01-more"),
            format!("ff-{TRACE}-{PARENT}-01"),
            format!("00-{}-{PARENT}-01", TRACE.to_uppercase()),
            format!("00-{}-{PARENT}-01", "0".repeat(32)),
            format!("00-{TRACE}-{}-01", "0".repeat(16)),
            format!("00-{}-{PARENT}-01", &TRACE[1..]),
            format!(" 00-{TRACE}-{PARENT}-0x"),
        ] {
            assert_eq!(of(&[&wrong]), None, "{wrong}");
        }
        assert_eq!(of(&[&whole, &whole]), None, "given twice");
        assert_eq!(of(&[]), None);
    }
}
