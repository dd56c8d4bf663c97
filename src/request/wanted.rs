//! The textures, each with the parameters that touch it.

use crate::method::{AirMethod, CumulusMethod, Method, Reference, Transport};
use crate::projection::{Plane, Projection, Sphere};
use crate::spectrum::Spectrum;
use std::f64::consts::PI;

/// A texture that can be asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TextureKind {
    /// Radiance leaving the clouds towards the viewer, premultiplied, and alpha.
    Cloud,
    /// Part of the sun's beam that reaches the ground.
    Shadow,
    /// Downward irradiance on the ground.
    Irradiance,
    /// Geometric thickness of cloud.
    Thickness,
    /// Radiance that arrives at an eye from every direction.
    Sky,
    /// A test picture of directions.
    Compass,
}

impl TextureKind {
    /// Every texture.
    pub const ALL: [Self; 6] = [Self::Cloud, Self::Shadow, Self::Irradiance, Self::Thickness, Self::Sky, Self::Compass];

    /// Its name in addresses and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cloud => "cloud",
            Self::Shadow => "shadow",
            Self::Irradiance => "irradiance",
            Self::Thickness => "thickness",
            Self::Sky => "sky",
            Self::Compass => "compass",
        }
    }

    /// What its values are, for people.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Cloud => "radiance leaving the cloud towards the viewer, and alpha",
            Self::Shadow => "part of the sun's beam that reaches the ground, 550 nm",
            Self::Irradiance => "downward irradiance on the ground",
            Self::Thickness => "geometric thickness of cloud, metres",
            Self::Sky => "radiance that arrives at the eye: sky, clouds and ground",
            Self::Compass => {
                "a test picture: north red, east green, south blue, west yellow, up white, down black, the sun orange"
            }
        }
    }

    /// Unit of its values where they are of all visible light.
    fn unit(self, in_air: bool) -> &'static str {
        match (self, in_air) {
            (Self::Cloud | Self::Sky, true) => "kcd/m2",
            (Self::Cloud | Self::Sky, false) => "the scene's unit of irradiance per steradian",
            (Self::Irradiance, true) => "klx",
            (Self::Irradiance, false) => "the scene's unit of irradiance",
            (Self::Shadow | Self::Compass, _) => "1",
            (Self::Thickness, _) => "m",
        }
    }

    /// Names of its channels, where they are of all visible light.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Cloud => &["R", "G", "B", "A"],
            Self::Irradiance | Self::Sky | Self::Compass => &["R", "G", "B"],
            Self::Shadow | Self::Thickness => &["Y"],
        }
    }

    /// Whether its values are light, which a tone curve suits; the others are parts of a whole.
    pub fn is_light(self) -> bool {
        matches!(self, Self::Cloud | Self::Irradiance | Self::Sky)
    }

    /// The stages that it takes.
    pub fn needs(self) -> Needs {
        match self {
            Self::Cloud | Self::Sky => Needs { light: true, slab: true, ground_sun: false },
            Self::Shadow => Needs { light: false, slab: false, ground_sun: true },
            Self::Irradiance => Needs { light: true, slab: false, ground_sun: true },
            Self::Thickness | Self::Compass => Needs { light: false, slab: false, ground_sun: false },
        }
    }

    /// Whether it takes the scene's air and clouds, and with them their tables.
    pub fn shows_the_scene(self) -> bool {
        self != Self::Compass
    }

    /// The value that a camera of a given exposure value for ISO 100 shows as white, in kcd/m2, of light on the ground in klx:
    /// the luminance at which a sensor saturates by its saturation-based speed, 78 / 0.65 x 2^EV / 100 cd/m2 (ISO 12232), and
    /// the irradiance that makes a white surface so bright.
    pub fn white_of_camera(self, ev100: f64) -> f64 {
        let luminance = 1.2e-3 * ev100.exp2();
        if self == Self::Irradiance { PI * luminance } else { luminance }
    }

    /// The value that a picture shows as white. Of light twice that of a white, diffuse surface above the clouds under the
    /// scene's light, whose horizontal irradiance is given, so that the glare of a low sun and silver linings keep their
    /// shape; of thickness the deepest cloud.
    pub fn white(self, irradiance: f64, deepest_m: f64) -> f64 {
        let white = match self {
            Self::Cloud | Self::Sky => 2.0 * irradiance / PI,
            Self::Irradiance => 2.0 * irradiance,
            Self::Shadow | Self::Compass => 1.0,
            Self::Thickness => deepest_m.max(1.0),
        };
        if white > 0.0 { white } else { 1.0 }
    }

    /// How much brighter than [`white`](Self::white) an eye's white is in the dark, which it knows for what it is: 1 by day (100 klx), 2.7 at 10 lx,
    /// 20 by night. What was measured of painters' and photographers' keys by the luminance that an eye is used to (Krawczyk, Myszkowski and Seidel
    /// 2005, Perceptual effects in real-time tone mapping, equation 11): 1.03 - 2 / (2 + log10(Y + 1)), Y in cd/m2, here that of a white surface
    /// under the horizontal irradiance, klx.
    pub fn white_of_dusk(self, irradiance_klx: f64) -> f64 {
        let key = |klx: f64| 1.03 - 2.0 / (2.0 + (1e3 * klx.max(0.0) / PI + 1.0).log10());
        match self {
            Self::Cloud | Self::Sky | Self::Irradiance => key(DAY_KLX) / key(irradiance_klx),
            Self::Shadow | Self::Compass | Self::Thickness => 1.0,
        }
    }

    /// The names of all textures, in a row.
    pub fn names() -> String {
        Self::ALL.map(Self::name).join(", ")
    }
}

