//! What a query says, before it is known which of it touches the texture that is asked for.

use super::texture_request::Request;
use super::wanted::{Cloud, Component, GroundLight, Irradiance, Shadow, Sky, TextureKind, Wanted};
use crate::axes::Axes;
use crate::encode::{
    Alpha, Coding, Container, Depth, Exposure, Format, Linear, Mips, Output, Packed, Picture, PictureDepth, Tonemap,
};
use crate::method::{AirMethod, CumulusMethod, Method, Reference, Transport};
use crate::projection::{Plane, Side, Sphere, SphereLayout, Viewer};
use crate::spectrum::Spectrum;

/// Where the sky is seen from unless the query says where: by a person, in the middle of the domain.
const EYE: [f64; 3] = [0.0, 0.0, 2.0];

/// Fields of view unless others are asked for.
pub(super) const CAMERA_FOV_DEG: f64 = 60.0;
pub(super) const FISHEYE_FOV_DEG: f64 = 180.0;
/// A plane picture of more is all edge.
const MAX_CAMERA_FOV_DEG: f64 = 170.0;

/// Everything that a query can say. What does not touch the texture that is asked for does not become part of the request.
pub(super) struct Given {
    pub(super) format: Format,
    pub(super) time_s: f64,
    pub(super) size: Option<u32>,
    pub(super) side: Side,
    pub(super) direction: Option<Viewer>,
    pub(super) eye: Option<[f64; 3]>,
    pub(super) layout: &'static str,
    pub(super) axes: Axes,
    pub(super) disc: bool,
    pub(super) spectrum: Spectrum,
    pub(super) look_deg: [f64; 2],
    pub(super) fov_deg: Option<f64>,
    pub(super) aspect: f64,
    pub(super) component: &'static str,
    pub(super) peak: bool,
    pub(super) alpha: Alpha,
    pub(super) tolerance: f64,
    pub(super) method: Option<Method>,
    pub(super) transport: Option<Transport>,
    pub(super) cumulus: CumulusMethod,
    pub(super) air: AirMethod,
    pub(super) seed: u32,
    pub(super) orders: u32,
    pub(super) layer: Option<u32>,
    pub(super) scale: f64,
    pub(super) exposure: Option<Exposure>,
    pub(super) ev100: Option<f64>,
    pub(super) tonemap: Tonemap,
    pub(super) mask: bool,
    pub(super) dither: bool,
    pub(super) depth: Option<u32>,
    /// Another coding than floats.
    pub(super) coding: Option<Coding>,
    pub(super) mips: Mips,
}

impl Given {
    /// What a query without parameters says.
    pub(super) fn new(format: Format) -> Self {
        Self {
            format,
            time_s: 0.0,
            size: None,
            side: Side::Below,
            direction: None,
            eye: None,
            layout: SphereLayout::Equirect.name(),
            axes: Axes::Enu,
            disc: false,
            spectrum: Spectrum::Visible,
            look_deg: [0.0; 2],
            fov_deg: None,
            aspect: 1.0,
            component: Component::Total.name(),
            peak: true,
            alpha: Alpha::Premultiplied,
            tolerance: Request::TOLERANCE,
            method: None,
            transport: None,
            cumulus: CumulusMethod::Lattice,
            air: AirMethod::Moments,
            seed: Reference::SEED,
            orders: 0,
            layer: None,
            scale: 1.0,
            exposure: None,
            ev100: None,
            tonemap: Tonemap::Filmic,
            mask: false,
            dither: false,
            depth: None,
            coding: None,
            mips: Mips::None,
        }
    }

    /// What no value alone is wrong about: the parameter, and why.
    pub(super) fn conflict(&self, texture: TextureKind) -> Option<(&'static str, String)> {
        if self.direction.is_some() && self.eye.is_some() {
            return Some(("eye", "either direction or eye can be given".to_owned()));
        }
        if self.exposure.is_some() && self.ev100.is_some() {
            return Some(("ev100", "either exposure or ev100 can be given".to_owned()));
        }
        if self.orders > 0 {
            let seen = matches!(texture, TextureKind::Cloud | TextureKind::Sky);
            let why = match self.method {
                _ if !seen => {
                    Some("only light that is seen is told apart by them; allowed: 0, or the textures cloud and sky")
                }
                Some(Method::Reference(_)) if self.format == Format::Exr => None,
                Some(Method::Reference(_)) => Some("only an OpenEXR file has layers for them; allowed: 0, or exr"),
                _ => Some("only Monte Carlo tells them apart; allowed: 0, or method=reference"),
            };
            if let Some(why) = why {
                return Some(("orders", why.to_owned()));
            }
        }
        let has_alpha = texture.channels().contains(&"A");
        if has_alpha && self.format == Format::Hdr {
            let detail = "a Radiance picture (hdr) has no alpha, which this texture has; allowed: exr, png, webp, ktx2, dds, f16, f32";
            return Some(("format", detail.to_owned()));
        }
        if let (Some(coding), Format::Ktx2 | Format::Dds) = (self.coding, self.format) {
            let single =
                texture.channels() == ["Y"] || self.spectrum != Spectrum::Visible && texture != TextureKind::Cloud;
            let why = match coding {
                Coding::Bc4 if !single => {
                    "is for one channel, and this texture has more; allowed: float, rgb9e5 or bc6h without alpha"
                }
                Coding::Rgb9e5 | Coding::Bc6h if has_alpha => "has no alpha, which this texture has; allowed: float",
                _ => "",
            };
            if !why.is_empty() {
                return Some(("coding", format!("\"{}\" {why}", coding.name())));
            }
        }
        if self.mips == Mips::Specular && matches!(self.format, Format::Ktx2 | Format::Dds) {
            let is_cube = matches!(texture, TextureKind::Sky | TextureKind::Compass) && self.layout == "cube";
            if !is_cube {
                return Some((
                    "mips",
                    "\"specular\" is for a sky with projection=cube; allowed: false, true".to_owned(),
                ));
            }
        }
        let too_wide = self.fov_deg.filter(|fov_deg| self.layout == "camera" && *fov_deg > MAX_CAMERA_FOV_DEG)?;
        Some(("fov", format!("\"{too_wide}\" is not allowed for a camera; allowed: 1 to {MAX_CAMERA_FOV_DEG}")))
    }

