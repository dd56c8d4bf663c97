//! The channels of an OpenEXR file: which there are, and which make a map.

use exr::math::Vec2;
use exr::meta::attribute::{ChannelDescription, SampleType, Text};

use super::bytes::Bytes;
use crate::image::error::{ImageError, broken};

/// More channels than any map has; bounds the memory of one block.
const MAX_CHANNELS: usize = 32;

/// Where a channel's samples are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Channel {
    /// Where its samples start in a line, in bytes per texel of the line.
    pub(super) byte_offset: usize,
    pub(super) sample_type: SampleType,
}

/// The channels that are read.
#[derive(Debug)]
pub(super) struct Chosen {
    /// Red, green and blue, or one.
    pub(super) samples: Vec<Channel>,
    /// Looked at alone: it has to be 1 everywhere.
    pub(super) alpha: Option<Channel>,
}

/// Reads the list of channels and chooses from them.
pub(super) fn read(list: &mut Bytes<'_>) -> Result<(Vec<ChannelDescription>, Chosen), ImageError> {
    let mut channels: Vec<ChannelDescription> = Vec::new();
    loop {
        let name = list.name()?;
        if name.is_empty() {
            break;
        }
        if channels.len() == MAX_CHANNELS {
            return Err(broken(format!("more than {MAX_CHANNELS} channels are not supported")));
        }
        if channels.last().is_some_and(|last| last.name.as_slice() >= name) {
            return Err(broken(
                "the channels are not in the order of their names, so whose samples are whose is unsaid",
            ));
        }
        let sample_type = match list.i32()? {
            0 => SampleType::U32,
            1 => SampleType::F16,
            2 => SampleType::F32,
            _ => return Err(broken("a channel has an unknown sample type")),
        };
        let [linear, _, _, _] = list.array()?;
        let mut sampling = || list.i32().map(|every| usize::try_from(every).unwrap_or(0));
        channels.push(ChannelDescription {
            name: Text::from_slice_unchecked(name),
            sample_type,
            quantize_linearly: linear != 0,
            sampling: Vec2(sampling()?, sampling()?),
        });
    }
    let chosen = choose(&channels)?;
    Ok((channels, chosen))
}

/// `R`, `G` and `B`, or the only one; `A` beside them.
fn choose(channels: &[ChannelDescription]) -> Result<Chosen, ImageError> {
    let placed = channels.iter().scan(0, |offset, channel| {
        let byte_offset = *offset;
        *offset += channel.sample_type.bytes_per_sample();
        Some((channel.name.as_slice(), Channel { byte_offset, sample_type: channel.sample_type }))
    });
    // An alpha that is alone is a map like any other.
    let (alpha, samples): (Vec<_>, Vec<_>) = placed.partition(|(name, _)| channels.len() > 1 && *name == b"A");
    let names: Vec<&[u8]> = samples.iter().map(|(name, _)| *name).collect();
    let coarse = channels.iter().find(|channel| channel.sampling != Vec2(1, 1));
    let chosen = |channels: &[usize]| Chosen {
        samples: channels.iter().filter_map(|at| samples.get(*at)).map(|&(_, channel)| channel).collect(),
        alpha: alpha.first().map(|&(_, channel)| channel),
    };
    match names.as_slice() {
        [b"B", b"G", b"R"] if coarse.is_none() => Ok(chosen(&[2, 1, 0])),
        [_] if coarse.is_none() => Ok(chosen(&[0])),
        names => Err(refusal(names, coarse)),
    }
}

/// Why channels make no map, by what they seem to be.
fn refusal(names: &[&[u8]], coarse: Option<&ChannelDescription>) -> ImageError {
    let has = |name: &[u8]| names.contains(&name);
    let colours = [b"R".as_slice(), b"G", b"B"].into_iter().filter(|name| has(name)).count();
    let reason = if names.is_empty() {
        return broken("the file has no channels");
    } else if has(b"Y") && (has(b"RY") || has(b"BY")) {
        "luminance and chroma; save the picture as RGB".to_owned()
    } else if has(b"X") && has(b"Y") && has(b"Z") {
        "CIE XYZ, it seems; save the picture as RGB".to_owned()
    } else if let Some(channel) = coarse {
        let (name, Vec2(across, down)) = (channel.name.as_slice().escape_ascii(), channel.sampling);
        format!("{name} has a sample only for every {across} x {down} texels; save it with one for each")
    } else if names.iter().any(|name| name.contains(&b'.')) {
        "several layers; save the one that is the map, alone".to_owned()
    } else if colours == 3 {
        "those beside R, G and B would be ignored; save the picture without them".to_owned()
    } else if colours == names.len() {
        "only a part of R, G and B; save all three, or a single channel".to_owned()
    } else {
        "none of them is the map more than another; save one alone".to_owned()
    };
    let list: Vec<String> = names.iter().map(|name| name.escape_ascii().to_string()).collect();
    broken(format!(
        "the channels {} are no map: {reason}. R, G and B are wanted, or a single channel of any name; beside them only an \
         alpha A that is 1 everywhere",
        list.join(", ")
    ))
}