/// Horizontal irradiance of a clear day, klx.
const DAY_KLX: f64 = 100.0;

/// Stages that a texture takes beside the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Needs {
    /// Light between cloud and ground.
    pub light: bool,
    /// A method of slab light, for the light that leaves the clouds.
    pub slab: bool,
    /// The sun's beam at each texel of the ground.
    pub ground_sun: bool,
}

/// A texture with its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wanted {
    /// See [`TextureKind::Cloud`].
    Cloud(Cloud),
    /// See [`TextureKind::Shadow`].
    Shadow(Shadow),
    /// See [`TextureKind::Irradiance`].
    Irradiance(Irradiance),
    /// See [`TextureKind::Thickness`].
    Thickness {
        /// One layer alone (0 = lowest); all when `None`.
        layer: Option<u32>,
    },
    /// See [`TextureKind::Sky`].
    Sky(Sky),
    /// See [`TextureKind::Compass`].
    Compass(Sphere),
}

/// What is asked of the clouds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cloud {
    /// How they are seen.
    pub plane: Plane,
    /// One layer alone (0 = lowest); all when `None`. Light still uses all.
    pub layer: Option<u32>,
    /// Acceptable relative root-mean-square error.
    pub tolerance: f64,
    /// How slab light is computed; the plan's choice when `None`.
    pub method: Option<Method>,
    /// How sunlight is carried through uneven cloud; the plan's choice when `None`.
    pub transport: Option<Transport>,
    /// How light in cumulus is computed.
    pub cumulus: CumulusMethod,
    /// How light that air scatters more than once is found.
    pub air: AirMethod,
}

/// What is asked of the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sky {
    /// How directions become texels, and where the eye is.
    pub sphere: Sphere,
    /// The sun's disc is drawn.
    pub disc: bool,
    /// What light is made of.
    pub spectrum: Spectrum,
    /// One layer alone (0 = lowest); all when `None`. Light still uses all.
    pub layer: Option<u32>,
    /// Acceptable relative root-mean-square error.
    pub tolerance: f64,
    /// How slab light is computed; the plan's choice when `None`.
    pub method: Option<Method>,
    /// How sunlight is carried through uneven cloud; the plan's choice when `None`.
    pub transport: Option<Transport>,
    /// How light in cumulus is computed.
    pub cumulus: CumulusMethod,
    /// How light that air scatters more than once is found.
    pub air: AirMethod,
}

/// What is asked of the sun's beam on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shadow {
    /// Light scattered by less than 5 degrees counts as beam.
    pub peak: bool,
    /// Acceptable relative root-mean-square error.
    pub tolerance: f64,
    /// By Monte Carlo.
    pub reference: Option<Reference>,
}