    /// The request for a texture, of what touches it.
    pub(super) fn request(&self, texture: TextureKind) -> Request {
        let (tolerance, layer, transport, cumulus) = (self.tolerance, self.layer, self.transport, self.cumulus);
        // The seed is the reference's own.
        let reference = Reference { seed: self.seed, orders: self.orders };
        let method = self.method.map(|method| match method {
            Method::Reference(_) => Method::Reference(reference),
            fast => fast,
        });
        let traced = method.and_then(Method::reference);
        // A tracer follows all orders.
        let air = if traced.is_some() { AirMethod::Moments } else { self.air };
        let wanted = match texture {
            TextureKind::Cloud => {
                let viewer = self.eye.map(Viewer::At).or(self.direction).unwrap_or(Viewer::UPRIGHT);
                let plane = Plane { side: self.side, viewer };
                Wanted::Cloud(Cloud { plane, layer, tolerance, method, transport, cumulus, air })
            }
            TextureKind::Shadow => Wanted::Shadow(Shadow { peak: self.peak, tolerance, reference: traced }),
            TextureKind::Irradiance => Wanted::Irradiance(Irradiance {
                component: match self.component {
                    "direct" => Component::Direct { peak: self.peak },
                    "diffuse" => Component::Diffuse { peak: self.peak },
                    _ => Component::Total,
                },
                spectrum: self.spectrum,
                tolerance,
                air,
                // Light on the ground goes through tables of fluxes, whatever the cloud's method.
                light: traced.map_or(GroundLight::Fast { transport }, GroundLight::Reference),
            }),
            TextureKind::Thickness => Wanted::Thickness { layer },
            TextureKind::Sky => {
                let (sphere, disc, spectrum) = (self.sphere(), self.disc, self.spectrum);
                Wanted::Sky(Sky { sphere, disc, spectrum, layer, tolerance, method, transport, cumulus, air })
            }
            TextureKind::Compass => Wanted::Compass(self.sphere()),
        };
        Request { wanted, time_s: self.time_s, size: self.size, output: self.output(texture) }
    }

    fn sphere(&self) -> Sphere {
        let layout = match self.layout {
            "octahedral" => SphereLayout::Octahedral,
            "cube" => SphereLayout::Cube,
            "fisheye" => SphereLayout::Fisheye { fov_deg: self.fov_deg.unwrap_or(FISHEYE_FOV_DEG) },
            "camera" => SphereLayout::Camera {
                look_deg: self.look_deg,
                fov_deg: self.fov_deg.unwrap_or(CAMERA_FOV_DEG),
                aspect: self.aspect,
            },
            _ => SphereLayout::Equirect,
        };
        let sphere = Sphere { layout, axes: self.axes, eye: self.eye.unwrap_or(EYE) };
        // Some files tell directions in the axes that were asked for; the others are their texels alone.
        if matches!(self.format, Format::Exr | Format::Hdr | Format::Ktx2) {
            sphere
        } else {
            Sphere { axes: sphere.plainest_axes(), ..sphere }
        }
    }

    fn packed(&self, container: Container, linear: Linear) -> Packed {
        let depth = if self.depth == Some(32) { Depth::Float } else { Depth::Half };
        let coding = self.coding.unwrap_or(Coding::Float(depth));
        Packed { container, linear, coding, mips: self.mips }
    }

    fn picture(&self, texture: TextureKind, depth: PictureDepth) -> Picture {
        if self.mask {
            return Picture::Mask { scale: self.scale, depth };
        }
        Picture::Display {
            exposure: match self.ev100.map(Exposure::Ev100).or(self.exposure) {
                Some(stops @ Exposure::Stops(_)) => stops,
                // Parts of a whole are not brighter or darker by the hour.
                Some(metered) if texture.is_light() => metered,
                _ => Exposure::Stops(0.0),
            },
            // Parts of a whole are not light: a tone curve would bend them.
            tonemap: if texture.is_light() { self.tonemap } else { Tonemap::None },
            // Steps of 16 bits are finer than any screen's.
            dither: self.dither && depth == PictureDepth::Eight,
            depth,
        }
    }

    fn output(&self, texture: TextureKind) -> Output {
        let alpha = if texture == TextureKind::Cloud { self.alpha } else { Alpha::Premultiplied };
        let linear = Linear { scale: self.scale, alpha };
        let picture = if self.depth == Some(16) { PictureDepth::Sixteen } else { PictureDepth::Eight };
        match self.format {
            Format::F32 => Output::F32 { linear },
            Format::F16 => Output::F16 { linear },
            Format::Hdr => Output::Hdr { linear },
            Format::Ktx2 => Output::Packed(self.packed(Container::Ktx2, linear)),
            Format::Dds => Output::Packed(self.packed(Container::Dds, linear)),
            Format::Exr => {
                let depth = self.depth.map(|bits| if bits == 32 { Depth::Float } else { Depth::Half });
                Output::Exr { linear, depth }
            }
            Format::Png => Output::Png(self.picture(texture, picture)),
            Format::Webp => Output::Webp(self.picture(texture, PictureDepth::Eight)),
        }
    }
}
