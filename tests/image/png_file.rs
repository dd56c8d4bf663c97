//! A PNG writer of the plainest kind, to make files that no library would write.

fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 })
    })
}

pub(crate) fn chunk(kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let mut tagged = kind.to_vec();
    tagged.extend_from_slice(content);
    let mut chunk = (content.len() as u32).to_be_bytes().to_vec();
    chunk.extend_from_slice(&tagged);
    chunk.extend_from_slice(&crc(&tagged).to_be_bytes());
    chunk
}

/// zlib stream of one stored block.
pub(crate) fn stored(bytes: &[u8]) -> Vec<u8> {
    let length = u16::try_from(bytes.len()).unwrap();
    let mut stream = vec![0x78, 0x01, 0x01];
    stream.extend_from_slice(&length.to_le_bytes());
    stream.extend_from_slice(&(!length).to_le_bytes());
    stream.extend_from_slice(bytes);
    let (a, b) = bytes.iter().fold((1_u32, 0_u32), |(a, b), &byte| {
        let a = (a + u32::from(byte)) % 65521;
        (a, (b + a) % 65521)
    });
    stream.extend_from_slice(&((b << 16) | a).to_be_bytes());
    stream
}

/// `lines` are the scan lines with their filter bytes; `extra` are whole chunks between header and picture.
pub(crate) fn png(
    width: u32,
    height: u32,
    depth: u8,
    color: u8,
    interlaced: u8,
    extra: &[u8],
    lines: &[u8],
) -> Vec<u8> {
    let mut header = width.to_be_bytes().to_vec();
    header.extend_from_slice(&height.to_be_bytes());
    header.extend_from_slice(&[depth, color, 0, 0, interlaced]);
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    file.extend(chunk(b"IHDR", &header));
    file.extend_from_slice(extra);
    file.extend(chunk(b"IDAT", &stored(lines)));
    file.extend(chunk(b"IEND", b""));
    file
}
