//! The envelope: what is no JSON in UTF-8 is told by name.

use crate::unreadable;
use skyloom::scene::Scene;

#[test]
fn a_byte_order_mark_of_utf8_is_skipped() {
    let with_mark = "\u{feff}{\"sun\": {\"zenith_deg\": 20}}";
    assert_eq!(Scene::from_json(with_mark.as_bytes()), Scene::from_json(&with_mark.as_bytes()[3..]));
    unreadable("\u{feff}\u{feff}{}".as_bytes());
}

#[test]
fn other_encodings_are_named() {
    let text = "{\"sun\": {\"zenith_deg\": 20}}";
    let utf16 = |order: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(order).collect::<Vec<_>>();
    let utf32 = |order: fn(u32) -> [u8; 4]| text.chars().flat_map(|c| order(u32::from(c))).collect::<Vec<_>>();
    for (mark, body, name) in [
        (&b"\xff\xfe"[..], utf16(u16::to_le_bytes), "UTF-16 (little-endian)"),
        (b"\xfe\xff", utf16(u16::to_be_bytes), "UTF-16 (big-endian)"),
        (b"\xff\xfe\0\0", utf32(u32::to_le_bytes), "UTF-32 (little-endian)"),
        (b"\0\0\xfe\xff", utf32(u32::to_be_bytes), "UTF-32 (big-endian)"),
    ] {
        for body in [body.clone(), [mark, &body].concat()] {
            let told = unreadable(&body);
            assert!(told.contains(name) && told.contains("UTF-8"), "{told}");
        }
    }
    assert!(unreadable(b"{\"sun\": \"\xe9t\xe9\"}").contains("0xE9 at offset 9"));
    assert!(unreadable(b"\x1f\x8b\x08\0").contains("gzip"));
    for nothing in [&b""[..], b" \n", b"\xef\xbb\xbf"] {
        assert!(unreadable(nothing).contains("no text"));
    }
}

#[test]
fn a_decimal_comma_between_fields_is_told() {
    let told = unreadable(br#"{"sun": {"zenith_deg": 12,5}}"#);
    assert!(told.contains("decimal point") && told.contains("line 1 column 27"), "{told}");
    let told = unreadable(b"{\"sun\":\n {\"zenith_deg\": 50},\n \"domain\": {\"extent_m\": 20000,25 }}");
    assert!(told.contains("decimal point") && told.contains("line 3"), "{told}");
    for other in [r#"{"sun": {"zenith_deg": 12,}}"#, r#"{"sun": {"zenith_deg": 012}}"#, "{\"a\": [1,2}", "{,5}", ""] {
        assert!(!unreadable(other.as_bytes()).contains("decimal"), "{other}");
    }
}
