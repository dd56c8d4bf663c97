//! What can be called, and what each call answers.

use serde_json::Value;

use super::parameters;

/// A call.
pub(super) struct Operation {
    pub(super) method: &'static str,
    pub(super) path: &'static str,
    pub(super) id: &'static str,
    pub(super) tag: &'static str,
    pub(super) summary: &'static str,
    pub(super) query: fn() -> Vec<Value>,
    pub(super) body: Body,
    /// Statuses, what they mean, what comes with them.
    pub(super) answers: &'static [(u16, &'static str, Content)],
    /// Kinds of problems by their slugs.
    pub(super) problems: &'static [&'static [&'static str]],
}

/// What is sent.
#[derive(Clone, Copy)]
pub(super) enum Body {
    None,
    /// JSON of a named schema.
    Json(&'static str),
    Image,
}

/// What is answered.
#[derive(Clone, Copy)]
pub(super) enum Content {
    None,
    /// JSON of a named schema.
    Json(&'static str),
    /// Something of these media types.
    Media(&'static [&'static str]),
    /// A file in the format that was asked for.
    Texture,
}

/// Whoever asks may have to show a key.
const ASK: &[&str] = &["no-key", "forbidden"];
/// A part of the path may be no text in UTF-8.
const PATH: &[&str] = &["other"];
const QUERY: &[&str] = &["invalid-query"];
const STORE: &[&str] = &["store-failed"];
const KEEP: &[&str] = &["store-full", "store-failed"];
const SKY: &[&str] = &["unknown-sky", "store-failed"];
const JOB: &[&str] = &["unknown-job", "store-failed"];
const BODY: &[&str] =
    &["unreadable", "slow-body", "too-large", "unsupported-media-type", "unsupported-content-coding", "crowded"];
const RENDER: &[&str] =
    &["invalid-query", "lost-image", "not-ready", "busy", "crowded", "deadline", "store-full", "store-failed"];
const STREAM: &[&str] = &["too-many-streams"];

const CSV: &[&str] = &["text/csv"];
const EVENTS: &[&str] = &["text/event-stream"];
const ZIP: &[&str] = &["application/zip"];
const BUNDLE: &[&str] = &["application/zip", "image/x-exr"];
const PLAIN: &[&str] = &["text/plain"];
const HTML: &[&str] = &["text/html"];
const SCHEMA: &[&str] = &["application/schema+json"];

const fn get(path: &'static str, id: &'static str, tag: &'static str, summary: &'static str) -> Operation {
    Operation {
        method: "get",
        path,
        id,
        tag,
        summary,
        query: parameters::none,
        body: Body::None,
        answers: &[],
        problems: &[],
    }
}

/// Every call but the files of the viewer.
pub(super) const OPERATIONS: &[Operation] = &[
    Operation {
        query: parameters::page,
        answers: &[(200, "names of skies, in pages", Content::Json("sky_list"))],
        problems: &[ASK, QUERY, STORE],
        ..get("/v1/skies", "listSkies", "skies", "The skies that are registered")
    },
    Operation {
        method: "post",
        body: Body::Json("scene"),
        answers: &[
            (200, "the sky was registered before", Content::Json("sky")),
            (201, "the sky is registered", Content::Json("sky")),
        ],
        problems: &[ASK, BODY, &["invalid-scene", "lost-image"], KEEP],
        ..get("/v1/skies", "registerSky", "skies", "Registers a scene; its id is a hash of it")
    },
    Operation {
        answers: &[(
            200,
            "the scene with every default spelled out, and the state of its tables",
            Content::Json("sky"),
        )],
        problems: &[ASK, PATH, SKY],
        ..get("/v1/skies/{id}", "showSky", "skies", "A sky")
    },
    Operation {
        method: "delete",
        answers: &[(204, "it is gone", Content::None)],
        problems: &[ASK, PATH, SKY, KEEP],
        ..get("/v1/skies/{id}", "removeSky", "skies", "Removes a sky")
    },
    Operation {
        query: parameters::plan,
        answers: &[(200, "the methods, and the error expected of each", Content::Json("plan"))],
        problems: &[ASK, PATH, SKY, QUERY],
        ..get("/v1/skies/{id}/plan", "planTexture", "textures", "What a texture would be made with")
    },
    Operation {
        query: parameters::sun,
        answers: &[(200, "where it stands and what light it gives", Content::Json("sun"))],
        problems: &[ASK, PATH, SKY, RENDER],
        ..get("/v1/skies/{id}/sun.json", "sun", "light", "The sun at a time")
    },
    Operation {
        query: parameters::ambient,
        answers: &[(200, "nine real spherical harmonics a colour", Content::Json("ambient"))],
        problems: &[ASK, PATH, SKY, RENDER],
        ..get("/v1/skies/{id}/ambient.json", "ambient", "light", "The light of sky and ground around an eye")
    },
    Operation {
        query: parameters::frames,
        answers: &[(200, "server-sent events with links to textures", Content::Media(EVENTS))],
        problems: &[ASK, PATH, SKY, QUERY, STREAM],
        ..get("/v1/skies/{id}/frames", "frames", "light", "Links to textures by the clock")
    },
    Operation {
        query: parameters::film,
        answers: &[(200, "an archive of numbered files, as they are made", Content::Media(ZIP))],
        problems: &[ASK, PATH, SKY, RENDER, STREAM],
        ..get("/v1/skies/{id}/frames.zip", "film", "textures", "A texture at one time after another")
    },
    Operation {
        query: parameters::points,
        answers: &[(200, "a row a time, as it is computed", Content::Json("points"))],
        problems: &[ASK, PATH, SKY, RENDER, STREAM],
        ..get("/v1/skies/{id}/point.json", "pointsJson", "light", "Light at points of the ground over a time")
    },
    Operation {
        query: parameters::points,
        answers: &[(200, "a line for each time and point", Content::Media(CSV))],
        problems: &[ASK, PATH, SKY, RENDER, STREAM],
        ..get("/v1/skies/{id}/point.csv", "pointsCsv", "light", "The same as a table")
    },
    Operation {
        query: parameters::texture,
        answers: &[(200, "the texture", Content::Texture), (304, "it is the one that is known", Content::None)],
        problems: &[ASK, PATH, SKY, &["unknown-texture"], RENDER],
        ..get("/v1/skies/{id}/{texture}.{format}", "texture", "textures", "A texture")
    },
    Operation {
        query: parameters::page,
        answers: &[(200, "names of images, in pages", Content::Json("image_list"))],
        problems: &[ASK, QUERY, STORE],
        ..get("/v1/images", "listImages", "images", "The images that are kept")
    },
    Operation {
        method: "post",
        body: Body::Image,
        answers: &[
            (200, "the image was there", Content::Json("image")),
            (201, "the image is kept", Content::Json("image")),
        ],
        problems: &[ASK, BODY, KEEP],
        ..get("/v1/images", "storeImage", "images", "Keeps an image, PNG or OpenEXR; its name is its SHA-256")
    },
    Operation {
        method: "delete",
        answers: &[(204, "it is gone", Content::None)],
        problems: &[ASK, PATH, &["unknown-image", "conflict"], KEEP],
        ..get("/v1/images/{id}", "removeImage", "images", "Removes an image that no sky and no job names")
    },
    Operation {
        method: "post",
        body: Body::Json("render"),
        answers: &[(200, "an archive, or an OpenEXR file of several parts", Content::Media(BUNDLE))],
        problems: &[ASK, BODY, &["invalid-render", "invalid-scene"], RENDER],
        ..get("/v1/render", "render", "textures", "Several textures of a scene that is not registered")
    },
    Operation {
        answers: &[(200, "scenes to start from", Content::Json("presets"))],
        problems: &[ASK],
        ..get("/v1/presets", "presets", "service", "Scenes that come with the program")
    },
    Operation {
        answers: &[(200, "limits in force, and the textures", Content::Json("limits"))],
        problems: &[ASK],
        ..get("/v1/limits", "limits", "service", "What this server allows")
    },
    Operation {
        answers: &[(200, "all jobs, without their scenes", Content::Json("job_list"))],
        problems: &[ASK],
        ..get("/v1/jobs", "listJobs", "jobs", "All jobs")
    },
    Operation {
        method: "post",
        body: Body::Json("job_order"),
        answers: &[
            (200, "exactly this job was there", Content::Json("job")),
            (201, "the job is at work", Content::Json("job")),
        ],
        problems: &[ASK, BODY, &["invalid-job", "lost-image", "conflict"], KEEP],
        ..get("/v1/jobs", "giveJob", "jobs", "Gives a job: frames made by the clock and kept")
    },
    Operation {
        answers: &[(200, "the job, with its progress", Content::Json("job"))],
        problems: &[ASK, PATH, JOB],
        ..get("/v1/jobs/{id}", "showJob", "jobs", "A job")
    },
    Operation {
        method: "patch",
        body: Body::Json("job_change"),
        answers: &[(200, "the job as it is now", Content::Json("job"))],
        problems: &[ASK, PATH, BODY, JOB, &["invalid-job", "conflict"], KEEP],
        ..get("/v1/jobs/{id}", "changeJob", "jobs", "Changes a job; its frames stay")
    },
    Operation {
        method: "delete",
        answers: &[(204, "it is gone with its frames", Content::None)],
        problems: &[ASK, PATH, JOB, &["conflict"], KEEP],
        ..get("/v1/jobs/{id}", "removeJob", "jobs", "Removes a job and its frames")
    },
    Operation {
        answers: &[
            (200, "the newest frame that is due", Content::Json("frame")),
            (304, "it is the one that is known", Content::None),
        ],
        problems: &[ASK, PATH, JOB],
        ..get("/v1/jobs/{id}/latest.json", "latest", "jobs", "The newest frame of a job")
    },
    Operation {
        answers: &[
            (200, "all frames by time", Content::Json("manifest")),
            (304, "it is the one that is known", Content::None),
        ],
        problems: &[ASK, PATH, JOB],
        ..get("/v1/jobs/{id}/manifest.json", "manifest", "jobs", "The frames of a job")
    },
    Operation {
        answers: &[(200, "a file of the frame", Content::Texture), (304, "it is the one that is known", Content::None)],
        problems: &[ASK, PATH, JOB],
        ..get("/v1/jobs/{id}/frames/{time}/{file}", "frame", "jobs", "A file of a frame")
    },
    Operation {
        answers: &[(200, "this document", Content::Json("any"))],
        ..get("/openapi.json", "description", "service", "This document")
    },
    Operation {
        answers: &[(200, "this document", Content::Json("any"))],
        problems: &[ASK],
        ..get("/v1/openapi.json", "descriptionOfVersion", "service", "This document, beside what it describes")
    },
    Operation {
        answers: &[(200, "a JSON Schema, draft 2020-12", Content::Media(SCHEMA))],
        problems: &[ASK],
        ..get("/v1/schema/scene.json", "sceneSchema", "service", "The schema of scenes")
    },
    Operation {
        answers: &[(200, "in the text format of Prometheus", Content::Media(PLAIN))],
        problems: &[ASK],
        ..get("/metrics", "metrics", "service", "What is measured")
    },
    Operation {
        answers: &[(200, "the server is there", Content::Json("alive"))],
        ..get("/health", "health", "service", "Whether the server is there")
    },
    Operation {
        answers: &[(200, "the server is there", Content::Json("alive"))],
        ..get("/health/live", "live", "service", "Whether the server is there")
    },
    Operation {
        answers: &[(200, "it renders and keeps", Content::Json("ready"))],
        problems: &[&["not-ready", "store-failed"]],
        ..get("/health/ready", "ready", "service", "Whether a render asked for now would begin")
    },
    Operation {
        answers: &[(200, "what it means and what helps", Content::Media(PLAIN))],
        problems: &[PATH, &["no-such-route"]],
        ..get("/problems/{slug}", "explain", "service", "What the type of a problem means")
    },
    Operation { answers: &[(200, "the page", Content::Media(HTML))], ..get("/", "viewer", "service", "The viewer") },
];
