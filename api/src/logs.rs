//! The log: lines for people, or a JSON object a line for programs.

use std::fmt;
use std::io::IsTerminal as _;

use serde_json::{Map, Value};
use tracing::field::{Field, Visit};
use tracing::{Event, Subscriber};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::field::RecordFields;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields, FormattedFields};
use tracing_subscriber::registry::LookupSpan;

use crate::config::LogFormat;

/// Starts the log on stderr, whatever is printed on stdout. `SKYLOOM_LOG` overrides the level.
pub fn start(level: &str, format: LogFormat) {
    let default = || EnvFilter::new(format!("{level},wgpu_core=warn,wgpu_hal=error,naga=warn"));
    let filter = EnvFilter::try_from_env("SKYLOOM_LOG").unwrap_or_else(|_| default());
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    match format {
        LogFormat::Text => log.with_ansi(std::io::stderr().is_terminal()).init(),
        LogFormat::Json => log.with_ansi(false).fmt_fields(Members).event_format(Object).init(),
    }
}

/// Collects fields as members of an object.
#[derive(Default)]
struct Collect(Map<String, Value>);

impl Visit for Collect {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        self.0.insert(field.name().to_owned(), Value::String(format!("{value:?}")));
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        self.0.insert(field.name().to_owned(), Value::String(value.to_owned()));
    }

    fn record_f64(&mut self, field: &Field, value: f64) {
        self.0.insert(field.name().to_owned(), value.into());
    }

    fn record_i64(&mut self, field: &Field, value: i64) {
        self.0.insert(field.name().to_owned(), value.into());
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        self.0.insert(field.name().to_owned(), value.into());
    }

    fn record_bool(&mut self, field: &Field, value: bool) {
        self.0.insert(field.name().to_owned(), value.into());
    }
}

/// Keeps the fields of a span as the text of an object.
struct Members;

impl<'writer> FormatFields<'writer> for Members {
    fn format_fields<R: RecordFields>(&self, mut writer: Writer<'writer>, fields: R) -> fmt::Result {
        let mut members = Collect::default();
        fields.record(&mut members);
        write!(writer, "{}", Value::Object(members.0))
    }
}

/// Writes an event as an object, with the fields of the spans around it: the request's `id` first of all.
struct Object;

impl<S: Subscriber + for<'a> LookupSpan<'a>> FormatEvent<S, Members> for Object {
    fn format_event(
        &self,
        context: &FmtContext<'_, S, Members>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        let mut members = Collect::default();
        for span in context.event_scope().into_iter().flatten() {
            let extensions = span.extensions();
            let kept = extensions.get::<FormattedFields<Members>>();
            if let Some(Ok(Value::Object(own))) = kept.map(|kept| serde_json::from_str(&kept.fields)) {
                members.0.extend(own);
            }
        }
        event.record(&mut members);
        let now = time::OffsetDateTime::now_utc();
        let now = now.format(&time::format_description::well_known::Rfc3339).unwrap_or_default();
        members.0.insert("time".to_owned(), now.into());
        members.0.insert("level".to_owned(), event.metadata().level().as_str().into());
        members.0.insert("target".to_owned(), event.metadata().target().into());
        writeln!(writer, "{}", Value::Object(members.0))
    }
}