/// What is asked of the light on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Irradiance {
    /// Which part of it.
    pub component: Component,
    /// What light is made of.
    pub spectrum: Spectrum,
    /// Acceptable relative root-mean-square error.
    pub tolerance: f64,
    /// How light that air scatters more than once is found.
    pub air: AirMethod,
    /// How it is computed.
    pub light: GroundLight,
}

/// How light on the ground is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GroundLight {
    /// By tables of fluxes.
    Fast {
        /// How sunlight is carried through uneven cloud; the plan's choice when `None`.
        transport: Option<Transport>,
    },
    /// By Monte Carlo.
    Reference(Reference),
}

/// Which part of the ground's irradiance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Component {
    /// All light.
    Total,
    /// The sun's beam.
    Direct {
        /// Light scattered by less than 5 degrees counts as beam.
        peak: bool,
    },
    /// All but the beam.
    Diffuse {
        /// Light scattered by less than 5 degrees counts as beam.
        peak: bool,
    },
}

impl Component {
    /// Names of the parts.
    pub const NAMES: [&'static str; 3] = ["total", "direct", "diffuse"];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Total => "total",
            Self::Direct { .. } => "direct",
            Self::Diffuse { .. } => "diffuse",
        }
    }
}

impl Wanted {
    /// The kind of texture.
    pub fn kind(&self) -> TextureKind {
        match self {
            Self::Cloud(_) => TextureKind::Cloud,
            Self::Shadow(_) => TextureKind::Shadow,
            Self::Irradiance(_) => TextureKind::Irradiance,
            Self::Thickness { .. } => TextureKind::Thickness,
            Self::Sky(_) => TextureKind::Sky,
            Self::Compass(_) => TextureKind::Compass,
        }
    }

    /// Acceptable relative root-mean-square error; none for what is exact.
    pub fn tolerance(&self) -> Option<f64> {
        match self {
            Self::Cloud(Cloud { tolerance, .. })
            | Self::Shadow(Shadow { tolerance, .. })
            | Self::Irradiance(Irradiance { tolerance, .. })
            | Self::Sky(Sky { tolerance, .. }) => Some(*tolerance),
            Self::Thickness { .. } | Self::Compass(_) => None,
        }
    }

    /// The method that is asked for.
    pub fn method(&self) -> Option<Method> {
        match self {
            Self::Cloud(cloud) => cloud.method,
            Self::Sky(sky) => sky.method,
            Self::Shadow(_) | Self::Irradiance(_) => self.reference().map(Method::Reference),
            Self::Thickness { .. } | Self::Compass(_) => None,
        }
    }

    /// Settings of the reference, where it is asked for.
    pub fn reference(&self) -> Option<Reference> {
        match self {
            Self::Cloud(cloud) => cloud.method.and_then(Method::reference),
            Self::Sky(sky) => sky.method.and_then(Method::reference),
            Self::Shadow(shadow) => shadow.reference,
            Self::Irradiance(Irradiance { light: GroundLight::Reference(reference), .. }) => Some(*reference),
            Self::Irradiance(_) | Self::Thickness { .. } | Self::Compass(_) => None,
        }
    }

    /// The transport of sunlight that is asked for.
    pub fn transport(&self) -> Option<Transport> {
        match self {
            Self::Cloud(cloud) => cloud.transport,
            Self::Sky(sky) => sky.transport,
            Self::Irradiance(Irradiance { light: GroundLight::Fast { transport }, .. }) => *transport,
            Self::Irradiance(_) | Self::Shadow(_) | Self::Thickness { .. } | Self::Compass(_) => None,
        }
    }

    /// The method of light in cumulus, where it is seen.
    pub fn cumulus(&self) -> Option<CumulusMethod> {
        match self {
            Self::Cloud(cloud) => Some(cloud.cumulus),
            Self::Sky(sky) => Some(sky.cumulus),
            Self::Shadow(_) | Self::Irradiance(_) | Self::Thickness { .. } | Self::Compass(_) => None,
        }
    }

