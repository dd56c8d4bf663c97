//! What a file tells of itself besides its texels.

/// What a reader of the texture has to know besides its texels. Words are those of the query that made it; what does not
/// apply to a texture is `None`.
#[derive(Clone, Debug, PartialEq)]
pub struct Metadata {
    /// Name of the texture, such as `cloud`.
    pub texture: String,
    /// What the values mean, for people; left out when empty.
    pub comments: String,
    /// Unit of the values divided by `scale`, such as `klx`, `m`, or `1` for a part of a whole.
    pub unit: String,
    /// What all channels but alpha were multiplied by.
    pub scale: f64,
    /// Part of an irradiance.
    pub component: Option<String>,
    /// Whether light scattered by less than 5 degrees counts as the sun's beam.
    pub peak: Option<bool>,
    /// Side from which clouds are seen.
    pub view: Option<String>,
    /// Of a parallel view, the zenith angle and azimuth towards the viewer, degrees.
    pub direction: Option<[f64; 2]>,
    /// Of a perspective view, the viewer's place in the texture's axes, metres.
    pub eye: Option<[f64; 3]>,
    /// How directions or places become texels: `plane` for maps and views of a plane.
    pub projection: Option<String>,
    /// The one layer that is shown, 0 = lowest; all when `None`.
    pub layer: Option<u32>,
    /// Relative error, root mean square, that the methods are expected to have.
    pub expected_error: Option<f64>,
    /// Side of the square domain that the scene covers, in metres.
    pub domain_extent_m: f64,
    /// Centre of the domain in the texture's axes, in metres.
    pub origin: [f64; 3],
    /// Unit vector towards the true sun in the texture's axes (`enu`: east, north, up).
    pub sun_direction: [f64; 3],
    /// Height of the lowest cloud base, in metres.
    pub base_height_m: f64,
    /// Seconds since the scene's start.
    pub time_s: f64,
    /// The axes that directions and places are told in.
    pub axes: Frame,
    /// Of an equirectangular picture, the azimuth of its left edge, degrees clockwise from north.
    pub left_azimuth_deg: Option<f64>,
    /// Whether the sun's disc is drawn, where it could be.
    pub disc: Option<bool>,
    /// The one wavelength of the light, nm; `None` of colours and of what is no light.
    pub wavelength_nm: Option<f64>,
    /// Identifier of the scene.
    pub scene: String,
    /// Version of the renderer.
    pub version: String,
    /// Luminance of the colour (1, 1, 1) in cd/m2: 1000 for radiance in kcd/m2; `None` for values that are not radiance
    /// in a physical unit.
    pub white_luminance: Option<f32>,
    /// Whether the texture repeats beyond its edges, as a map or a parallel view of the periodic domain does.
    pub periodic: bool,
    /// Where and when on Earth, if the scene says so.
    pub place: Option<Place>,
}

impl Metadata {
    /// What formats without attributes of numbers tell: names in alphabetical order, and their values in words. Units and meanings
    /// are those of the attributes of an OpenEXR file.
    pub(super) fn in_words(&self) -> Vec<(&'static str, String)> {
        let vector = |[x, y, z]: [f64; 3]| format!("{} {} {}", x as f32 + 0.0, y as f32 + 0.0, z as f32 + 0.0);
        let number = |value: f64| (value as f32).to_string();
        let list = [
            ("axes", Some(self.axes.name.clone())),
            ("baseHeight", Some(number(self.base_height_m))),
            ("component", self.component.clone()),
            ("domainExtent", Some(number(self.domain_extent_m))),
            ("eye", self.eye.map(vector)),
            ("frame", Some(self.axes.words.clone())),
            ("handedness", Some(self.axes.handedness.clone())),
            ("leftAzimuth", self.left_azimuth_deg.map(number)),
            ("origin", Some(vector(self.origin))),
            ("projection", self.projection.clone()),
            ("scale", Some(number(self.scale))),
            ("scene", Some(self.scene.clone())),
            ("sunDirection", Some(vector(self.sun_direction))),
            ("texture", Some(self.texture.clone())),
            ("timeExact", Some(self.time_s.to_string())),
            ("unit", Some(self.unit.clone())),
            ("up", Some(self.axes.up.clone())),
            ("version", Some(self.version.clone())),
            ("view", self.view.clone()),
        ];
        list.into_iter().filter_map(|(name, value)| Some((name, value?))).collect()
    }
}

/// Axes of a texture.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Their name, such as `enu`.
    pub name: String,
    /// Where they point, such as `x east, y north, z up`.
    pub words: String,
    /// The one that points up: `+y` or `+z`.
    pub up: String,
    /// `right` or `left`.
    pub handedness: String,
}

/// A place on Earth and a moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// Degrees, north positive, -90 to 90.
    pub latitude_deg: f64,
    /// Degrees, east positive, -180 to 180.
    pub longitude_deg: f64,
    /// Metres above sea level.
    pub altitude_m: f64,
    /// The moment in UTC as OpenEXR wants it: `YYYY:MM:DD hh:mm:ss`.
    pub utc: String,
}
