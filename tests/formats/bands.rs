//! Textures for devices are written band by band, and are as long as is told before.

use std::io::{Seek, SeekFrom, Write};

use skyloom::encode::{Coding, Container, Depth, Mips, Output, Pixels, encode_to};

use super::{RGB, file, light, metadata, packed};

const CODINGS: [Coding; 4] = [Coding::Float(Depth::Half), Coding::Float(Depth::Float), Coding::Rgb9e5, Coding::Bc6h];
/// What a file says of itself, and what its levels lack to whole steps.
const HEAD: u64 = 4096;

/// A file of which only the longest piece is kept in mind.
#[derive(Default)]
struct Pieces {
    length: u64,
    longest: usize,
}

impl Write for Pieces {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.length += bytes.len() as u64;
        self.longest = self.longest.max(bytes.len());
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Seek for Pieces {
    fn seek(&mut self, _: SeekFrom) -> std::io::Result<u64> {
        Err(std::io::ErrorKind::Unsupported.into())
    }
}

/// The parts are cut where no band ends, in rows of blocks of their own.
#[test]
fn a_texture_of_several_bands_has_the_texels_of_its_parts() {
    let size = [1003, 1100];
    let data = light(1003 * 1100, 3);
    for container in [Container::Ktx2, Container::Dds] {
        for coding in CODINGS {
            let texels = |size: [u32; 2], data: &[f32]| {
                let file = file(&packed(container, coding, Mips::None), size, &RGB, data, "plane").unwrap();
                let of_texel = |bytes| bytes * (size[0] * size[1]) as usize;
                let length = match coding {
                    Coding::Float(depth) => of_texel(depth.bits() as usize / 2),
                    Coding::Bc6h => 16 * (size[0].div_ceil(4) * size[1].div_ceil(4)) as usize,
                    _ => of_texel(4),
                };
                file[file.len() - length..].to_vec()
            };
            let whole = texels(size, &data);
            let parts = [0..500, 500..800, 800..1100_usize].map(|rows| {
                let own = &data[3 * 1003 * rows.start..3 * 1003 * rows.end];
                texels([1003, rows.len() as u32], own)
            });
            assert!(whole == parts.concat(), "{container:?} {coding:?}");
        }
    }
}

#[test]
fn no_more_than_a_band_is_written_at_a_time_and_the_length_is_known_before() {
    let size = [2048, 1500];
    let data = light(2048 * 1500, 3);
    for container in [Container::Ktx2, Container::Dds] {
        for (coding, mips) in
            CODINGS.into_iter().flat_map(|coding| [Mips::None, Mips::Means].map(|mips| (coding, mips)))
        {
            let output = packed(container, coding, mips);
            let mut pieces = Pieces::default();
            let (alpha, [width, height]) = (output.linear().alpha, size);
            let texels = Pixels {
                width,
                height,
                channels: &RGB,
                data: &data,
                errors: None,
                layers: &[],
                alpha,
                fraction: false,
            };
            encode_to(&texels, &metadata("plane"), &output, 1.0, &mut pieces).unwrap();
            let Output::Packed(packed) = output else { return };
            let told = packed.bytes(size, 3);
            let blocks = if coding == Coding::Bc6h { told / 30 } else { 0 };
            assert!(
                (told - blocks..=told + HEAD).contains(&pieces.length),
                "{coding:?} {mips:?}: {told} {}",
                pieces.length
            );
            // 2^20 values are a band, and a texel of three is one of four in the file.
            assert!(pieces.longest <= 4 * (4 << 20) / 3 + 4 * 2048 * 16, "{coding:?} {mips:?}: {}", pieces.longest);
        }
    }
}
