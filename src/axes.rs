//! The frames of engines: how they name directions, and how they lay a panorama around themselves.
//!
//! Everything inside is east, north, up. An engine has other coordinates, some of them left-handed, and its own idea of which
//! azimuth lies at the left edge of an equirectangular picture; with the wrong one the sun is in a wrong place, and nothing
//! else shows it. Azimuths grow to the right in all of them: the pictures differ by a turn alone, which none of their formulas
//! mirrors.

/// A frame in which directions are told and panoramas are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axes {
    /// x east, y north, z up; north at the left edge.
    Enu,
    /// Unity's render pipelines: `DirectionToLatLongCoordinate`, u = 1 - atan2(x, -z) / 2 pi.
    Unity,
    /// Unity's older shader `Skybox/Panoramic`: u = 0.5 - atan2(z, x) / 2 pi.
    UnityBuiltin,
    /// Unreal Engine, in the frame of its georeferencing: a `.hdr` becomes a cube by u = 0.5 + atan2(x, -y) / 2 pi.
    Unreal,
    /// Godot 4: `PanoramaSkyMaterial`, u = atan2(x, -z) / 2 pi.
    Godot,
    /// three.js: `equirectUv`, u = 0.5 + atan(z, x) / 2 pi.
    Three,
    /// Blender's Cycles: u = (pi - atan2(y, x)) / 2 pi.
    Blender,
    /// OpenEXR's latitude-longitude maps, which USD's `DomeLight` follows: +z in the middle, +x at a quarter.
    Usd,
}

/// What a frame is.
struct Convention {
    name: &'static str,
    /// Directions of x, y and z: east, north, up.
    axes: [[f64; 3]; 3],
    /// Azimuth of the left edge of an equirectangular picture, turns: those of a shader must not be far from 0.
    left_turn: f64,
    /// Whether x of a cube's faces is that of the frame turned round.
    mirrored_cube: bool,
}

const EAST: [f64; 3] = [1.0, 0.0, 0.0];
const NORTH: [f64; 3] = [0.0, 1.0, 0.0];
const SOUTH: [f64; 3] = [0.0, -1.0, 0.0];
const UP: [f64; 3] = [0.0, 0.0, 1.0];

impl Axes {
    /// Every frame.
    pub const ALL: [Self; 8] =
        [Self::Enu, Self::Unity, Self::UnityBuiltin, Self::Unreal, Self::Godot, Self::Three, Self::Blender, Self::Usd];
    /// Their names, for messages.
    pub const WORDS: &'static str = "enu | unity | unity-builtin | unreal | godot | three | blender | usd";

    fn convention(self) -> Convention {
        let of = |name, axes, left_turn| Convention { name, axes, left_turn, mirrored_cube: false };
        match self {
            Self::Enu => of("enu", [EAST, NORTH, UP], 0.0),
            Self::Unity => of("unity", [EAST, UP, NORTH], -0.5),
            Self::UnityBuiltin => of("unity-builtin", [EAST, UP, NORTH], -0.25),
            Self::Unreal => of("unreal", [EAST, SOUTH, UP], -0.5),
            Self::Godot => of("godot", [EAST, UP, SOUTH], 0.0),
            // It looks cube maps that were loaded up at -x (`flipEnvMap`).
            Self::Three => Convention { mirrored_cube: true, ..of("three", [EAST, UP, SOUTH], -0.25) },
            Self::Blender => of("blender", [EAST, NORTH, UP], -0.25),
            Self::Usd => of("usd", [EAST, UP, SOUTH], 0.0),
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        self.convention().name
    }

    /// The frame of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|axes| axes.name() == name)
    }

    /// A vector (east, north, up) in this frame.
    pub fn of(self, vector: [f64; 3]) -> [f64; 3] {
        // Without negative zeros.
        self.convention().axes.map(|axis| axis.iter().zip(vector).map(|(part, value)| part * value).sum::<f64>() + 0.0)
    }

    /// Azimuth of the left edge of an equirectangular picture, degrees clockwise from north, 0 to below 360.
    pub fn left_azimuth_deg(self) -> f64 {
        360.0 * self.convention().left_turn.rem_euclid(1.0)
    }

    /// The axis that points up.
    pub fn up_axis(self) -> &'static str {
        if self.convention().axes[1] == UP { "+y" } else { "+z" }
    }

    /// `right` or `left`: whether x, y and z are as the fingers of that hand.
    pub fn handedness(self) -> &'static str {
        let [x, y, z] = self.convention().axes;
        let cross = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
        if cross.iter().zip(z).map(|(a, b)| a * b).sum::<f64>() > 0.0 { "right" } else { "left" }
    }

    /// x, y and z in words.
    pub fn in_words(self) -> String {
        let word = |axis: [f64; 3]| match axis {
            EAST => "east",
            NORTH => "north",
            SOUTH => "south",
            _ => "up",
        };
        let [x, y, z] = self.convention().axes.map(word);
        format!("x {x}, y {y}, z {z}")
    }

    /// Azimuth of the left edge of an equirectangular picture, turns, -0.5 to 0.5.
    pub(crate) fn left_turn(self) -> f64 {
        self.convention().left_turn
    }

    /// Directions (east, north, up) of x, y and z by which the faces of a cube are laid out.
    pub(crate) fn cube(self) -> [[f64; 3]; 3] {
        let Convention { axes: [x, y, z], mirrored_cube, .. } = self.convention();
        [if mirrored_cube { x.map(|part| -part) } else { x }, y, z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_those_of_all() {
        assert_eq!(Axes::ALL.map(Axes::name).join(" | "), Axes::WORDS);
    }

    #[test]
    fn handedness_is_what_the_engines_say() {
        let left = [Axes::Unity, Axes::UnityBuiltin, Axes::Unreal];
        for axes in Axes::ALL {
            assert_eq!(axes.handedness() == "left", left.contains(&axes), "{axes:?}");
            assert_eq!(axes.up_axis(), if axes.of([0.0, 0.0, 1.0])[1] == 1.0 { "+y" } else { "+z" });
            assert!(!axes.in_words().is_empty());
        }
    }
}
