//! Changes to inputs that are or were sound: of bytes, of words and numbers of a text, of values of a document, of chunks of a
//! PNG.

use std::io::{Read as _, Write as _};

use serde_json::{Value, json};

use crate::schema_tools::Random;

/// Pieces of text that readers of numbers and words stumble over.
const PIECES: [&str; 30] = [
    "-0",
    "1e400",
    "-1e-400",
    "NaN",
    "Infinity",
    "null",
    "true",
    "[]",
    "{}",
    "\"\"",
    "0.1e",
    "1e309",
    "-1",
    "4294967296",
    "18446744073709551616",
    "9007199254740993",
    "\\u0000",
    "\\ud800",
    "\u{feff}",
    "{\"a\":{\"a\":",
    "[[[[",
    "1_000",
    "0x1",
    "+1",
    "1.",
    ".5",
    "2026-02-30T25:61:61Z",
    "%00",
    "&",
    "\u{0}",
];

/// Some bytes of another or the same input.
pub(crate) fn bytes(input: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut changed = input.to_vec();
    for _ in 0..1 + random.below(4) {
        let at = random.below(changed.len() + 1);
        match random.below(7) {
            0 if at < changed.len() => changed[at] ^= 1 << random.below(8),
            1 if at < changed.len() => changed[at] = *random.pick(&[0, 1, 127, 128, 254, 255]),
            2 => changed.insert(at, random.next().to_le_bytes()[0]),
            3 => {
                let end = (at + random.below(16)).min(changed.len());
                changed.drain(at..end);
            }
            4 => {
                let from = random.below(other.len() + 1);
                let piece = &other[from..(from + random.below(64)).min(other.len())];
                changed.splice(at..at, piece.iter().copied());
            }
            5 => changed.splice(at..at, random.pick(&PIECES).bytes()).for_each(drop),
            _ if random.once_in(4) => changed.truncate(at),
            _ => {}
        }
    }
    changed
}

/// A text with a number or a word in it replaced.
pub(crate) fn text(input: &str, random: &mut Random) -> String {
    let is_word = |letter: char| letter.is_ascii_alphanumeric() || "+-._".contains(letter);
    let mut places: Vec<(usize, usize)> = Vec::new();
    let mut start = None;
    for (at, letter) in input.char_indices().chain([(input.len(), ' ')]) {
        match (is_word(letter), start) {
            (true, None) => start = Some(at),
            (false, Some(from)) => {
                places.push((from, at));
                start = None;
            }
            _ => {}
        }
    }
    if places.is_empty() {
        return (*random.pick(&PIECES)).to_owned();
    }
    let (from, to) = *random.pick(&places);
    let (other_from, other_to) = *random.pick(&places);
    let piece = if random.once_in(2) { *random.pick(&PIECES) } else { &input[other_from..other_to] };
    format!("{}{piece}{}", &input[..from], &input[to..])
}

/// A document with one value replaced: by something odd, or by a part of another document.
pub(crate) fn value(document: &mut Value, other: &Value, random: &mut Random) {
    let inner: Vec<&mut Value> = match document {
        Value::Object(map) => {
            if random.once_in(12) {
                let name = (*random.pick(&PIECES)).to_owned();
                map.insert(name, part(other, random));
                return;
            }
            if random.once_in(12)
                && let Some(name) = map.keys().next().cloned()
            {
                map.remove(&name);
                return;
            }
            map.values_mut().collect()
        }
        Value::Array(list) => {
            if random.once_in(8) && !list.is_empty() && list.len() < 64 {
                list.extend_from_within(..);
                return;
            }
            list.iter_mut().collect()
        }
        _ => Vec::new(),
    };
    if inner.is_empty() || random.once_in(5) {
        *document = if random.once_in(3) { part(other, random) } else { odd(random) };
        return;
    }
    let at = random.below(inner.len());
    if let Some(inner) = inner.into_iter().nth(at) {
        value(inner, other, random);
    }
}

fn part(document: &Value, random: &mut Random) -> Value {
    let inner: Vec<&Value> = match document {
        Value::Object(map) => map.values().collect(),
        Value::Array(list) => list.iter().collect(),
        _ => Vec::new(),
    };
    if inner.is_empty() || random.once_in(4) { document.clone() } else { part(random.pick::<&Value>(&inner), random) }
}

fn odd(random: &mut Random) -> Value {
    let any = f64::from_bits(random.next());
    let all = [
        json!(null),
        json!(0),
        json!(-0.0),
        json!(-1),
        json!(1),
        json!(1e-320),
        json!(f64::MAX),
        json!(f64::MIN_POSITIVE),
        json!(u64::MAX),
        json!(4096),
        json!(360.0),
        json!(0.5),
        json!(any),
        json!("image"),
        json!(""),
        json!([]),
        json!({}),
        json!([0, 1, 2]),
        json!([[0, 1], [180, 0]]),
        json!(true),
        json!("0".repeat(64)),
    ];
    random.pick(&all).clone()
}

/// A PNG whose chunks were changed and have right sums, so that readers come farther than that.
pub(crate) fn png(input: &[u8], random: &mut Random) -> Vec<u8> {
    let mut chunks = chunks(input);
    for _ in 0..1 + random.below(3) {
        if chunks.is_empty() {
            break;
        }
        let at = random.below(chunks.len());
        match random.below(6) {
            0 => {
                let chunk = chunks[at].clone();
                chunks.insert(random.below(chunks.len() + 1), chunk);
            }
            1 => drop(chunks.remove(at)),
            2 => {
                let name = *random.pick(&[
                    *b"tRNS", *b"PLTE", *b"gAMA", *b"cHRM", *b"iCCP", *b"sBIT", *b"eXIf", *b"acTL", *b"fcTL", *b"fdAT",
                    *b"cICP",
                ]);
                let data = (0..random.below(40)).map(|_| random.next().to_le_bytes()[0]).collect();
                chunks.insert(at, (name, data));
            }
            _ if &chunks[at].0 == b"IDAT" && random.once_in(2) => {
                let mut raw = Vec::new();
                // What can be read of it.
                let _ = flate2::read::ZlibDecoder::new(&chunks[at].1[..]).read_to_end(&mut raw);
                let raw = bytes(&raw, &[], random);
                let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
                packed.write_all(&raw).unwrap();
                chunks[at].1 = packed.finish().unwrap();
            }
            _ => chunks[at].1 = bytes(&chunks[at].1, &[], random),
        }
    }
    let mut file = input[..8].to_vec();
    for (name, data) in chunks {
        file.extend(u32::try_from(data.len()).unwrap().to_be_bytes());
        let mut sum = flate2::Crc::new();
        sum.update(&name);
        sum.update(&data);
        file.extend(name);
        file.extend(data);
        file.extend(sum.sum().to_be_bytes());
    }
    file
}

fn chunks(file: &[u8]) -> Vec<([u8; 4], Vec<u8>)> {
    let (mut found, mut rest) = (Vec::new(), &file[8..]);
    while rest.len() >= 12 {
        let length = u32::from_be_bytes(rest[..4].try_into().unwrap()) as usize;
        found.push((rest[4..8].try_into().unwrap(), rest[8..8 + length].to_vec()));
        rest = &rest[12 + length..];
    }
    found
}
