//! OpenEXR files as parts of one file (OpenEXR 2, "Multi-Part OpenEXR Files"): their blocks are taken as they are.

use super::error::EncodeError;

/// Magic number and version of a file.
const HEAD: usize = 8;
/// The version's flag of several parts.
const MULTI_PART: u32 = 1 << 12;

/// A file of one part, taken to pieces.
struct Part<'a> {
    /// Its attributes, one behind the other.
    attributes: &'a [u8],
    blocks: Vec<&'a [u8]>,
}

/// One file of named files that [`to_exr`](super::to_exr) has written. Their sizes have to be one, as readers want one display
/// window for all parts, and their names different.
///
/// # Errors
/// [`EncodeError::Codec`] for other files.
pub fn to_multi_part(files: &[(&str, &[u8])]) -> Result<Vec<u8>, EncodeError> {
    let parts = files.iter().map(|(name, file)| {
        read(file).ok_or_else(|| EncodeError::Codec(format!("part {name} is no file of one part in scan lines")))
    });
    let parts: Vec<Part<'_>> = parts.collect::<Result<_, _>>()?;
    let mut file = exr::meta::magic_number::BYTES.to_vec();
    file.extend((2 | MULTI_PART).to_le_bytes());
    for ((name, _), part) in files.iter().zip(&parts) {
        file.extend(part.attributes);
        let count = (part.blocks.len() as u32).to_le_bytes();
        for (name, kind, value) in [
            ("name", "string", name.as_bytes()),
            ("type", "string", b"scanlineimage".as_slice()),
            ("chunkCount", "int", count.as_slice()),
        ] {
            file.extend([name.as_bytes(), &[0], kind.as_bytes(), &[0]].concat());
            file.extend((value.len() as u32).to_le_bytes());
            file.extend(value);
        }
        file.push(0);
    }
    file.push(0);
    let blocks =
        || parts.iter().enumerate().flat_map(|(number, part)| part.blocks.iter().map(move |block| (number, *block)));
    // The tables come first, then each block behind the number of its part.
    let mut place = file.len() + 8 * blocks().count();
    for (_, block) in blocks() {
        file.extend((place as u64).to_le_bytes());
        place += 4 + block.len();
    }
    file.reserve_exact(place - file.len());
    for (number, block) in blocks() {
        file.extend((number as u32).to_le_bytes());
        file.extend(block);
    }
    Ok(file)
}

fn read(file: &[u8]) -> Option<Part<'_>> {
    let is_single = file.starts_with(&exr::meta::magic_number::BYTES) && file.get(4..HEAD)? == 2_u32.to_le_bytes();
    if !is_single {
        return None;
    }
    let mut end = HEAD;
    while *file.get(end)? != 0 {
        // Name and type end with a zero.
        for _ in 0..2 {
            end += file.get(end..)?.iter().position(|byte| *byte == 0)? + 1;
        }
        end += 4 + u32::from_le_bytes(file.get(end..end + 4)?.try_into().ok()?) as usize;
    }
    let table = end + 1;
    let offset = |at: usize| Some(u64::from_le_bytes(file.get(at..at + 8)?.try_into().ok()?) as usize);
    let first = offset(table)?;
    let mut offsets = (table..first).step_by(8).map(offset).collect::<Option<Vec<_>>>()?;
    offsets.push(file.len());
    let blocks = offsets.windows(2).map(|ends| file.get(ends[0]..ends[1])).collect::<Option<Vec<_>>>()?;
    Some(Part { attributes: file.get(HEAD..end)?, blocks })
}
