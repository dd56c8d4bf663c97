//! The viewer page at `/`: its files are built into the program, nothing is loaded from elsewhere.

use std::sync::Arc;

use axum::Router;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use axum::routing::get;

use crate::app::App;

/// Only this server's own files; pictures also from memory.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
                      connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

pub(crate) const HTML: &str = "text/html; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// The parts of the script, which the browser loads as modules.
const MODULES: [(&str, &str); 18] = [
    ("/viewer/alive.js", include_str!("../ui/viewer/alive.js")),
    ("/viewer/angles.js", include_str!("../ui/viewer/angles.js")),
    ("/viewer/ask.js", include_str!("../ui/viewer/ask.js")),
    ("/viewer/dome.js", include_str!("../ui/viewer/dome.js")),
    ("/viewer/form.js", include_str!("../ui/viewer/form.js")),
    ("/viewer/gl.js", include_str!("../ui/viewer/gl.js")),
    ("/viewer/ground.js", include_str!("../ui/viewer/ground.js")),
    ("/viewer/hands.js", include_str!("../ui/viewer/hands.js")),
    ("/viewer/light.js", include_str!("../ui/viewer/light.js")),
    ("/viewer/load.js", include_str!("../ui/viewer/load.js")),
    ("/viewer/maps.js", include_str!("../ui/viewer/maps.js")),
    ("/viewer/paint.js", include_str!("../ui/viewer/paint.js")),
    ("/viewer/panels.js", include_str!("../ui/viewer/panels.js")),
    ("/viewer/play.js", include_str!("../ui/viewer/play.js")),
    ("/viewer/scene.js", include_str!("../ui/viewer/scene.js")),
    ("/viewer/state.js", include_str!("../ui/viewer/state.js")),
    ("/viewer/tradeoff.js", include_str!("../ui/viewer/tradeoff.js")),
    ("/viewer/wrong.js", include_str!("../ui/viewer/wrong.js")),
];

/// Routes of the page, its scripts and its style.
pub fn routes() -> Router<Arc<App>> {
    let page = Router::new()
        .route("/", get(async || file(HTML, include_str!("../ui/index.html"))))
        .route("/viewer.css", get(async || file("text/css; charset=utf-8", include_str!("../ui/viewer.css"))))
        .route("/viewer.js", get(async || file(SCRIPT, include_str!("../ui/viewer.js"))));
    MODULES.iter().fold(page, |page, (path, text)| page.route(path, get(async || file(SCRIPT, *text))))
}

/// A file of a page.
pub(crate) fn file(media_type: &'static str, text: impl IntoResponse) -> Response {
    let headers = [
        (header::CONTENT_TYPE, media_type),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-cache"),
    ];
    (headers, text).into_response()
}