    /// The method of light in the air, where it is seen.
    pub fn air(&self) -> Option<AirMethod> {
        match self {
            Self::Cloud(Cloud { air, .. }) | Self::Sky(Sky { air, .. }) | Self::Irradiance(Irradiance { air, .. }) => {
                Some(*air)
            }
            Self::Shadow(_) | Self::Thickness { .. } | Self::Compass(_) => None,
        }
    }

    /// The one layer that is asked for.
    pub fn layer(&self) -> Option<u32> {
        match self {
            Self::Cloud(Cloud { layer, .. }) | Self::Sky(Sky { layer, .. }) | Self::Thickness { layer } => *layer,
            Self::Shadow(_) | Self::Irradiance(_) | Self::Compass(_) => None,
        }
    }

    /// Which part of the irradiance.
    pub fn component(&self) -> Option<Component> {
        match self {
            Self::Irradiance(irradiance) => Some(irradiance.component),
            Self::Cloud(_) | Self::Shadow(_) | Self::Thickness { .. } | Self::Sky(_) | Self::Compass(_) => None,
        }
    }

    /// Whether light scattered by less than 5 degrees counts as beam, where that makes a difference.
    pub fn peak(&self) -> Option<bool> {
        match self {
            Self::Shadow(shadow) => Some(shadow.peak),
            _ => match self.component()? {
                Component::Total => None,
                Component::Direct { peak } | Component::Diffuse { peak } => Some(peak),
            },
        }
    }

    /// How the texels are laid out, where that can be chosen; maps of the domain have no choice.
    pub fn projection(&self) -> Option<Projection> {
        match self {
            Self::Cloud(cloud) => Some(Projection::Plane(cloud.plane)),
            Self::Sky(Sky { sphere, .. }) | Self::Compass(sphere) => Some(Projection::Sphere(*sphere)),
            Self::Shadow(_) | Self::Irradiance(_) | Self::Thickness { .. } => None,
        }
    }

    /// The plane that is seen, where one is.
    pub fn plane(&self) -> Option<&Plane> {
        match self {
            Self::Cloud(cloud) => Some(&cloud.plane),
            Self::Shadow(_) | Self::Irradiance(_) | Self::Thickness { .. } | Self::Sky(_) | Self::Compass(_) => None,
        }
    }

    /// Whether the sun's disc is drawn, where it could be.
    pub fn disc(&self) -> Option<bool> {
        match self {
            Self::Sky(sky) => Some(sky.disc),
            _ => None,
        }
    }

    /// What its light is made of, where that can be chosen.
    pub fn spectrum(&self) -> Option<Spectrum> {
        match self {
            Self::Sky(Sky { spectrum, .. }) | Self::Irradiance(Irradiance { spectrum, .. }) => Some(*spectrum),
            Self::Cloud(_) | Self::Shadow(_) | Self::Thickness { .. } | Self::Compass(_) => None,
        }
    }

    /// The one wavelength of its light, nm.
    pub fn wavelength_nm(&self) -> Option<f64> {
        match self.spectrum()? {
            Spectrum::Visible => None,
            Spectrum::Wavelength(nm) => Some(nm),
        }
    }

    /// Names of its channels.
    pub fn channels(&self) -> &'static [&'static str] {
        if self.wavelength_nm().is_some() { &["Y"] } else { self.kind().channels() }
    }

    /// Unit of its values. Where the scene gives its own light, which unit that is in is the caller's knowledge.
    pub fn unit(&self, in_air: bool) -> &'static str {
        match (self, self.wavelength_nm()) {
            (Self::Sky(_), Some(_)) => "1/sr of the sun's spectral irradiance above the air",
            (_, Some(_)) => "1, of the sun's spectral irradiance above the air",
            _ => self.kind().unit(in_air),
        }
    }

    /// The sphere that is seen, where one is.
    pub fn sphere(&self) -> Option<&Sphere> {
        match self {
            Self::Sky(Sky { sphere, .. }) | Self::Compass(sphere) => Some(sphere),
            Self::Cloud(_) | Self::Shadow(_) | Self::Irradiance(_) | Self::Thickness { .. } => None,
        }
    }
}
