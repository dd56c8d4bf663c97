//! The chunks of a PNG: those that hold the picture, and what the others state about it.

use image::metadata::Orientation;

use super::profile;
use crate::image::colour::{self, Colour};
use crate::image::error::{ImageError, broken};

/// First bytes of every PNG file.
pub(in crate::image) const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// Content of the chunks that say how samples are meant; the first of each kind.
#[derive(Default)]
pub(super) struct Statements<'a> {
    code_points: Option<&'a [u8]>,
    profile: Option<&'a [u8]>,
    srgb: Option<&'a [u8]>,
    gamma: Option<&'a [u8]>,
    primaries: Option<&'a [u8]>,
    exif: Option<&'a [u8]>,
}

/// The file as the decoder is to see it, and the statements in it. Texts are compressed apart and may inflate to gigabytes,
/// and the chunks of an animation change what the first frame is: they are left out, as neither changes the samples. What
/// makes colours transparent stays, and so does a profile, which the decoder inflates within its limits.
pub(super) fn read(bytes: &[u8]) -> Result<(Vec<u8>, Statements<'_>), ImageError> {
    let mut kept = SIGNATURE.to_vec();
    let mut rest = bytes.get(SIGNATURE.len()..).unwrap_or_default();
    let mut statements = Statements::default();
    let mut before_picture = true;
    loop {
        let Some((&[l0, l1, l2, l3, k0, k1, k2, k3], _)) = rest.split_first_chunk::<8>() else {
            return Err(broken("the file ends before its last chunk"));
        };
        // Length, kind and checksum take 12 bytes around the content.
        let length = u64::from(u32::from_be_bytes([l0, l1, l2, l3]));
        let Some((chunk, after)) = usize::try_from(length + 12).ok().and_then(|whole| rest.split_at_checked(whole))
        else {
            return Err(broken("the file ends within a chunk"));
        };
        let content = chunk.get(8..chunk.len() - 4).unwrap_or_default();
        rest = after;
        let statement = match &[k0, k1, k2, k3] {
            b"IHDR" | b"PLTE" => {
                kept.extend_from_slice(chunk);
                continue;
            }
            b"IDAT" => {
                before_picture = false;
                kept.extend_from_slice(chunk);
                continue;
            }
            b"IEND" => {
                kept.extend_from_slice(chunk);
                return Ok((kept, statements));
            }
            // A capital first letter marks what a reader must understand.
            kind if kind[0].is_ascii_uppercase() => {
                return Err(broken(format!("the chunk {} is not supported", kind.escape_ascii())));
            }
            b"eXIf" => &mut statements.exif,
            // The others have to come before the picture (PNG, third edition, table 7).
            _ if !before_picture => continue,
            b"tRNS" => {
                kept.extend_from_slice(chunk);
                continue;
            }
            b"iCCP" => {
                kept.extend_from_slice(chunk);
                &mut statements.profile
            }
            b"cICP" => &mut statements.code_points,
            b"sRGB" => &mut statements.srgb,
            b"gAMA" => &mut statements.gamma,
            b"cHRM" => &mut statements.primaries,
            _ => continue,
        };
        statement.get_or_insert(content);
    }
}

impl Statements<'_> {
    /// How the picture is to be turned, if it is.
    pub(super) fn turned(&self) -> Option<&'static str> {
        match Orientation::from_exif_chunk(self.exif?)? {
            Orientation::NoTransforms => None,
            Orientation::Rotate90 => Some("by 90 degrees"),
            Orientation::Rotate180 => Some("by 180 degrees"),
            Orientation::Rotate270 => Some("by 270 degrees"),
            Orientation::FlipHorizontal => Some("left to right"),
            Orientation::FlipVertical => Some("upside down"),
            Orientation::Rotate90FlipH | Orientation::Rotate270FlipH => Some("about a diagonal"),
        }
    }

    /// What is said of the colours: of several statements that with precedence (PNG, third edition, 4.3). `profile` is the
    /// content of the profile, if it could be read.
    pub(super) fn colour(&self, profile: Option<&[u8]>, channels: usize) -> Colour {
        if let Some(code_points) = self.code_points {
            // Rec. ITU-T H.273: primaries of Rec.709; the curve of sRGB, or none; RGB; the full range.
            return match code_points {
                [1, 13, 0, 1] => Colour::Srgb,
                [1, 8, 0, 1] => Colour::Linear,
                other => Colour::Other(format!("the code points {other:?} (cICP)")),
            };
        }
        if let Some(chunk) = self.profile {
            let name = chunk.split(|byte| *byte == 0).next().unwrap_or_default().escape_ascii();
            let known = profile.and_then(profile::colour);
            return known.unwrap_or_else(|| Colour::Other(format!("the colour profile \"{name}\" (iCCP)")));
        }
        if self.srgb.is_some() {
            return Colour::Srgb;
        }
        if channels == 3 && self.primaries.is_some_and(|value| !are_rec709(value)) {
            return Colour::Other("primaries other than those of sRGB (cHRM)".to_owned());
        }
        match self.gamma.map(|value| value.first_chunk().map_or(0, |bytes| u32::from_be_bytes(*bytes))) {
            None => Colour::Unsaid,
            // 1/2.2 stands for the curve of sRGB: PNG itself gives it as the approximation.
            Some(45_000..=46_000) => Colour::Srgb,
            Some(99_000..=101_000) => Colour::Linear,
            Some(other) => Colour::Other(format!("a gamma of {} (gAMA)", f64::from(other) / 1e5)),
        }
    }
}

/// Whether eight numbers, x and y of white, red, green and blue times 100,000, are those of Rec.709.
fn are_rec709(value: &[u8]) -> bool {
    let (words, _) = value.as_chunks::<4>();
    let pairs: Vec<[f64; 2]> = words
        .chunks_exact(2)
        .map(|pair| [pair[0], pair[1]].map(|word| f64::from(u32::from_be_bytes(word)) / 1e5))
        .collect();
    match pairs.as_slice() {
        &[white, red, green, blue] => colour::is_rec709(&[red, green, blue, white]),
        _ => false,
    }
}
