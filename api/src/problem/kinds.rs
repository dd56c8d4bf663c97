//! The kinds of problems, each with what a caller can do about it.

use axum::http::StatusCode;

/// A kind of problem, explained at `/problems/{slug}`.
#[derive(Debug)]
pub struct Kind {
    /// Last part of the problem's `type`.
    pub slug: &'static str,
    /// HTTP status.
    pub status: StatusCode,
    /// The kind in words.
    pub title: &'static str,
    /// What a caller can do about it.
    pub advice: &'static str,
}

macro_rules! kinds {
    ($($name:ident = $slug:literal, $status:ident, $title:literal, $advice:literal;)*) => {
        $(pub(super) const $name: Kind = Kind { slug: $slug, status: StatusCode::$status, title: $title, advice: $advice };)*
        /// Every kind of problem the service answers with.
        pub const KINDS: &[Kind] = &[$($name),*];
    };
}

kinds! {
    UNREADABLE = "unreadable", BAD_REQUEST, "The request cannot be read",
        "The body is not well-formed JSON in UTF-8, the image file is broken, or what was compressed is not whole. The detail \
         says where reading stopped.";
    NO_ROUTE = "no-such-route", NOT_FOUND, "No such address",
        "The routes are /v1/skies, /v1/images, /v1/jobs, /v1/render, /v1/presets, /v1/limits, /v1/schema/scene.json, /openapi.json, /metrics, /health/live, /health/ready and the viewer at /.";
    NO_SKY = "unknown-sky", NOT_FOUND, "No such sky",
        "Skies are registered with POST /v1/skies, which answers with their id and links. One that was deleted, or that the disk damaged, can be registered again.";
    NO_IMAGE = "unknown-image", NOT_FOUND, "No such image",
        "Images are named by their SHA-256; GET /v1/images lists them, and POST /v1/images answers with the name of a new one.";
    NO_TEXTURE = "unknown-texture", NOT_FOUND, "No such texture",
        "A texture's address is /v1/skies/{id}/{texture}.{format}; the links of GET /v1/skies/{id} list them.";
    NO_JOB = "unknown-job", NOT_FOUND, "No such job or frame",
        "GET /v1/jobs lists the jobs, and /v1/jobs/{id}/manifest.json the frames of one. A job that the disk damaged can be sent again; its frames stay.";
    NO_KEY = "no-key", UNAUTHORIZED, "A key is needed",
        "Send the header Authorization: Bearer KEY with a key of this server's settings (access.keys).";
    FORBIDDEN = "forbidden", FORBIDDEN, "Not allowed", "The detail says what is missing: a right of the key, or a name in access.hosts or access.cors.";
    METHOD = "method-not-allowed", METHOD_NOT_ALLOWED, "Method not allowed", "The header Allow lists the methods of this address.";
    SLOW_BODY = "slow-body", REQUEST_TIMEOUT, "The body took too long", "Send the body faster: server.least_rate, server.stall_timeout_s and server.body_timeout_s say how fast.";
    TOO_LARGE = "too-large", PAYLOAD_TOO_LARGE, "Too large", "GET /v1/limits shows the limits; they are set in skyloom.toml.";
    MEDIA_TYPE = "unsupported-media-type", UNSUPPORTED_MEDIA_TYPE, "Unsupported media type",
        "Scenes are application/json; images are PNG or OpenEXR, sent as image/png, image/x-exr or application/octet-stream.";
    CONTENT_CODING = "unsupported-content-coding", UNSUPPORTED_MEDIA_TYPE, "Unsupported compression of the body",
        "The header Accept-Encoding of the reply lists what Content-Encoding a body may have.";
    INVALID_SCENE = "invalid-scene", UNPROCESSABLE_ENTITY, "The scene is not valid",
        "Each entry of `errors` names a field by JSON pointer and says what is allowed. Nothing was stored.";
    LOST_IMAGE = "lost-image", UNPROCESSABLE_ENTITY, "An image of the scene is gone or damaged",
        "Each entry of `errors` names the scene's field and the SHA-256 of its image. Upload the same file again with POST /v1/images; the sky and its addresses stay.";
    INVALID_QUERY = "invalid-query", UNPROCESSABLE_ENTITY, "The query is not valid",
        "Each entry of `errors` names a query parameter and says what is allowed. Unknown and repeated parameters are refused.";
    INVALID_RENDER = "invalid-render", UNPROCESSABLE_ENTITY, "What to render is not valid",
        "Each entry of `errors` names a field of the document by JSON pointer and says what is allowed; of a texture the parameter comes first.";
    INVALID_JOB = "invalid-job", UNPROCESSABLE_ENTITY, "The job is not valid",
        "Each entry of `errors` names a field by JSON pointer and says what is allowed. Nothing was changed.";
    CONFLICT = "conflict", CONFLICT, "Something else is there", "The detail says what: delete it first, or choose another name.";
    INTERNAL = "internal", INTERNAL_SERVER_ERROR, "Internal error",
        "A defect of the server. Its log has the cause under the request's name, which is the problem's `instance`.";
    NOT_READY = "not-ready", SERVICE_UNAVAILABLE, "Not ready to render",
        "No graphics device is available at the moment; the detail says why. Everything but textures works; retry after the time in Retry-After.";
    BUSY = "busy", SERVICE_UNAVAILABLE, "Busy", "Too many renders are waiting, or too many of this client's while others ask too. Retry after the time in Retry-After, which is what those that wait are expected to take.";
    CROWDED = "crowded", SERVICE_UNAVAILABLE, "Too much at once",
        "The memory for what is being sent is taken: by other clients, or by other requests of this one, which may have half of it. Retry after the time in Retry-After.";
    STREAMS = "too-many-streams", SERVICE_UNAVAILABLE, "Too many streams",
        "As many streams of frames are open as limits.streams allows. Retry after the time in Retry-After, or ask for the textures by time.";
    DEADLINE = "deadline", GATEWAY_TIMEOUT, "The render took too long",
        "The picture was not finished within queue.timeout_s. Ask for a smaller `size`, retry when the server is less busy, raise \
         the limit, or use `skyloom render`, which has none.";
    STORE_FULL = "store-full", INSUFFICIENT_STORAGE, "The store is full",
        "Delete skies that are no longer needed, or raise limits.skies or limits.image_store_bytes.";
    STORE_FAILED = "store-failed", SERVICE_UNAVAILABLE, "The store cannot be used",
        "The disk or the folder of the store fails; the detail says how. What is in memory goes on, and the server recovers by itself when the disk does.";
    OTHER = "other", BAD_REQUEST, "The request was refused", "The status says why.";
}
