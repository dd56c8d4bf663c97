//! A texture as the bytes of a file that says what it is.

use crate::axes::Axes;
use crate::encode::{self, Encoded, Frame, Metadata, Pixels, Place, Target, Written};
use crate::illumination::Illumination;
use crate::job::{Job, RenderError, Texture};
use crate::plan::expected_error;
use crate::request::{Side, SphereLayout, Viewer, Wanted};
use crate::version::VERSION;

/// The file of a rendered texture, in the format that its request names.
///
/// # Errors
/// [`RenderError::Invalid`] where the file cannot hold the values; a texel that is not finite would be a fault of the
/// renderer.
pub fn encode(texture: &Texture, job: &Job) -> Result<Encoded, RenderError> {
    let pixels = pixels(texture, job);
    Ok(encode::encode(&pixels, &metadata(job, texture), &job.request().output, texture.white)?)
}

/// Writes the file of [`encode`] band by band.
///
/// # Errors
/// Those of [`encode`]; [`RenderError::Encode`] where it cannot be written.
pub fn encode_to(texture: &Texture, job: &Job, file: &mut dyn Target) -> Result<Written, RenderError> {
    let pixels = pixels(texture, job);
    Ok(encode::encode_to(&pixels, &metadata(job, texture), &job.request().output, texture.white, file)?)
}

fn pixels<'a>(texture: &'a Texture, job: &Job) -> Pixels<'a> {
    let request = job.request();
    Pixels {
        width: texture.width,
        height: texture.height,
        channels: texture.channels,
        data: &texture.data,
        errors: texture.standard_error.as_deref(),
        layers: &texture.layers,
        alpha: request.output.linear().alpha,
        // What lies outside 0 to 1 is noise.
        fraction: matches!(request.wanted, Wanted::Shadow(_)),
    }
}

/// What a file says of itself besides its texels.
fn metadata(job: &Job, texture: &Texture) -> Metadata {
    let (scene, request) = (job.scene(), job.request());
    let (wanted, in_air) = (&request.wanted, job.air().is_some());
    let scale = request.output.linear().scale;
    let plane = wanted.plane();
    let sphere = wanted.sphere();
    let axes = sphere.map_or(Axes::Enu, |sphere| sphere.axes);
    let equirect = sphere.is_some_and(|sphere| sphere.layout == SphereLayout::Equirect);
    let (direction, eye) = match plane.map(|plane| plane.viewer) {
        None => (None, sphere.map(|sphere| axes.of(sphere.eye))),
        Some(Viewer::At(place)) => (None, Some(place)),
        Some(Viewer::Parallel { zenith_deg, azimuth_deg }) => (Some([zenith_deg, azimuth_deg]), None),
    };
    Metadata {
        texture: request.texture().name().to_owned(),
        comments: request.texture().meaning().to_owned(),
        unit: wanted.unit(in_air).to_owned(),
        scale,
        component: wanted.component().map(|component| component.name().to_owned()),
        peak: wanted.peak(),
        view: plane.map(|plane| plane.side.name().to_owned()),
        direction,
        eye,
        projection: Some(wanted.projection().map_or("plane", |projection| projection.name()).to_owned()),
        layer: wanted.layer(),
        expected_error: Some(expected_error(&job.plan().explain(scene, request))),
        domain_extent_m: scene.extent_m(),
        origin: axes.of([0.0, 0.0, texture.plane_m]),
        sun_direction: axes.of(job.illumination().towards_sun),
        base_height_m: texture.base_m,
        time_s: request.time_s,
        axes: Frame {
            name: axes.name().to_owned(),
            words: axes.in_words(),
            up: axes.up_axis().to_owned(),
            handedness: axes.handedness().to_owned(),
        },
        left_azimuth_deg: equirect.then(|| axes.left_azimuth_deg()),
        disc: wanted.disc(),
        wavelength_nm: wanted.wavelength_nm(),
        scene: job.scene_id().to_owned(),
        version: VERSION.clone(),
        // Of radiance; an irradiance has none.
        white_luminance: (in_air
            && wanted.wavelength_nm().is_none()
            && matches!(wanted, Wanted::Cloud(_) | Wanted::Sky(_)))
        .then(|| (1000.0 / scale) as f32),
        // Maps repeat as the domain does.
        periodic: wanted.projection().is_none_or(|projection| projection.is_periodic()),
        place: place(job),
    }
}

/// Where and when on Earth, as far as OpenEXR can tell it: to the second.
fn place(job: &Job) -> Option<Place> {
    let (place, utc) = Illumination::place(job.scene(), job.request().time_s)?;
    // Of `YYYY-MM-DDThh:mm:ss` and what may follow.
    let utc: String = utc.ok()?.to_string().chars().take(19).collect();
    Some(Place {
        latitude_deg: place.latitude_deg(),
        longitude_deg: place.longitude_deg(),
        altitude_m: place.altitude_m(),
        utc: utc.replace('-', ":").replace('T', " "),
    })
}

/// Whether a viewer at a place can see the plane that texels lie in; the error names the place.
pub(super) fn check_eye(job: &Job, plane_of: impl Fn(Side) -> f64) -> Result<(), RenderError> {
    let Some(plane) = job.request().wanted.plane() else { return Ok(()) };
    let Viewer::At(place) = plane.viewer else { return Ok(()) };
    let plane_m = plane_of(plane.side);
    let (wrong_side, where_to) = match plane.side {
        Side::Below => (place[2] >= plane_m, "below the cloud base"),
        Side::Above => (place[2] <= plane_m, "above the highest cloud top"),
    };
    if wrong_side {
        let detail = format!("z = {} m is not {where_to}, {plane_m} m", place[2]);
        return Err(RenderError::Invalid(vec![crate::scene::FieldError { pointer: "eye".to_owned(), detail }]));
    }
    Ok(())
}
